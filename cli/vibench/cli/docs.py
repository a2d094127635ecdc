"""`vibench docs`: build the documentation site on this computer."""

import os
import shutil
import subprocess
import sys
import tempfile
import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import MissingLibrary, built_site, documentation_page, shipped_folder

from .options import option
from .output import ExitCode, console, print_json
from .paths import AsJson, room_for_folder

NOT_A_SOURCE = shutil.ignore_patterns("_build", "reference", "jupyter_execute")


def docs(
    out: Annotated[Path | None, option("Folder for the site; default: the state folder.", "DIR")] = None,
    rebuild: Annotated[bool, option("Build an existing site again.")] = False,
    quick: Annotated[bool, option("Skip running the tutorials (about five minutes).")] = False,
    show: Annotated[bool, option("Open the first page in the browser.", name="--open")] = False,
    as_json: AsJson = False,
) -> None:
    """Build the documentation site of this version unless it exists; print the path of its first page."""
    target = built_site() if out is None else out
    if rebuild or not (target / "index.html").is_file():
        build(target, "pages" if quick else "tutorials")
    first = documentation_page() if out is None else target / "index.html"
    if as_json:
        print_json({"page": str(first)})
    else:
        console.print(str(first))
    if show:
        webbrowser.open(first.resolve().as_uri())


def build(target: Path, extent: str) -> None:
    """Build the site, with warnings as errors; raise MissingLibrary if Sphinx or an extension is missing."""
    for library in ("sphinx", "myst_nb", "furo"):
        if find_spec(library) is None:
            raise MissingLibrary(
                f"{library}, which builds the site, is not installed: pip install 'vibench[docs]'; the pages "
                f"are also available as text in {shipped_folder('docs')}"
            )
    room_for_folder(target)
    with tempfile.TemporaryDirectory() as scratch:
        root = Path(scratch)
        # Build from a copy: pages link to files outside their folder, and the folder of an installation may
        # be read-only.
        for folder in ("docs", "examples", "campaigns", "studies", "hardware_configs"):
            shutil.copytree(shipped_folder(folder), root / folder, ignore=NOT_A_SOURCE)
        command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
        ended = subprocess.run(  # noqa: S603 - this interpreter, and Sphinx
            [*command, str(root / "docs"), str(root / "site")],
            env={**os.environ, "VIBENCH_DOCS": extent},
            check=False,
        )
        if ended.returncode != 0:
            raise typer.Exit(ExitCode.FAILED)
        shutil.copytree(root / "site", target, ignore=shutil.ignore_patterns(".doctrees"), dirs_exist_ok=True)
