"""`vibench export`: a recording, or a part of it, as a file of another program."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import open_recording
from vibench.acquisition.recording import SealDepth, SealState
from vibench.analysis import (
    FrequencyResponseRequest,
    InvalidRequest,
    MagnitudeScale,
    quantities_named,
    spectral_functions,
)
from vibench.analysis.exchange import Format, Results, excerpt, export_functions, export_samples

from .options import option
from .output import console, leave_output_to_json, print_json, print_warnings
from .paths import AllowExternal, AsJson, external_data, file_at
from .progress_bars import transfer_bar


def export(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING.h5", help="Finished or still growing.")],
    to: Annotated[Format, option("What to make of it.")],
    out: Annotated[
        Path | None, option("The new file, or a folder for it; beside the recording if absent.", "PATH")
    ] = None,
    channels: Annotated[str, option("Some of its channels, with commas; all if absent.", "NAMES")] = "",
    from_s: Annotated[float | None, option("Seconds since the first sample.", "S", name="--from")] = None,
    to_s: Annotated[float | None, option("Seconds since the first sample.", "S", name="--until")] = None,
    results: Annotated[bool, option("Results that were saved in the recording, too.")] = False,
    spectra: Annotated[
        bool,
        option(
            "Densities of the channels over what was played, and of noise the frequency response, in "
            "place of samples (uff)."
        ),
    ] = False,
    quantity: Annotated[
        str | None, option("Of m0 over base, for --spectra: as in 'vibench analyse'; displacement if absent.")
    ] = None,
    allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Write a recording's samples or spectra, with units, as a file that other programs read."""
    if quantity is not None and not spectra:
        raise InvalidRequest(
            "--quantity was given without --spectra, and samples are of every channel; give both"
        )
    if as_json:
        leave_output_to_json()
    with external_data(allow_external), open_recording(recording) as opened:
        chosen = excerpt(
            opened, tuple(each.strip() for each in channels.split(",")) if channels else (), from_s, to_s
        )
        seal = opened.check_seal(SealDepth.QUICK)
        if seal.state not in (SealState.INTACT, SealState.UNFINISHED):
            print_warnings([f"{recording.name}: {seal.sentence}"])
        path = file_at(out, recording.with_name(f"{chosen.name}.{to.value}"))
        if spectra:
            view = quantities_named(quantity or "displacement", MagnitudeScale.LOG)
            functions = spectral_functions(chosen, FrequencyResponseRequest(view=view))
            written = export_functions(chosen, functions, to, path)
        else:
            included = Results.INCLUDED if results else Results.LEFT_OUT
            with transfer_bar(f"export as {to.value}", chosen.values) as observer:
                written = export_samples(chosen, to, path, included, observer)
    for each in written:
        console.print(f"wrote {each}")
    if as_json:
        print_json({"files": [str(each) for each in written]})
