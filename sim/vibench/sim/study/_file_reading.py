"""Opening a study's file: what it is, where its places are, and what is in it. It may still be growing."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from pydantic import ValidationError

from . import _layout as layout
from ._errors import StudyError
from ._layout import PointState
from ._point_scheduler import GridPlan
from ._store import Arrays

if TYPE_CHECKING:
    import h5py

Plan = TypeVar("Plan", bound=GridPlan)


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


def read_plan(path: Path, kind: type[Plan]) -> Plan:
    """Read what was asked for; raises StudyError when the file is none of a plan of this ``kind``."""
    with _opened(path, kind) as file:
        return _plan(path, file, kind)


def read_arrays(path: Path, plan: GridPlan) -> Arrays:
    """Read every answer, each of shape (points, ...); a point that is under way counts as missing.

    Raises
    ------
    StudyError
        When the file cannot be read, or is of another kind than the plan.

    """
    with _opened(path, type(plan)) as file:
        return _arrays(file, plan)


def read_sessions(path: Path, kind: type[GridPlan]) -> tuple[Session, ...]:
    """Read who computed, and when."""
    with _opened(path, kind) as file:
        group = file[layout.SESSIONS]
        rows = range(int(group[layout.N_SESSIONS][0]))
        columns = [group[column.name][:] for column in layout.SESSION_COLUMNS]
    return tuple(Session(*(bytes(column[row]).decode() for column in columns)) for row in rows)


def places_of(path: Path, plan: GridPlan) -> Places:
    """Find the places of everything that is written later."""
    with _opened(path, type(plan)) as file:
        group = file[layout.SESSIONS]
        return Places(
            columns={column.name: _offset(file[column.name]) for column in plan.columns},
            session_columns={each.name: _offset(group[each.name]) for each in layout.SESSION_COLUMNS},
            n_sessions=_offset(group[layout.N_SESSIONS]),
            sessions=int(group[layout.N_SESSIONS][0]),
        )


def _arrays(file: "h5py.File", plan: GridPlan) -> Arrays:
    # States first: an answer that comes while this reads is left for the next time.
    state = file[layout.STATE][...].reshape(-1)
    is_missing = state == PointState.MISSING
    arrays: Arrays = {layout.STATE: state}
    for column in plan.columns:
        if column.name != layout.STATE:
            whole = file[column.name][...]
            rows = whole.reshape(len(state), *((column.components,) if column.components > 1 else ()))
            rows[is_missing] = column.missing
            arrays[column.name] = rows
    return arrays


def _offset(dataset: "h5py.Dataset") -> int:
    return int(dataset.id.get_offset())


@contextmanager
def _opened(path: Path, kind: type[GridPlan]) -> Iterator["h5py.File"]:
    from ..hdf5_files.door import UnsafeHdf5, open_hdf5  # noqa: PLC0415 - h5py, which answers in memory do without

    if not path.is_file():
        raise StudyError(f"{path} does not exist, or is no file; give the path of a {kind.called}'s file.")
    try:
        # With HDF5's usual lock, which the writer's allows: a process that has the file open elsewhere, in
        # xarray for example, cannot open it with another one.
        file = open_hdf5(path)
    except UnsafeHdf5 as error:
        raise StudyError(f"{path} was not read: {error}") from error
    except OSError as error:
        raise StudyError(
            f"{path} is no readable HDF5 file ({error}); give the path of a {kind.called}'s file."
        ) from error
    with file:
        _require_ours(path, file, kind)
        yield file


def _require_ours(path: Path, file: "h5py.File", kind: type[GridPlan]) -> None:
    found = file.attrs.get("format")
    if not (isinstance(found, bytes) and found.decode() == kind.format):
        raise StudyError(
            f"{path} is HDF5, but no {kind.called}'s file; give the path of a {kind.called}'s file."
        )
    version = int(file.attrs["format_version"])
    if version != layout.FORMAT_VERSION:
        raise StudyError(
            f"{path} has format version {version}; this vibench reads version {layout.FORMAT_VERSION}."
            " Use the vibench that wrote it."
        )


def _plan(path: Path, file: "h5py.File", kind: type[Plan]) -> Plan:
    text = np.asarray(file[layout.STUDY][()]).item()
    try:
        return kind.model_validate_json(text)
    except ValidationError as error:
        raise StudyError(
            f"{path} was written by another vibench, whose {kind.called} differs: {error}"
        ) from error
