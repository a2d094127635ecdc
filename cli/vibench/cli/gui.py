"""`vibench gui`: open the window in a separate process."""

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import file_path

from .options import option
from .paths import BenchPath

WINDOW = "vibench.gui"
"""Package to run in a new process; if it were imported here, all commands would need Qt."""


def gui(
    bench: BenchPath = None,
    screenshots: Annotated[Path | None, option("Save a picture of each page, and exit.", "DIR")] = None,
) -> None:
    """Open the window, in which you check a bench, plan, run and watch tests, and compare results."""
    command = [sys.executable, "-m", WINDOW]
    if bench is not None:
        command += ["--bench", str(file_path(bench, "hardware_configs"))]
    if screenshots is not None:
        command += ["--screenshots", str(screenshots)]
    ended = subprocess.run(command, check=False)  # noqa: S603 - this interpreter, and our own package
    raise typer.Exit(ended.returncode)
