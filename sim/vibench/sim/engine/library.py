"""Find, load and call the native engine with `ctypes`, which releases the global interpreter lock."""

import ctypes
import hashlib
import importlib.util
import re
import subprocess
import sys
from collections.abc import Iterable
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
_Pointer = ctypes.c_void_p


class EngineError(RuntimeError):
    """Error: the native engine cannot be used. The message says what to do."""


class _Lending(np.ndarray[tuple[int, ...], np.dtype[np.void]]):
    """Structure that keeps alive the arrays to which it points."""

    lent: dict[str, object]


class Engine:
    """Loaded library of the native engine."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._library = ctypes.CDLL(str(path))
        self._declare("vibench_structure", ctypes.c_char_p, ctypes.c_int64)
        self._declare("vibench_size_of", ctypes.c_int64, ctypes.c_int64)
        self._declare("vibench_size_of_tables", ctypes.c_int64, ctypes.c_int64)
        self._declare("vibench_prepare", ctypes.c_int64, _Pointer, _Pointer)
        self._declare("vibench_start", ctypes.c_int64, _Pointer, _Pointer, ctypes.c_double)
        number, count = ctypes.c_double, ctypes.c_int64
        self._declare("vibench_size_of_cubic_tables", count, count)
        self._declare("vibench_prepare_cubics", count, _Pointer, _Pointer)
        self._declare("vibench_run_cubics", count, _Pointer, _Pointer, _Pointer, number, _Pointer)
        filled = (_Pointer, _Pointer, _Pointer)
        self._declare("vibench_run", count, _Pointer, _Pointer, number, number, *filled[:2])
        self._declare("vibench_take_readings", count, _Pointer, _Pointer, number, *filled, count)
        self._declare("vibench_reach", number, _Pointer, _Pointer)
        self._declare("vibench_chain_memory", count, count, count)
        for name in FUNCTIONS:
            self._declare(f"vibench_{name}", count, _Pointer)
        self._functions = {name: getattr(self._library, f"vibench_{name}") for name in FUNCTIONS}
        self._types = self._read_structures()

    def _declare(self, name: str, result: type, *arguments: type) -> None:
        function = getattr(self._library, name)
        function.restype, function.argtypes = result, arguments

    def _read_structures(self) -> dict[str, StructureType]:
        texts: list[str] = []
        while (text := self._library.vibench_structure(len(texts))) is not None:
            texts.append(text.decode())
        types = parse_structures(texts)
        for index, (name, of) in enumerate(types.items()):
            size = self._library.vibench_size_of(index)
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

    def call(self, function: str, structure: Structure) -> int:
        """Call a function of native/api.cpp with one structure, and return its result.

        Raises ValueError when the engine rejects the structure.
        """
        code = int(self._functions[function](structure.ctypes.data))
        if code < 0:
            raise ValueError(
                f"The native engine refuses to {function}: array sizes must agree and numbers must be finite."
            )
        return code

    def chain_memory(self, cells: int, kinds: int) -> int:
        """Return the size of a chain's work memory, in floats, for ``kinds`` different kinds of cells."""
        return int(self._library.vibench_chain_memory(cells, kinds))

    def prepare(self, scene: Structure) -> Tables:
        """Return the tables of a scene. They point to the collision and step shapes: keep these shapes alive.

        Raises ValueError when the engine rejects a number of the scene.
        """
        return self._prepare("tables", "prepare", scene)

    def prepare_cubics(self, scene: Structure) -> Tables:
        """Return the tables of a scene with piecewise cubic base motion; see `prepare`."""
        return self._prepare("cubic_tables", "prepare_cubics", scene)

    def _prepare(self, sized: str, prepare: str, scene: Structure) -> Tables:
        size = getattr(self._library, f"vibench_size_of_{sized}")(int(scene["specimen"]["law"]))
        tables = np.zeros(size // 8, np.float64)
        if getattr(self._library, f"vibench_{prepare}")(scene.ctypes.data, tables.ctypes.data) != 0:
            raise ValueError(
                "This scene is not allowed: numbers must be finite, and masses and springs positive."
            )
        return tables

    def start(self, tables: Tables, state: Structure, tolerance: float) -> int:
        """Store in ``state`` whether m1 is in contact; return 0, or -1 if the input is refused."""
        return int(self._library.vibench_start(tables.ctypes.data, state.ctypes.data, tolerance))

    def run(
        self,
        tables: Tables,
        state: Structure,
        until_s: float,
        tolerance: float,
        record: Structure,
        tangent: Structure | None = None,
    ) -> int:
        """Advance ``state`` and its ``tangent`` vectors to a time [s], and fill ``record``.

        Return the number of an `Outcome`, or -1 if the input is refused.
        """
        run = (tables.ctypes.data, state.ctypes.data, until_s, tolerance, record.ctypes.data)
        return int(self._library.vibench_run(*run, None if tangent is None else tangent.ctypes.data))

    def run_cubics(
        self, tables: Tables, state: Structure, drive: Structure, tolerance: float, record: Structure
    ) -> int:
        """Advance ``state`` over the intervals of ``drive`` and fill ``record``; return the same as `run`."""
        run = (tables.ctypes.data, state.ctypes.data, drive.ctypes.data, tolerance, record.ctypes.data)
        return int(self._library.vibench_run_cubics(*run))

    def take_readings(
        self,
        tables: Tables,
        state: Structure,
        tolerance: float,
        record: Structure,
        tangent: Structure,
        readings: Structure,
        last: int,
    ) -> int:
        """Advance to the end of interval ``last`` and fill ``readings``; return an outcome as `run` does."""
        filled = (each.ctypes.data for each in (record, tangent, readings))
        return int(
            self._library.vibench_take_readings(
                tables.ctypes.data, state.ctypes.data, tolerance, *filled, last
            )
        )

    def reach(self, tables: Tables, state: Structure) -> float:
        """Return a bound on abs(p) for all later times if no contact follows [m]; infinite in contact."""
        return float(self._library.vibench_reach(tables.ctypes.data, state.ctypes.data))


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
