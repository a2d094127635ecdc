"""Opening a study's file: what it is, where its places are, and what is in it. It may still be growing."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from pydantic import ValidationError

from ..hdf5_files import UnsafeHdf5, open_hdf5
from . import _layout as layout
from ._arrays import Arrays
from ._columns import COLUMNS
from ._errors import StudyError
from ._layout import PointState
from ._study import Study


@dataclass(frozen=True)
class Places:
    """Byte offsets of everything that is written later."""

    columns: Mapping[str, int]
    session_columns: Mapping[str, int]
    n_sessions: int
    sessions: int
    """How many sessions there have been."""


@dataclass(frozen=True)
class Session:
    """One go at a study."""

    started_utc: str
    software_json: str
    executor: str


def read_study(path: Path) -> Study:
    """Read what was asked for; raises StudyError when the file is no study's."""
    with _opened(path) as file:
        return _study(path, file)


def read_arrays(path: Path) -> Arrays:
    """Read every answer, one row a point; a point that is under way counts as missing."""
    with _opened(path) as file:
        return _arrays(file)


def read_sessions(path: Path) -> tuple[Session, ...]:
    """Read who computed, and when."""
    with _opened(path) as file:
        group = file[layout.SESSIONS]
        rows = range(int(group[layout.N_SESSIONS][0]))
        columns = [group[column.name][:] for column in layout.SESSION_COLUMNS]
    return tuple(Session(*(bytes(column[row]).decode() for column in columns)) for row in rows)


def places_of(path: Path) -> Places:
    """Find the places of everything that is written later."""
    with _opened(path) as file:
        group = file[layout.SESSIONS]
        return Places(
            columns={column.name: _offset(file[column.name]) for column in COLUMNS},
            session_columns={each.name: _offset(group[each.name]) for each in layout.SESSION_COLUMNS},
            n_sessions=_offset(group[layout.N_SESSIONS]),
            sessions=int(group[layout.N_SESSIONS][0]),
        )


def _arrays(file: h5py.File) -> Arrays:
    # States first: an answer that comes while this reads is left for the next time.
    state = file[layout.STATE][...].reshape(-1)
    is_missing = state == PointState.MISSING
    arrays: Arrays = {layout.STATE: state}
    for column in COLUMNS:
        if column.name != layout.STATE:
            whole = file[column.name][...]
            rows = whole.reshape(len(state), *((column.components,) if column.components > 1 else ()))
            rows[is_missing] = column.missing
            arrays[column.name] = rows
    return arrays


def _offset(dataset: h5py.Dataset) -> int:
    return int(dataset.id.get_offset())


@contextmanager
def _opened(path: Path) -> Iterator[h5py.File]:
    if not path.is_file():
        raise StudyError(f"{path} does not exist, or is no file; give the path of a study's file.")
    try:
        # With HDF5's usual lock, which the writer's allows: a process that has the file open elsewhere, in
        # xarray for example, cannot open it with another one.
        file = open_hdf5(path)
    except UnsafeHdf5 as error:
        raise StudyError(f"{path} was not read: {error}") from error
    except OSError as error:
        raise StudyError(
            f"{path} is no readable HDF5 file ({error}); give the path of a study's file."
        ) from error
    with file:
        _require_ours(path, file)
        yield file


def _require_ours(path: Path, file: h5py.File) -> None:
    kind = file.attrs.get("format")
    if not (isinstance(kind, bytes) and kind.decode() == layout.FORMAT):
        raise StudyError(f"{path} is HDF5, but no study's file; give the path of a study's file.")
    version = int(file.attrs["format_version"])
    if version != layout.FORMAT_VERSION:
        raise StudyError(
            f"{path} has format version {version}; this vibench reads version {layout.FORMAT_VERSION}."
            " Use the vibench that wrote it."
        )


def _study(path: Path, file: h5py.File) -> Study:
    text = np.asarray(file[layout.STUDY][()]).item()
    try:
        return Study.model_validate_json(text)
    except ValidationError as error:
        raise StudyError(f"{path} was written by another vibench, whose study differs: {error}") from error
