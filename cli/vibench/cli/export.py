"""`vibench export`: convert a recording, or a part of it, for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import open_recording
from vibench.acquisition.recording import SealDepth, SealState
from vibench.analysis import (
    FrequencyResponseRequest,
    InvalidRequest,
    MagnitudeScale,
    parse_view,
    recordings_in,
    scan_files,
    spectral_functions,
)
from vibench.analysis.exchange import Format, Results, excerpt, export_functions, export_samples

from .options import option
from .output import console, leave_output_to_json, print_json, print_warnings
from .paths import AllowExternal, AsJson, file_at
from .progress_bars import transfer_bar


def export(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING.h5",
            help="Recording, complete or still growing; or the folder of a scan, with --to uff --spectra.",
        ),
    ],
    to: Annotated[Format, option("Format of the new file.")],
    out: Annotated[
        Path | None, option("Path of the new file or its folder; by default beside the recording.", "PATH")
    ] = None,
    channels: Annotated[str, option("Channels, separated by commas; by default all.", "NAMES")] = "",
    from_s: Annotated[float | None, option("Start [s]; 0 at the first sample.", "S", name="--from")] = None,
    to_s: Annotated[float | None, option("End [s]; 0 at the first sample.", "S", name="--until")] = None,
    results: Annotated[bool, option("Also export results stored in the recording.")] = False,
    spectra: Annotated[
        bool,
        option(
            "Export spectra in place of samples (uff): spectral densities of the channels, and for noise "
            "the frequency response."
        ),
    ] = False,
    quantity: Annotated[
        str | None,
        option("With --spectra: quantity as in 'vibench analyse'; by default displacement."),
    ] = None,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Write a recording's samples or spectra, with units, to a file for other programs."""
    if quantity is not None and not spectra:
        raise InvalidRequest("--quantity was given without --spectra, which it needs; give both, or neither")
    if as_json:
        leave_output_to_json()
    if recording.is_dir():
        if not spectra or to is not Format.UFF or channels or results or (from_s, to_s) != (None, None):
            raise InvalidRequest(
                f"{recording} is a folder; give a recording (vibench catalogue lists them). The folder "
                "of a scan is exported by --to uff --spectra, with --out and --quantity if needed"
            )
        place = recording.resolve()
        request = FrequencyResponseRequest(view=parse_view(quantity or "displacement", MagnitudeScale.LOG))
        path = file_at(out, place / f"{place.name}.uff")
        _report(tuple(scan_files(recordings_in(recording), request, path)), as_json=as_json)
        return
    with open_recording(recording) as opened:
        chosen = excerpt(
            opened, tuple(each.strip() for each in channels.split(",")) if channels else (), from_s, to_s
        )
        seal = opened.check_seal(SealDepth.QUICK)
        if seal.state not in (SealState.INTACT, SealState.UNFINISHED):
            print_warnings([f"{recording.name}: {seal.sentence}"])
        path = file_at(out, recording.with_name(f"{chosen.name}.{to.value}"))
        if spectra:
            view = parse_view(quantity or "displacement", MagnitudeScale.LOG)
            functions = spectral_functions(chosen, FrequencyResponseRequest(view=view))
            written = export_functions(chosen, functions, to, path)
        else:
            included = Results.INCLUDED if results else Results.LEFT_OUT
            with transfer_bar(f"export as {to.value}", chosen.values) as observer:
                written = export_samples(chosen, to, path, included, observer)
    _report(written, as_json=as_json)


def _report(written: tuple[Path, ...], *, as_json: bool) -> None:
    for each in written:
        console.print(f"wrote {each}")
    if as_json:
        print_json({"files": [str(each) for each in written]})
