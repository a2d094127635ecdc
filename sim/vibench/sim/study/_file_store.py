"""File of a running study, which stays valid if the process is killed.

Results are written in this order: numbers, flush, states, flush. If the process or the power fails at any
time, every point with the state DONE has all its numbers.

HDF5 creates the file with all metadata and with space for all results, and closes the file. Afterwards only
bytes at known offsets are written, so that no crash can leave the file inconsistent.
"""

import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np

from ..hdf5_files import open_hdf5_to_write
from ..operating_system.this import OpenFile, rename, sync_file, sync_folder
from . import _grid as layout
from ._errors import StudyError
from ._executor import software
from ._results import offsets_of, read_arrays, read_plan, read_sessions
from ._store import MemoryStore

_LONGEST_LOOK_S, _BETWEEN_TRIES_S = 2.0, 0.02
"""Longest wait for a reader to close the file, and time between attempts to lock the file [s]."""


def sole_writer(path: Path) -> OpenFile:
    """Open a file for writing, with a lock while it is open.

    Readers keep the file open only briefly. Raises StudyError when another process keeps the file open for
    longer, as a writer does, or the file cannot be opened.
    """
    try:
        file = OpenFile(path)
    except OSError as error:
        raise StudyError(f"{path} cannot be opened to write: {error.strerror}.") from error
    given_up_s = time.monotonic() + _LONGEST_LOOK_S
    while True:
        try:
            file.lock_sole_writer()
        except OSError as error:
            if time.monotonic() < given_up_s:
                time.sleep(_BETWEEN_TRIES_S)
                continue
            file.close()
            raise StudyError(
                f"{path} is being written by another run, or another program has it open;"
                " wait until the run has ended, or close the program, and try again."
            ) from error
        return file


MAKING_SUFFIX = ".making"
_COMPONENTS = {
    axis.name: axis
    for axis in (
        layout.StudyAxis(layout.COORDINATE, layout.COORDINATES, "", "x, y, z and their velocities"),
        layout.StudyAxis(
            layout.FOUND_MOTION,
            tuple(float(k) for k in range(layout.MOST_FOUND)),
            "1",
            "motions of an ensemble, by their share",
        ),
    )
}
"""Coordinates of the additional axes of columns with several components, by name of the axis."""
HEAD_BYTES = 2_000_000
"""Upper bound on the size of the file without the columns [bytes]."""


def make_file(path: Path, plan: layout.GridPlan) -> None:
    """Create the file of a plan, with all points missing; if that fails, leave no file.

    Raises StudyError when the file exists, the folder does not exist, or the disk is too full.
    """
    try:
        path.open("xb").close()  # of two simultaneous runs, only one can create the file
    except FileExistsError:
        raise StudyError(
            f"{path} exists, and nothing is ever overwritten; resume it, or choose another name."
        ) from None
    except OSError as error:
        raise StudyError(f"{path} cannot be created: {error.strerror}; choose another folder.") from error
    making = path.with_name(path.name + MAKING_SUFFIX)
    try:
        _require_room(path, plan)
        making.unlink(missing_ok=True)
        with open_hdf5_to_write(making, "x", layout.LIBVER) as file:
            _fill(file, plan)
        sync_file(making)
        rename(making, path)
        sync_folder(path.parent)
    except BaseException as error:
        for each in (making, path):
            each.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise StudyError(f"{path} cannot be created: {error}. Nothing was computed.") from error
        raise


def _require_room(path: Path, plan: layout.GridPlan) -> None:
    needed_bytes = HEAD_BYTES + plan.grid.size * sum(
        np.dtype(column.dtype).itemsize * column.components for column in plan.columns
    )
    free_bytes = shutil.disk_usage(path.parent).free
    if free_bytes < needed_bytes:
        raise StudyError(
            f"{path} needs {needed_bytes / 1e6:.0f} MB for {plan.grid.size} points; the disk has "
            f"{free_bytes / 1e6:.0f} MB free. Make room, or choose another folder or a smaller {plan.called}."
        )


def _fill(file: h5py.File, plan: layout.GridPlan) -> None:
    _attach(
        file,
        {
            "Conventions": layout.CONVENTIONS,
            "format": plan.format,
            "format_version": layout.FORMAT_VERSION,
            "title": "predictions of vibro-impact responses",
        },
    )
    text = plan.text.encode()
    file.create_dataset(layout.STUDY, data=np.array(text, dtype=h5py.string_dtype("utf-8", len(text))))
    scales = [_scale(file, axis) for axis in plan.axes]
    last: dict[str, h5py.Dataset] = {}
    for column in plan.columns:
        dataset = _column(file, column, plan.grid.shape)
        if column.components > 1 and column.along not in last:
            numbers = tuple(float(each) for each in range(column.components))
            numbered = layout.StudyAxis(column.along, numbers, "1", column.along)
            last[column.along] = _scale(file, _COMPONENTS.get(column.along, numbered))
        along = [last[column.along]] if column.components > 1 else []
        for index, scale in enumerate([*scales, *along]):
            dataset.dims[index].attach_scale(scale)
    sessions = file.create_group(layout.SESSIONS)
    for name, width in layout.SESSION_COLUMNS.items():
        kind = h5py.string_dtype("utf-8", width)
        sessions.create_dataset(name, data=np.zeros(layout.MOST_SESSIONS, dtype=kind), dtype=kind)
    sessions.create_dataset(layout.N_SESSIONS, data=np.zeros(1, dtype=layout.COUNTER_DTYPE))


