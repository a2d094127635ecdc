"""Paths of the shipped configurations, campaigns, studies and examples."""

import re
from importlib.metadata import version
from pathlib import Path

from vibench.sim import state_folder

from ..errors import ConfigurationError

FOLDERS = (
    Path(__file__).resolve().parents[2] / "shipped",  # installed from a wheel
    Path(__file__).resolve().parents[4],  # a checkout, or an editable install of one
)
SUFFIX = ".toml"


def shipped(name: str) -> Path:
    """Return the path of a shipped file, by ``name``: ``"hardware_configs/virtual_rig.toml"``.

    Raises ConfigurationError when this installation has no such file.
    """
    for folder in FOLDERS:
        path = folder / name
        if path.is_file():
            return path
    raise ConfigurationError(f"{name} is not part of this installation; give the path of your own file")


def shipped_folder(folder: str) -> Path:
    """Return the path of a shipped ``folder``: campaigns, hardware_configs, studies, examples.

    Raises ConfigurationError when this installation has no such folder.
    """
    found = next((place / folder for place in FOLDERS if (place / folder).is_dir()), None)
    if found is None:
        raise ConfigurationError(f"{folder} is not part of this installation; give the path of your own file")
    return found


def all_shipped(folder: str) -> tuple[Path, ...]:
    """Return every shipped TOML file in a ``folder`` such as ``"campaigns"``, sorted by name."""
    return tuple(sorted(shipped_folder(folder).glob(f"*{SUFFIX}")))


def file_path(given: Path | str, folder: str) -> Path:
    """Return the path of a user's file, or of a shipped file given by its bare name such as ``"quick"``.

    Raises ConfigurationError, with the names of the shipped files, when a bare name matches no file.

    Parameters
    ----------
    given
        A path, or a name without folder and suffix; a user's file with exactly this name has priority.
    folder
        Folder of the shipped files, for example ``"campaigns"``.
    """
    path = Path(given).expanduser()
    if path.suffix or path.name != str(path) or path.is_file():
        return path
    known = {each.stem: each for each in all_shipped(folder)}
    if path.name not in known:
        raise ConfigurationError(
            f"{path.name!r} is {'a folder' if path.is_dir() else 'not a file'}, and vibench has no file of "
            f"that name; give one of {', '.join(known)}, or the path of a TOML file"
        )
    return known[path.name]


def built_site() -> Path:
    """Return the folder of the site that ``vibench docs`` builds for this version; it may not exist yet."""
    return state_folder() / "documentation" / version("vibench")


def documentation_page(page: str = "index") -> Path:
    """Return the path of a page of the documentation on this computer, without the network.

    ``page`` is its name in ``docs`` without ``.md``: ``"gui"``, ``"campaigns"``. The page is HTML if the
    site has been built (``vibench docs``), otherwise Markdown.

    Raises ConfigurationError when there is no such page.
    """
    sources = shipped_folder("docs")
    built, written = built_site() / f"{page}.html", sources / f"{page}.md"
    if not re.fullmatch(r"[\w/-]+", page) or not (built.is_file() or written.is_file()):
        names = ", ".join(sorted(path.stem for path in sources.glob("*.md")))
        raise ConfigurationError(f"the documentation has no page {page!r}; give one of {names}")
    return built if built.is_file() else written
