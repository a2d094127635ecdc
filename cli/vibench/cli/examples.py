"""`vibench examples`: list the shipped files, or copy them."""

import shutil
from collections import Counter
from pathlib import Path
from typing import Annotated

from vibench.acquisition import ConfigurationError, shipped_folder
from vibench.sim.operating_system.this import replace_file

from .options import option
from .output import console, print_json
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
