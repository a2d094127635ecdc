"""`vibench recover`: finish a recording that was cut off."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.recording import recover

from .external_data import AllowExternal, external_data
from .output import console


def recover_recording(
    recording: Annotated[Path, typer.Argument(metavar="NAME.h5.part", help="What was left of it.")],
    allow_external: AllowExternal = False,
) -> None:
    """Finish a recording that was cut off: all that was committed becomes NAME.h5."""
    with external_data(allow_external):
        console.print(f"recovered {recover(recording)}")
