"""Contents of this installation (shipped files, documentation, libraries of extras), and available memory."""

import re
import sys
from collections.abc import Callable, Mapping
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from vibench.sim import state_folder

from ..errors import ConfigurationError, MissingLibrary

FOLDERS = (
    Path(__file__).resolve().parents[2] / "shipped",  # Installed from a wheel.
    Path(__file__).resolve().parents[4],  # A checkout, or an editable installation of a checkout.
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
    """Return the folder of the site that ``vibench docs`` builds for this version; it may not yet exist."""
    return state_folder() / "documentation" / version("vibench")


def documentation_page(page: str = "index") -> Path:
    """Return the path of a page of the documentation on this computer, without the network.

    ``page`` is the name of the page in ``docs`` without ``.md``: ``"gui"``, ``"campaigns"``. The page is HTML
    if the site has been built (``vibench docs``), otherwise Markdown.

    Raises ConfigurationError when there is no such page.
    """
    sources = shipped_folder("docs")
    built, written = built_site() / f"{page}.html", sources / f"{page}.md"
    if not re.fullmatch(r"[\w/-]+", page) or not (built.is_file() or written.is_file()):
        names = ", ".join(sorted(path.stem for path in sources.glob("*.md")))
        raise ConfigurationError(f"the documentation has no page {page!r}; give one of {names}")
    return built if built.is_file() else written


EXTRAS: Mapping[str, tuple[str, ...]] = {
    "figures": ("matplotlib",),
    "bench": ("pyvisa", "pyvisa_py", "usb", "nidaqmx", "grpc", "google.protobuf"),
    "gui": ("PySide6", "pyqtgraph"),
}
"""Names of the modules that each extra of `pyproject.toml` installs."""


def require_extra(extra: str) -> None:
    """Require that the libraries of an extra are installed, without importing them.

    Raises MissingLibrary when a library is not installed. ``extra`` is the extra's name in `pyproject.toml`.
    """
    for library in EXTRAS[extra]:
        # Check the parent first, because find_spec of a submodule raises an error if the parent is missing.
        if find_spec(library.partition(".")[0]) is None or find_spec(library) is None:
            raise _missing(library, extra)


def require_space(megabytes: int, advice: str = "") -> None:
    """Require enough address space for the libraries and their threads, which otherwise hang or abort.

    ``megabytes`` is the space [MB]. Raises ConfigurationError if the process has a lower limit; ``advice`` is
    the last sentence of that error.
    """
    if sys.platform != "win32" and find_spec("resource") is not None:
        import resource  # noqa: PLC0415 - POSIX only

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most not in (resource.RLIM_INFINITY, -1) and most < 1_000_000 * megabytes:
            raise ConfigurationError(
                f"this process may use {most / 1e6:.0f} MB of address space, but needs {megabytes} MB. "
                "Nothing was done; "
                f"raise the limit (ulimit -v {1000 * megabytes}) and try again. {advice}".rstrip()
            )


def naming_its_extra(found: Callable[[str], object], extra: str) -> Callable[[str], object]:
    """Return a ``__getattr__`` for an API that needs an extra: import errors then name the extra.

    ``found`` is the ``__getattr__`` made by lazy_loader, ``extra`` the name of the extra in `pyproject.toml`.
    The wrapper raises MissingLibrary when a library of the extra is not installed.
    """

    def attribute(name: str) -> object:
        try:
            return found(name)
        except ModuleNotFoundError as error:
            if error.name is None or error.name.partition(".")[0] in {"vibench", name}:
                raise
            raise _missing(error.name, extra) from error

    return attribute


def _missing(library: str, extra: str) -> MissingLibrary:
    return MissingLibrary(
        f"{library} is needed but not installed. Nothing was opened; run pip install 'vibench[{extra}]'"
    )
