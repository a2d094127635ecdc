"""MATLAB files as a source: 7.3 is HDF5; what ``save`` writes by default is MATLAB 5, read whole."""

import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from ._hdf5_source import Hdf5Source, opened_hdf5
from ._source_channel import SourceChannel
from ._table_source import TableSource

FEWEST_SAMPLES = 2


@contextmanager
def opened_mat(path: Path) -> Iterator[Hdf5Source | TableSource]:
    """Open a file; matrices and fields of structs are called ``"name"``, ``"struct.field"``, ``"name#2"``.

    ValueError when it is damaged.
    """
    if h5py.is_hdf5(path):
        with opened_hdf5(path) as source:
            yield source
        return
    try:
        content = loadmat(path, simplify_cells=True)
    except (MatReadError, zlib.error) as error:  # neither is a kind of ValueError
        raise ValueError(str(error)) from error
    own = {name: value for name, value in content.items() if not name.startswith("__")}
    yield TableSource(dict(_numbers(own, "")))


def _numbers(struct: Mapping[str, Any], prefix: str) -> Iterator[tuple[SourceChannel, Any]]:
    unit = struct.get("units", struct.get("unit", ""))
    for name, value in struct.items():
        match value:
            case dict():
                yield from _numbers(value, f"{prefix}{name}.")
            case np.ndarray() if _holds_samples(value):
                yield from _channels(f"{prefix}{name}", value, unit if isinstance(unit, str) else "")


def _holds_samples(values: np.ndarray[Any, Any]) -> bool:
    return values.dtype.kind in "iuf" and values.ndim in {1, 2} and max(values.shape) >= FEWEST_SAMPLES


def _channels(name: str, values: np.ndarray[Any, Any], unit: str) -> Iterator[tuple[SourceChannel, Any]]:
    """Give the rows or columns of a matrix, whichever are the fewer, as numbers of their own."""
    rows = np.atleast_2d(values) if values.ndim == 1 or values.shape[0] < values.shape[1] else values.T
    label = name.removesuffix(".values").rsplit(".", 1)[-1]
    for number, row in enumerate(rows, start=1):
        own = name if len(rows) == 1 else f"{name}#{number}"
        yield SourceChannel(own, row.size, label, unit=unit), np.asarray(row, dtype=np.float64)