def _scale(file: h5py.File, axis: layout.StudyAxis) -> h5py.Dataset:
    match axis.values[0]:
        case str():
            raw = [str(value).encode() for value in axis.values]
            kind = h5py.string_dtype("utf-8", max(len(each) for each in raw))
            dataset = file.create_dataset(axis.name, data=np.array(raw, dtype=kind))
        case _:
            dataset = file.create_dataset(axis.name, data=np.array(axis.values, dtype="<f8"))
            _attach(dataset, {"units": axis.units})
    _attach(dataset, {"long_name": axis.long_name})
    dataset.make_scale(axis.name)
    return dataset


def _column(file: h5py.File, column: layout.Column, shape: tuple[int, ...]) -> h5py.Dataset:
    """Create a contiguous dataset for a column, filled with missing values."""
    whole = shape if column.components == 1 else (*shape, column.components)
    kind = np.dtype(column.dtype)
    stored = h5py.string_dtype("utf-8", kind.itemsize) if kind.kind == "S" else kind
    dataset = file.create_dataset(column.name, data=np.full(whole, column.missing, dtype=stored))
    _attach(dataset, {"long_name": column.long_name})
    match kind.kind:
        case "f":
            _attach(dataset, {"units": column.units})
        case "i":
            dataset.attrs["_FillValue"] = kind.type(column.missing)
    if column.meanings:
        dataset.attrs["flag_values"] = np.arange(len(column.meanings), dtype=kind)
        _attach(dataset, {"flag_meanings": " ".join(column.meanings)})
    return dataset


def _attach(target: h5py.HLObject, values: Mapping[str, str | int | float]) -> None:
    """Set attributes of the file; text is stored as UTF-8 of fixed length, as old readers require."""
    for name, value in values.items():
        match value:
            case str():
                raw = value.encode()
                kind = h5py.string_dtype("utf-8", max(len(raw), 1))
                target.attrs.create(name, np.array(raw, dtype=kind), dtype=kind)
            case _:
                target.attrs[name] = value


class FileStore(MemoryStore):
    """A store that writes to the file of a study; used as a context manager, it closes the file.

    Raises StudyError when the file contains no study or another study, or is being written by another run;
    also after a write error, when earlier results are safe.
    """

    def __init__(
        self, path: Path, plan: layout.GridPlan, opened: Callable[[Path], OpenFile] = sole_writer
    ) -> None:
        self._path = path
        self._plan = plan
        self._disk = opened(path)
        try:
            _require_same(path, read_plan(path, type(plan)), plan)
            self.arrays = read_arrays(path, plan)
            self._offsets = offsets_of(path, plan)
            self._session = min(len(read_sessions(path, type(plan))), layout.MOST_SESSIONS - 1)
            self._own_cells = {layout.SESSION: self._session}
        except BaseException:
            self._disk.close()
            raise

    @classmethod
    def create(cls, path: Path, plan: layout.GridPlan) -> Self:
        """Create the file and return its store; raise StudyError if the file exists."""
        make_file(path, plan)
        return cls(path, plan)

    def begin(self, executor: str) -> None:
        """Record a new session in the file: time, software and executor."""
        texts = (datetime.now(UTC).isoformat(timespec="milliseconds"), software(), executor)
        for (name, width), text in zip(layout.SESSION_COLUMNS.items(), texts, strict=True):
            raw = text.encode()[:width].ljust(width, b"\0")
            self._write(f"{layout.SESSIONS}/{name}", self._session * width, raw)
        self._sync()
        counter = np.asarray(self._session + 1, dtype=layout.COUNTER_DTYPE)
        self._write(f"{layout.SESSIONS}/{layout.N_SESSIONS}", 0, counter.tobytes())
        self._sync()

    def close(self) -> None:
        """Close the file of the study and release its lock."""
        self._disk.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, name: str, offset: int, raw: bytes) -> None:
        if name not in self._offsets:  # files of earlier versions have no digests
            return
        try:
            self._disk.write(self._offsets[name] + offset, raw)
        except OSError as error:
            raise self._write_error(error) from error

    def _sync(self) -> None:
        try:
            self._disk.sync()
        except OSError as error:
            raise self._write_error(error) from error

    def _write_error(self, error: OSError) -> StudyError:
        return StudyError(
            f"{self._path} could not be written: {error.strerror}. Earlier results are safe; make room or "
            "repair the disk, and resume."
        )


def _require_same(path: Path, kept: layout.GridPlan, requested: layout.GridPlan) -> None:
    differing = requested.differences(kept)
    if differing:
        there, here = (each.model_dump(mode="json") for each in (kept, requested))
        told = (text for each in differing for text in _differences(each, there[each], here[each]))
        raise StudyError(
            f"{path} contains another {requested.called}: {', '.join(told)}."
            f" Nothing was changed; request the same {requested.called}, or choose another file."
        )


SHOWN = 60
"""Largest number of characters of a value that a message shows."""


def _differences(name: str, there: Any, here: Any) -> Iterator[str]:
    """Describe how a field differs between two plans: each differing key of a table, first item of a list."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in {**there, **here}:
            if there.get(key) != here.get(key):
                yield from _differences(f"{name}.{key}", there.get(key), here.get(key))
        return
    if isinstance(there, list) and isinstance(here, list):
        both = enumerate(zip(there, here, strict=False))
        index = next((i for i, pair in both if pair[0] != pair[1]), min(len(there), len(here)))
        there, here = (_item(values, index) for values in (there, here))
    yield f"{name} is {_short(there)} in the file and {_short(here)} in the request"


def _item(values: list[object], index: int) -> str:
    if len(values) == 1:
        return str(values[0])
    return f"{values[index]} at position {index + 1}" if index < len(values) else f"{len(values)} values"


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= SHOWN else text[:SHOWN] + "…"
