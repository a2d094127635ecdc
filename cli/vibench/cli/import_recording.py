"""`vibench import`: convert another program's file to a recording."""

import math
import shlex
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import load_toml, open_recording
from vibench.analysis import InvalidRequest
from vibench.analysis.exchange import ImportMapping, import_recording, open_source

from .options import option
from .output import console, print_json, print_warnings
from .paths import AllowExternal, AsJson, file_at
from .progress_bars import transfer_bar


def import_file(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="UFF, HDF5, MATLAB, TDMS, WAV or CSV file.")],
    mapping: Annotated[
        Path | None, option("File that maps the channels; without it, the channels are listed.", "MAP.toml")
    ] = None,
    out: Annotated[
        Path | None, option("Path of the new recording or its folder; by default beside FILE.", "NAME.h5")
    ] = None,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Convert another program's file to a recording, or list its contents."""
    if mapping is None:
        if out is not None:
            raise InvalidRequest(f"{out} cannot be written without a mapping; give --mapping MAP.toml")
        _print_contents(file, as_json)
        return
    meaning = load_toml(mapping, ImportMapping)
    with open_source(file) as source:
        longest = max(each.samples for each in source.channels)
    target = file_at(out, file.with_suffix(".h5"))
    with transfer_bar("import", longest * len(meaning.channels)) as observer:
        made = import_recording(file, meaning, target, observer)
    with open_recording(made) as recording:
        print_warnings(recording.bench["imported"]["time"])
    if as_json:
        print_json({"recording": str(made)})
    else:
        console.print(f"wrote {made}; next: vibench analyse {shlex.quote(str(made))}")


def _print_contents(file: Path, as_json: bool) -> None:
    with open_source(file) as source:
        channels = source.channels
    if as_json:
        print_json({"file": str(file), "channels": [asdict(each) for each in channels]})
        return
    for each in channels:
        low, high = each.rates_hz
        rate = ""
        if each.sample_rate_hz is not None:
            rate = f", {each.sample_rate_hz:.9g} samples/s"
        elif math.isfinite(high):
            rate = f", about {(low + high) / 2:.5g} samples/s"
        unit = f", {each.unit}" if each.unit else ""
        label = f" ({each.label})" if each.label else ""
        console.print(f"{each.name!r}{label}: {each.samples} samples{rate}{unit}")
    console.print("Describe the channels in a mapping (docs/exchange.md), and give its file with --mapping.")
