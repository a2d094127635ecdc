"""One way to compile a kernel: typed for the checker, cached on disk, and never stale."""

import hashlib
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit

from .inlining import KernelCompiler

Kernel = TypeVar("Kernel", bound=Callable[..., object])
SIM = Path(__file__).parents[1]

IMPORTED_ROOM = re.compile(r"^\s*from \.\.(\w+)", re.MULTILINE)


@cache
def _sources_of(folder: Path) -> dict[str, str]:
    """Read every source below a folder, and the lists of names that say where a face finds them."""
    files = sorted(each for kind in ("*.py", "*.pyi") for each in folder.rglob(kind))
    return {each.relative_to(folder).as_posix(): each.read_text(encoding="utf-8") for each in files}


def _digest_of(sources: dict[str, str]) -> str:
    """Digest of sources: where each lies and what stands in it."""
    digest = hashlib.sha256()
    for name, text in sources.items():
        digest.update(name.encode())
        digest.update(text.encode())
    return digest.hexdigest()[:16]


SOURCES = _digest_of(_sources_of(SIM))
"""What this process runs, whatever is changed on the disk meanwhile."""


def _rooms_behind(room: str) -> set[str]:
    """Name a room of `sim` and those that its kernels may call: what it imports, and what that imports."""
    behind, new = set[str](), {room}
    while new:
        behind |= new
        texts = [text for each in new for text in _sources_of(SIM / each).values()]
        new = {found for text in texts for found in IMPORTED_ROOM.findall(text)} - behind
    return behind


@cache
def _sources_behind(module: str) -> str:
    """Digest of the sources that a kernel of a module may call.

    Those of its room of `sim` and of the rooms behind it; of its own package and all of `sim` elsewhere.
    """
    portion, rooms = module.split(".")[:2], module.split(".")[2:]
    if portion == ["vibench", "sim"] and (SIM / rooms[0]).is_dir():
        called = sorted((SIM / room, room) for room in _rooms_behind(rooms[0]))
        return _digest_of(
            {f"{room}/{name}": text for folder, room in called for name, text in _sources_of(folder).items()}
        )
    found = sys.modules[".".join(portion)]
    # A package has a path, also one without an __init__; a script has only its file.
    places = getattr(found, "__path__", None) or [Path(str(found.__file__)).parent]
    folder = Path(next(iter(places)))
    return SOURCES if folder == SIM else f"{SOURCES}-{_digest_of(_sources_of(folder))}"


@contextmanager
def _cache_of(kernel: Callable[..., object]) -> Iterator[None]:
    """Keep what is compiled in a directory of its own for every state of the sources that it may call.

    numba's cache notices a change in the file of a kernel but not in the files of the kernels that
    it calls: an update of one file would go on running the physics of before. numba reads its setting
    while a kernel is declared, so it is put back: other people's kernels stay where they were. A
    directory that numba cannot write to makes it fall back on its own choice.
    """
    # numba fills its configuration at run time, out of sight of a checker.
    chosen: str = config.CACHE_DIR  # type: ignore[attr-defined]
    place = Path(chosen or Path(__file__).parent / "__pycache__")
    config.CACHE_DIR = str(place / f"kernels-{_sources_behind(kernel.__module__)}")  # type: ignore[attr-defined]
    try:
        yield
    finally:
        config.CACHE_DIR = chosen  # type: ignore[attr-defined]


_OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "pipeline_class": KernelCompiler,
}
"""How every kernel is compiled. Nobody calls one as a C function, so that wrapper is left out."""
_COUNTING, _WITHOUT_REFCOUNT = ({**_OPTIONS, "_nrt": counts} for counts in (True, False))
"""With numba's memory and without. Said outright, or a kernel would take after the first that calls it."""


def _compiled(function: Kernel, options: dict[str, Any]) -> Kernel:
    with _cache_of(function):
        try:
            return cast("Kernel", njit(**options)(function))
        except RuntimeError:  # numba found no folder that it may write to: each process compiles anew
            return cast("Kernel", njit(**{**options, "cache": False})(function))


def kernel(function: Kernel) -> Kernel:
    """Compile with numba: cached on disk, without the interpreter lock, IEEE division.

    ``error_model="numpy"`` divides as the processor does (x/0 is inf): kernels guard their own
    denominators and must not raise. ``fastmath`` stays off: it may assume that no NaN exists,
    and the step control must see one.
    """
    return _compiled(function, _COUNTING)


def kernel_without_refcount(function: Kernel) -> Kernel:
    """Compile like `kernel` what makes no array and hands none back.

    Such a kernel need not count references to the arrays that it is given. Counting is atomic, twice for
    every array of a named tuple in every call: more than half of the time of a step under a power law.
    """
    return _compiled(function, _WITHOUT_REFCOUNT)


def inlined(function: Kernel) -> Kernel:
    """Copy into every caller, before it is compiled: for what costs less than its call.

    numba hands a named tuple of arrays to a call as hundreds of numbers, each copied; a run with impacts took
    twice as long for that alone. What is copied as source has no arguments.
    """
    return _compiled(function, {**_WITHOUT_REFCOUNT, "inline": "always"})
