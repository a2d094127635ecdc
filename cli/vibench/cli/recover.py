"""`vibench recover`: finish an interrupted recording. It loads nothing that reads whole recordings."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.recording import recover

from .output import console, print_json
from .paths import AllowExternal, AsJson


def recover_recording(
    recording: Annotated[Path, typer.Argument(metavar="NAME.h5.part", help="Interrupted recording.")],
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Finish an interrupted recording: all committed samples become NAME.h5."""
    path = recover(recording)
    if as_json:
        print_json({"recording": str(path)})
    else:
        console.print(f"recovered {path}")
