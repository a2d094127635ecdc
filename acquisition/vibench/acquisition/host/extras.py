"""Check before a command that its packages are installed and memory suffices; errors state a remedy."""

import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec

from ..errors import ConfigurationError, MissingLibrary

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "figures": ("matplotlib",),
    "bench": ("pyvisa", "pyvisa_py", "usb", "nidaqmx", "grpc", "google.protobuf"),
    "gui": ("PySide6", "pyqtgraph"),
}
"""Names of the modules that each extra of `pyproject.toml` installs."""


def require_extra(extra: str) -> None:
    """Require that the libraries of an extra are installed, without importing them.

    Raises MissingLibrary when one is not installed. ``extra`` is the extra's name in `pyproject.toml`.
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
    """Return a ``__getattr__`` for an API that needs an extra: its import errors name the extra.

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
        f"{library} is needed and not installed. Nothing was opened; run pip install 'vibench[{extra}]'"
    )
