"""`vibench examples`, `docs`, `schema` and `warm`: shipped files and documentation."""

import os
import shutil
import subprocess
import sys
import tempfile
import webbrowser
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import (
    ConfigurationError,
    MissingLibrary,
    built_site,
    documentation_page,
    shipped_folder,
)
from vibench.sim.operating_system.this import replace_file

from .options import option
from .output import ExitCode, console, print_json
from .paths import AsJson, room_for_folder

FOLDERS = ("campaigns", "hardware_configs", "studies", "schemas", "examples")


def examples(
    copy: Annotated[Path | None, option("Copy all files to DIR; nothing is overwritten.", "DIR")] = None,
    as_json: AsJson = False,
) -> None:
    """List the shipped campaigns, rigs, studies and scripts, or copy them for editing."""
    found = {folder: files_of(shipped_folder(folder)) for folder in FOLDERS}
    if copy is not None:
        copy_all(found, copy)
    if as_json:
        print_json({folder: [str(path) for path in paths] for folder, paths in found.items()})
    elif copy is None:
        for folder, paths in found.items():
            console.print(f"{folder}: {', '.join(names_of(paths))}")
        console.print("Use a file by its name: vibench measure quick --out DIR. Copy all files: --copy DIR")
    else:
        console.print(f"copied {sum(map(len, found.values()))} files to {copy}")


def files_of(folder: Path) -> list[Path]:
    """Return the files of a shipped folder and its subfolders, without the scripts of `vibench figure`."""
    return sorted(
        path
        for path in folder.rglob("*")
        if path.is_file()
        and path.parent.name not in {"__pycache__", "paper"}
        and not path.name.startswith(".")
    )


def names_of(paths: list[Path]) -> list[str]:
    """Return each file's name without suffix; names that occur twice begin with the folder's name."""
    often = Counter(path.stem for path in paths)
    return [path.stem if often[path.stem] == 1 else f"{path.parent.name}/{path.stem}" for path in paths]


def copy_all(found: dict[str, list[Path]], target: Path) -> None:
    """Copy all shipped folders to ``target``; raise ConfigurationError if a file exists there."""
    room_for_folder(target)
    copies = {
        path: target / folder / path.relative_to(shipped_folder(folder))
        for folder, paths in found.items()
        for path in paths
    }
    standing = next((each for each in copies.values() if each.exists()), None)
    if standing is not None:
        raise ConfigurationError(f"{standing} exists already; nothing was copied. Give another folder")
    for path, copy in copies.items():
        copy.parent.mkdir(parents=True, exist_ok=True)
        with replace_file(copy) as coming:
            shutil.copyfile(path, coming)


NOT_A_SOURCE = shutil.ignore_patterns("_build", "reference", "jupyter_execute")


def docs(
    out: Annotated[Path | None, option("Folder for the site; default: the state folder.", "DIR")] = None,
    rebuild: Annotated[bool, option("Build an existing site again.")] = False,
    quick: Annotated[bool, option("Do not run the tutorials (saves about five minutes).")] = False,
    show: Annotated[bool, option("Open the first page in the browser.", name="--open")] = False,
    as_json: AsJson = False,
) -> None:
    """Build the documentation site of this version unless it exists; print the path of its first page."""
    target = built_site() if out is None else out
    if rebuild or not (target / "index.html").is_file():
        build_site(target, "pages" if quick else "tutorials")
    first = documentation_page() if out is None else target / "index.html"
    if as_json:
        print_json({"page": str(first)})
    else:
        console.print(str(first))
    if show:
        webbrowser.open(first.resolve().as_uri())


def build_site(target: Path, extent: str) -> None:
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
        # Build from a copy: pages link to files outside the folder of pages, and an installation's folder may
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


def schema(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="Kind: campaign, rig, study, map, mapping or specimen.")
    ],
) -> None:
    """Print the JSON Schema (draft 4) of one kind of TOML file; editors use schemas to check files."""
    from vibench.acquisition import json_schema

    print_json(json_schema(kind))


def warm() -> None:
    """Print that nothing needs compiling, because the simulation was compiled with vibench."""
    console.print("Nothing needs compiling: the simulation was compiled when vibench was built.")
