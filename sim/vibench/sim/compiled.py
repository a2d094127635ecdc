"""One way to compile a kernel: typed for the checker, cached on disk, and never stale."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])


def _fingerprint_of_sources() -> str:
    """Digest of every source of this package."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


SOURCES = _fingerprint_of_sources()
"""What this process runs, whatever is changed on the disk meanwhile."""


def _cache_directory() -> str:
    """Name a directory of its own for every state of the sources.

    numba's cache notices a change in the file of a kernel but not in the files of the kernels that
    it calls: an update of one file would go on running the physics of before. A directory that
    numba cannot write to makes it fall back on its own choice.
    """
    chosen = Path(config.CACHE_DIR or Path(__file__).parent / "__pycache__")  # type: ignore[attr-defined]
    return str(chosen / f"kernels-{SOURCES}")


# numba fills its configuration at run time, out of sight of a checker.
config.CACHE_DIR = _cache_directory()  # type: ignore[attr-defined]


_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
"""How every kernel is compiled. Nobody calls one as a C function, so that wrapper is left out."""
_COUNTING, _LEAN = ({**_OPTIONS, "_nrt": counts} for counts in (True, False))
"""With numba's memory and without. Said outright, or a kernel would take after the first that calls it."""


def compiled(kernel: Kernel) -> Kernel:
    """Compile with numba: cached on disk, without the interpreter lock, IEEE division.

    ``error_model="numpy"`` divides as the processor does (x/0 is inf): kernels guard their own
    denominators and must not raise. ``fastmath`` stays off: it may assume that no NaN exists,
    and the step control must see one.
    """
    return cast("Kernel", njit(**_COUNTING)(kernel))


def lean(kernel: Kernel) -> Kernel:
    """Compile like `compiled` what makes no array and hands none back.

    Such a kernel need not count references to the arrays that it is given. Counting is atomic, twice for
    every array of a named tuple in every call: more than half of the time of a step under a power law.
    """
    return cast("Kernel", njit(**_LEAN)(kernel))


def inlined(kernel: Kernel) -> Kernel:
    """Copy into every caller, before it is compiled: for what costs less than its call.

    numba hands a named tuple of arrays to a call as hundreds of numbers, each copied; a run with impacts took
    twice as long for that alone. What is copied as source has no arguments.
    """
    return cast("Kernel", njit(**_LEAN, inline="always")(kernel))
