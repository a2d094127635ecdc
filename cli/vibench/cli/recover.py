"""`vibench recover`: finish a recording that was cut off."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.recording import recover

from .output import console, print_json
from .paths import AllowExternal, AsJson, external_data


def recover_recording(
    recording: Annotated[Path, typer.Argument(metavar="NAME.h5.part", help="What was left of it.")],
    allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Finish a recording that was cut off: all that was committed becomes NAME.h5."""
    with external_data(allow_external):
        path = recover(recording)
    if as_json:
        print_json({"recording": str(path)})
    else:
        console.print(f"recovered {path}")
