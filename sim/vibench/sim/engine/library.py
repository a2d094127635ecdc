"""Find, load and call the native engine with `ctypes`, which releases the global interpreter lock."""

import ctypes
import hashlib
import importlib.util
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .processor import usable_families

Structure = NDArray[np.void]
"""Array of numpy structures; one structure has the shape ()."""
StructureType = np.dtype[np.void]
_STRUCTURE = re.compile(r"(\w+) \{ (.*) \}")
_NAME = re.compile(r"(\*?)\s*(\w+)((?:\[\d+\])*)")
_NUMBERS: dict[str, DTypeLike] = {"double": np.float64, "int64_t": np.int64, "Phasor": np.complex128}


def parse_structures(texts: Iterable[str]) -> dict[str, StructureType]:
    """Return the numpy type of every structure, by name.

    Raises ValueError when a declaration does not have the form below.

    Parameters
    ----------
    texts
        C++ declarations as in native/structures.hpp, such as ``State { double motion[6]; double side; }``. A
        structure may contain structures that are declared before it.
    """
    known: dict[str, StructureType] = {}
    for text in texts:
        whole = _STRUCTURE.fullmatch(text)
        if whole is None:
            raise ValueError(
                f"{text!r} is not a structure of the native engine: write 'Name {{ double field; }}'."
            )
        name, fields = whole.groups()
        declared = [each.strip().removeprefix("const ") for each in fields.split(";") if each.strip()]
        rows = [field for each in declared for field in _fields(each, known)]
        known[name] = np.dtype(rows, align=True)
    return known


def _fields(
    declaration: str, known: dict[str, StructureType]
) -> Iterable[tuple[str, DTypeLike, tuple[int, ...]]]:
    kind, _, names = declaration.partition(" ")
    for name in names.split(","):
        found = _NAME.fullmatch(name.strip())
        if found is None:
            raise ValueError(f"{name!r} is not a field of a structure: write 'name', 'name[6]' or '*name'.")
        pointer, word, sizes = found.groups()
        shape = tuple(int(size) for size in re.findall(r"\d+", sizes))
        yield word, np.uintp if pointer else _NUMBERS.get(kind) or known[kind], shape


FOLDER = Path(__file__).parent / "libraries"
"""Folder of the compiled libraries ``engine-FAMILY-DIGEST.EXT``; DIGEST is a hash of the native sources."""
CHECKOUT = Path(__file__).resolve().parents[4]
BUILD = CHECKOUT / "native" / "build.py"
"""Build script; exists in a checkout, but not in an installed wheel."""
_ENDING = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
"""File name extension of compiled libraries on this operating system."""
REBUILD = "python native/build.py"
FUNCTIONS = (
    *("interpolate", "decimate", "filter_signal", "show"),
    *("move_shaker", "play_loop", "hear_loop", "close_loop"),
    *("filter_motion", "smooth_motion", "follow_contacts", "start_chain", "follow_chain"),
    *("describe_collisions", "follow_batch"),
)
"""Functions of the native library that have a single structure as argument."""
Tables = NDArray[np.float64]
"""Tables of a scene, prepared by the engine in the engine's memory layout."""
_Pointer, _Number, _Count = ctypes.c_void_p, ctypes.c_double, ctypes.c_int64
SIGNATURES: Mapping[str, tuple[type, ...]] = {
    "structure": (ctypes.c_char_p, _Count),
    **dict.fromkeys(("size_of", "size_of_tables", "size_of_cubic_tables"), (_Count, _Count)),
    **dict.fromkeys(("prepare", "prepare_cubics"), (_Count, _Pointer, _Pointer)),
    "start": (_Count, _Pointer, _Pointer, _Number),
    "run": (_Count, _Pointer, _Pointer, _Number, _Number, _Pointer, _Pointer),
    "run_cubics": (_Count, _Pointer, _Pointer, _Pointer, _Number, _Pointer),
    "take_readings": (_Count, _Pointer, _Pointer, _Number, _Pointer, _Pointer, _Pointer, _Count),
    "reach": (_Number, _Pointer, _Pointer),
    "chain_memory": (_Count, _Count, _Count),
    **dict.fromkeys(FUNCTIONS, (_Count, _Pointer)),
}
"""Types of the result and of the arguments of every function of the native library, by name."""


class EngineError(RuntimeError):
    """Error: the native engine cannot be used. The message says what to do."""


class _Lending(np.ndarray[tuple[int, ...], np.dtype[np.void]]):
    """Structure that keeps alive the arrays to which it points."""

    lent: dict[str, object]


