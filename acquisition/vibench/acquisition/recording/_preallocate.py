"""Creation of the file before the first sample, with all known data and reserved space.

From then until the recording ends, only bytes at known offsets are written. HDF5 has already closed the
file, so a crash cannot damage its structure.
"""

import os
import shutil
import tempfile
import threading
import uuid
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import h5py
import numpy as np

from vibench.sim.hdf5_files import open_hdf5_to_write
from vibench.sim.operating_system.this import rename, sync_file, sync_folder

from ..errors import RecordingError
from . import _layout as layout
from ._disk import PositionedFile, meet_trouble
from ._header import RecordingHeader
from ._layout import Table, write_attributes, write_text_dataset

MARGIN_S = 10.0
MARGIN_FRACTION = 0.05
"""Margin added to the planned length: 5 % or 10 s, whichever is longer."""
HOLD_ROOM_S = 600.0
"""Additional length for pauses during a run [s]; disk space for pauses is reserved only as samples arrive."""

OPEN_ENDED_S = 24 * 3600.0
"""Declared length of a recording that has no planned end [s]; disk space is reserved as samples arrive."""
RESERVE_AHEAD_S = 60.0
"""Length of each further reservation when a recording outgrows its reserved space [s]."""

ROOM_FACTOR = 2
"""Ratio of required disk space to the size of the samples: at the end, a compressed copy is made."""

ITEM_BYTES = 4


@dataclass(frozen=True)
class TablePlaces:
    """File offsets of a table's columns and row counter."""

    table: Table
    columns: tuple[int, ...]
    n_rows: int


@dataclass(frozen=True)
class Places:
    """File offsets of everything that is written later."""

    channels: tuple[int, ...]
    n_valid: int
    state: int
    reason: int
    tables: Mapping[str, TablePlaces]
    capacity: int
    """Largest number of samples per channel that fits into the file."""
    reserved: int
    """Number of samples per channel for which disk space has been reserved."""


def preallocate(path: Path, part: Path, header: RecordingHeader) -> Places:
    """Create ``part`` for the recording ``path``, reserve its space, and return the offsets in the file.

    The file is written as ``.tmp`` and then renamed, so that a ``.part`` can always be opened. If the process
    is killed before the renaming, a ``.tmp`` without samples remains. Raises RecordingError when the file
    exists already, when its folder does not exist, or when the disk is too full.
    """
    capacity, reserved = _lengths(header)
    _require_room(path, reserved * ITEM_BYTES * len(header.channels))
    made = layout.tmp_of(path)
    try:
        meet_trouble()
        with open_hdf5_to_write(made, "x", layout.LIBVER) as file:
            places = _write_layout(file, header, capacity, reserved)
        _claim(made, places)
        rename(made, part)
        sync_folder(part.parent)
    # HDF5 reports a failing disk as OSError or as RuntimeError.
    except (OSError, RuntimeError, KeyboardInterrupt) as error:
        for each in () if isinstance(error, FileExistsError) else (made, part):
            with suppress(OSError):
                each.unlink()
        if isinstance(error, KeyboardInterrupt):
            raise
        raise RecordingError(
            f"{part} cannot be prepared for {reserved} samples of {len(header.channels)} channels: {error}."
            " Nothing was recorded; make room, or choose another folder or a shorter measurement."
        ) from error
    return places


def _lengths(header: RecordingHeader) -> tuple[int, int]:
    """Return the declared and the initially reserved number of samples per channel."""
    if header.expected_samples is None:
        declared_s, ahead_s = OPEN_ENDED_S, RESERVE_AHEAD_S
        return round(declared_s * header.sample_rate_hz), round(ahead_s * header.sample_rate_hz)
    margin = max(MARGIN_FRACTION * header.expected_samples, MARGIN_S * header.sample_rate_hz)
    reserved = header.expected_samples + round(margin)
    return reserved + round(HOLD_ROOM_S * header.sample_rate_hz), reserved


def _require_room(path: Path, needed_bytes: int) -> None:
    if not path.parent.is_dir():
        raise RecordingError(
            f"The folder {path.parent} does not exist. Nothing was recorded; create this folder first."
        )
    free_bytes = shutil.disk_usage(path.parent).free
    if free_bytes < ROOM_FACTOR * needed_bytes:
        raise RecordingError(
            f"{path} needs {ROOM_FACTOR * needed_bytes / 1e6:.0f} MB (for the recording and its finished "
            f"copy); the disk has {free_bytes / 1e6:.0f} MB free. Nothing was recorded; make"
            " room, or choose another folder or a shorter measurement."
        )


