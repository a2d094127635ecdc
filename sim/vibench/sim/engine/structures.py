"""The structures of the C interface, as numpy's types, from the text that the library was compiled from."""

import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import DTypeLike, NDArray

Structure = NDArray[np.void]
"""One structure, shape (); or a row of them."""
StructureType = np.dtype[np.void]
_STRUCTURE = re.compile(r"(\w+) \{ (.*) \}")
_NAME = re.compile(r"(\*?)\s*(\w+)((?:\[\d+\])*)")
_NUMBERS: dict[str, DTypeLike] = {"double": np.float64, "int64_t": np.int64, "Phasor": np.complex128}


def parse_structures(texts: Iterable[str]) -> dict[str, StructureType]:
    """Return numpy's type of every structure.

    Parameters
    ----------
    texts
        C++ as native/structures.hpp declares it, such as ``State { double motion[6]; double side; }``; a
        structure may hold those before it.

    Raises
    ------
    ValueError
        When a text is not of this form.

    """
    known: dict[str, StructureType] = {}
    for text in texts:
        whole = _STRUCTURE.fullmatch(text)
        if whole is None:
            msg = f"{text!r} is not a structure of the native engine: its form is 'Name {{ double field; }}'."
            raise ValueError(msg)
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
            msg = f"{name!r} is not a field of a structure: its form is 'name', 'name[6]' or '*name'."
            raise ValueError(msg)
        pointer, word, sizes = found.groups()
        shape = tuple(int(size) for size in re.findall(r"\d+", sizes))
        yield word, np.uintp if pointer else _NUMBERS.get(kind) or known[kind], shape