class Engine:
    """Loaded library of the native engine."""

    def __init__(self, path: Path) -> None:
        self.path = path
        library = ctypes.CDLL(str(path))
        self._functions = {name: getattr(library, f"vibench_{name}") for name in SIGNATURES}
        for name, function in self._functions.items():
            function.restype, *function.argtypes = SIGNATURES[name]
        self._types = self._read_structures()

    def _read_structures(self) -> dict[str, StructureType]:
        texts: list[str] = []
        while (text := self.invoke("structure", len(texts))) is not None:
            texts.append(text.decode())
        types = parse_structures(texts)
        for index, (name, of) in enumerate(types.items()):
            size = self.invoke("size_of", index)
            if size != of.itemsize:
                raise EngineError(
                    f"{self.path} uses {size} bytes for {name}, but Python uses {of.itemsize}: run {REBUILD}."
                )
        return types

    @property
    def family(self) -> str:
        """Family of processors for which the library was compiled."""
        return self.path.name.split("-")[1]

    def new(self, name: str, **fields: object) -> Structure:
        """Return a structure of native/structures.hpp; fields that are not given are zero.

        Arrays are referenced, not copied. The structure keeps them alive.
        """
        structure = np.zeros((), self._types[name]).view(_Lending)
        structure.lent = {}
        self.fill(structure, **fields)
        return structure

    def rows(self, name: str, count: int) -> Structure:
        """Return ``count`` structures in an array, with all fields zero."""
        return np.zeros(count, self._types[name])

    def fill(self, structure: Structure, **fields: object) -> None:
        """Change fields of a structure that was created by `new`."""
        assert isinstance(structure, _Lending)
        structure.lent |= fields
        for field, value in fields.items():
            structure[field] = _pointer(value) if isinstance(value, np.ndarray) else value

    def invoke(self, function: str, *arguments: NDArray[Any] | float | None) -> Any:
        """Call a function of native/api.cpp, with arrays by address; return its result (-1 if refused)."""
        return self._functions[function](
            *(each.ctypes.data if isinstance(each, np.ndarray) else each for each in arguments)
        )

    def call(self, function: str, structure: Structure) -> int:
        """Call a function of native/api.cpp with one structure, and return its result.

        Raises ValueError when the engine rejects the structure.
        """
        code = int(self.invoke(function, structure))
        if code < 0:
            raise ValueError(
                f"The native engine refuses to {function}: array sizes must agree and numbers must be finite."
            )
        return code

    def prepare(self, scene: Structure) -> Tables:
        """Return the tables of a scene. They point to the collision and step shapes: keep these shapes alive.

        Raises ValueError when the engine rejects a number of the scene.
        """
        return self._prepare("tables", "prepare", scene)

    def prepare_cubics(self, scene: Structure) -> Tables:
        """Return the tables of a scene with piecewise cubic base motion; see `prepare`."""
        return self._prepare("cubic_tables", "prepare_cubics", scene)

    def _prepare(self, sized: str, prepare: str, scene: Structure) -> Tables:
        size = self.invoke(f"size_of_{sized}", int(scene["specimen"]["law"]))
        tables = np.zeros(size // 8, np.float64)
        if self.invoke(prepare, scene, tables) != 0:
            raise ValueError(
                "This scene is not allowed: numbers must be finite, and masses and springs positive."
            )
        return tables


def _pointer(numbers: NDArray[Any]) -> Structure | tuple[int, int]:
    """Return an array of numbers as (address, size) for the engine; return a structure unchanged."""
    if numbers.dtype.names:
        return numbers
    if numbers.dtype != np.float64 or not numbers.flags.c_contiguous:
        raise TypeError(
            f"An array of {numbers.dtype} was given: the native engine takes contiguous float64 arrays."
        )
    return numbers.__array_interface__["data"][0], numbers.size


def library_path() -> Path:
    """Return the path of the fastest library for this processor; in a checkout, build it if it is missing.

    Raises EngineError when there is no library, or the library is out of date and cannot be rebuilt.
    """
    families = usable_families()
    current = sources_digest()
    found = _newest_of(families, current)
    if found is None and current is not None and importlib.util.find_spec("ziglang") is not None:
        command = [sys.executable, str(BUILD), *families[:1]]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - own script
        found = _newest_of(families, current)
    if found is not None:
        return found
    msg = f"The native engine is older than its sources: run pip install ziglang && {REBUILD}."
    if current is None:
        msg = f"{FOLDER} has no native engine for {families or 'this processor'}: install vibench again."
    raise EngineError(msg)


def native_digest() -> str:
    """Return the digest of the native sources, read from the library's name in a wheel; empty if unknown."""
    digest = sources_digest()
    if digest is not None:
        return digest
    found = sorted(FOLDER.glob("engine-*"))
    return found[0].stem.split("-")[2] if found else ""


def sources_digest() -> str | None:
    """Return the digest of the native sources; None if there are no sources, as in an installed wheel."""
    if not BUILD.is_file():
        return None
    spec = importlib.util.spec_from_file_location("vibench_native_build", BUILD)
    assert spec is not None
    assert spec.loader is not None
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    return str(build.sources_digest())


def _newest_of(families: tuple[str, ...], digest: str | None) -> Path | None:
    for family in families:
        found = sorted(FOLDER.glob(f"engine-{family}-{digest or '*'}.{_ENDING}"))
        if found:
            return found[0]
    return None


SIM = Path(__file__).parents[1]


@cache
def physics_digest() -> str:
    """Return a digest of all simulation code; a checkout and an installed wheel have the same digest."""
    digest = hashlib.sha256(native_digest().encode())
    for path in sorted(each for kind in ("*.py", "*.pyi") for each in SIM.rglob(kind)):
        digest.update(path.relative_to(SIM).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