def _write_layout(file: h5py.File, header: RecordingHeader, capacity: int, reserved: int) -> Places:
    write_attributes(
        file,
        {
            "Conventions": layout.CONVENTIONS,
            "format": layout.FORMAT,
            "format_version": layout.FORMAT_VERSION,
            "recording_id": uuid.uuid4().hex,
            **header.attributes(),
        },
    )
    configuration = file.create_group(layout.CONFIGURATION)
    for name, text in header.configuration().items():
        write_text_dataset(configuration, name, text)
    n_valid = _fill(file, layout.N_VALID, layout.COUNTER_DTYPE, b"\0" * 8)
    state = _fill(
        file, layout.STATE, f"S{layout.STATE_WIDTH}", layout.RecordingState.RECORDING.value.encode()
    )
    reason = _fill(file, layout.REASON, f"S{layout.TEXT_WIDTH}", b"")
    tables = {table.name: _table(file, table) for table in layout.TABLES}
    channels = []
    for channel in header.channels:
        dataset = _contiguous(file, channel.role, layout.COUNT_DTYPE, capacity)
        write_attributes(dataset, {**channel.attributes(), "sample_rate": float(header.sample_rate_hz)})
        dataset.attrs["_FillValue"] = np.int32(layout.MISSING_COUNT)
        channels.append(dataset.id.get_offset())
    return Places(tuple(channels), n_valid, state, reason, tables, capacity, reserved)


def _table(file: h5py.File, table: Table) -> TablePlaces:
    group = file.create_group(table.name)
    n_rows = _fill(group, layout.N_ROWS, layout.COUNTER_DTYPE, b"\0" * 8)
    columns = [_contiguous(group, *each, table.capacity) for each in table.columns.items()]
    return TablePlaces(table, tuple(column.id.get_offset() for column in columns), n_rows)


def _fill(group: h5py.Group, name: str, dtype: str, raw: bytes) -> int:
    """Create a dataset of one element with a known value; return its offset."""
    dataset = _contiguous(group, name, dtype, 1)
    dataset[0] = np.frombuffer(raw.ljust(np.dtype(dtype).itemsize, b"\0"), dtype=dtype)[0]
    return int(dataset.id.get_offset())


def _contiguous(group: h5py.Group, name: str, dtype: str, length: int) -> h5py.Dataset:
    """Create a dataset at its final offset, without filling it with zeros."""
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_layout(h5py.h5d.CONTIGUOUS)
    settings.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    settings.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    kind = np.dtype(dtype)
    stored = h5py.string_dtype("utf-8", kind.itemsize) if kind.kind == "S" else kind
    identifier = h5py.h5d.create(
        group.id,
        name.encode(),
        h5py.h5t.py_create(stored, logical=True),
        h5py.h5s.create_simple((length,)),
        settings,
    )
    return h5py.Dataset(identifier)


def _claim(part: Path, places: Places) -> None:
    """Reserve disk space for the file's header and for ``places.reserved`` samples of each channel."""
    with closing(PositionedFile(part)) as disk:
        disk.reserve(0, min(places.channels))
        for offset in places.channels:
            disk.reserve(offset, places.reserved * ITEM_BYTES)
        disk.sync()


Answer = TypeVar("Answer")

ATTEMPTS = 10
"""Largest number of attempts to change a file that other programs change at the same time."""

_one_at_a_time = threading.Lock()


def replace_with_change(path: Path, change: Callable[[h5py.File], Answer]) -> Answer:
    """Apply ``change`` to a copy, then replace the file by the copy; return the result of ``change``.

    A crash leaves the old file unchanged (and perhaps a ``.tmp``). If another program changes the file at the
    same time, ``change`` is repeated. Raises RecordingError when writing fails; the file is then unchanged.
    """
    try:
        with _one_at_a_time:
            for _ in range(ATTEMPTS):
                before = _fingerprint(path)
                descriptor, name = tempfile.mkstemp(layout.TMP_SUFFIX, f"{path.name}.", path.parent)
                os.close(descriptor)
                tmp = Path(name)
                try:
                    shutil.copyfile(path, tmp)
                    shutil.copymode(path, tmp)
                    with open_hdf5_to_write(tmp, "r+", layout.LIBVER) as file:
                        answer = change(file)
                    sync_file(tmp)
                    if _fingerprint(path) == before:
                        rename(tmp, path)
                        with suppress(OSError):  # a power cut leaves the old or the new file
                            sync_folder(path.parent)
                        return answer
                finally:
                    with suppress(OSError):  # no longer exists after the rename
                        tmp.unlink()
    except RecordingError:
        raise
    except (OSError, RuntimeError) as error:
        raise RecordingError(
            f"nothing could be added to {path}: {error}. The file is unchanged; make room, or close the "
            "programs that have the file open, and try again."
        ) from error
    raise RecordingError(
        f"another program changed {path} during {ATTEMPTS} attempts. Nothing was added; try again later."
    )


def _fingerprint(path: Path) -> tuple[int, int, int]:
    """Return inode, modification time [ns] and size, which change when another program changes the file."""
    status = path.stat()
    return (status.st_ino, status.st_mtime_ns, status.st_size)
