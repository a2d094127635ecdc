"""Finish a recording: compress, seal, check and rename it to ``NAME.h5``, then delete ``NAME.h5.part``.

HDF5's filters run on one core, under a global lock. Here, threads shuffle (first bytes of all samples, then
second bytes, ...) and deflate with zlib, which releases Python's lock. The resulting bytes are the same.
"""

import hashlib
import os
import time
import zlib
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np

from vibench.sim.hdf5_files import open_hdf5_to_write
from vibench.sim.operating_system.this import rename, sync_file, sync_folder

from ..errors import RecordingError
from ..host import LOG
from ..instruments import Counts
from . import _layout as layout, _tables as tables
from ._disk import meet_trouble, sole_use
from ._layout import (
    COUNT_DTYPE,
    DEFLATE_LEVEL,
    RecordingState,
    Table,
    cell,
    packing,
    read_attributes,
    write_attributes,
    write_text_dataset,
)
from ._overview import BIN_SAMPLES, CountOverview, OverviewSums, write_overview
from ._reader import open_recording
from ._seal import SealDepth, SealKey, SealState, check_seal, seal_key, write_seal
from ._tables import Columns

# Labelled curves in NeXus format, one per channel, for other programs. These programs do not scale counts, so
# each curve contains the extremes of every bin in physical units. As a line, these extremes show the envelope
# of the signal.

SIGNAL = "values"
FIRST_CHOICE = "m0_"
"""Prefix of the channels plotted by default; without such a channel, the first channel is plotted."""


def write_view(file: h5py.File, role: str, overview: CountOverview, title: str) -> None:
    """Add a labelled curve of a channel; an attribute ``default`` names the curve that is shown first."""
    if overview.low.size == 0:
        return
    view = file.require_group(layout.VIEW)
    if "default" not in view.attrs or role.startswith(FIRST_CHOICE):
        write_attributes(file, {"NX_class": "NXroot", "default": layout.VIEW})
        write_attributes(view, {"NX_class": "NXentry", "default": role})
    channel = read_attributes(file[role])
    name = str(channel["long_name"]) or role
    data = view.create_group(role)
    write_attributes(data, {"NX_class": "NXdata", "signal": SIGNAL, "axes": layout.TIME, "time_indices": 0})
    # The lowest and highest values of the bins alternate; both are NaN if all samples of a bin are lost.
    counts = np.column_stack((overview.low, overview.high)).ravel()
    values = counts * float(channel["scale_factor"]) + float(channel["add_offset"])
    physical = np.where(counts == layout.MISSING_COUNT, np.nan, values).astype(np.float32)
    # The title also contains the unit, because silx does not label the vertical axis.
    write_text_dataset(data, "title", f"{title}: {role.replace('_', ' ')} [{channel['units']}]")
    write_attributes(
        data.create_dataset(SIGNAL, data=physical, compression="gzip", shuffle=True),
        {
            "units": channel["units"],
            "long_name": f"{name} [{channel['units']}]",
            "comment": f"smallest and largest value of every {BIN_SAMPLES} samples, alternating",
        },
    )
    # Write the times once, and link each channel's group to this dataset.
    times = next((each[layout.TIME] for each in view.values() if layout.TIME in each), None)
    if times is None:
        time_s = np.arange(counts.size) * (0.5 * BIN_SAMPLES / float(file.attrs["sample_rate_hz"]))
        times = view.create_dataset(None, data=time_s, compression="gzip", shuffle=True)
        write_attributes(times, {"units": "s", "long_name": "time since the first sample [s]"})
    data[layout.TIME] = times


IN_FLIGHT_PER_WORKER = 4
"""Number of queued chunks per worker thread, enough to keep threads and disk busy."""


def create_counts(file: h5py.File, name: str, samples: int, chunk_samples: int) -> h5py.Dataset:
    """Create a compressed one-dimensional dataset of counts; an empty dataset is contiguous instead."""
    return file.create_dataset(name, shape=(samples,), dtype=COUNT_DTYPE, **packing(samples, chunk_samples))


def write_chunks(dataset: h5py.Dataset, pieces: Iterable[Counts]) -> None:
    """Fill a dataset made by :func:`create_counts` with pieces of one chunk each (the last may be short)."""
    if dataset.chunks is None:
        return
    length = dataset.chunks[0]
    for index, raw in enumerate(_compress(pieces, length)):
        dataset.id.write_direct_chunk((index * length,), raw)


def _compress(pieces: Iterable[Counts], length: int) -> Iterator[bytes]:
    workers = os.cpu_count() or 1
    waiting: deque[Future[bytes]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        for piece in pieces:
            waiting.append(_submit(pool, piece, length))
            if len(waiting) > workers * IN_FLIGHT_PER_WORKER:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _submit(pool: ThreadPoolExecutor, piece: Counts, length: int) -> Future[bytes]:
    """Compress a piece in the pool, or in this thread if no further thread can be started."""
    try:
        return pool.submit(_chunk, piece, length)
    except RuntimeError:
        compressed: Future[bytes] = Future()
        compressed.set_result(_chunk(piece, length))
        return compressed


def _chunk(counts: Counts, length: int) -> bytes:
    """Return a chunk as HDF5's shuffle and deflate filters would make it, padded with zeros to ``length``."""
    full = np.zeros(length, dtype=COUNT_DTYPE)
    full[: len(counts)] = counts
    shuffled = np.ascontiguousarray(full.view(np.uint8).reshape(length, -1).T)
    return zlib.compress(shuffled.data, DEFLATE_LEVEL)


INTERRUPTED_KIND = "interrupted"
INTERRUPTED_REASON = "the recording program ended before it could record how the run ended"
INT32_SAMPLES = 2**31
"""Number of samples above which sample numbers are stored with 64 bits (11 h at 51.2 kS/s)."""


def finalise(part: Path, key: SealKey | None, written: Mapping[str, str] | None = None) -> Path:
    """Create and seal ``NAME.h5`` from ``NAME.h5.part``, which :func:`discard` deletes later.

    The caller must have locked the ``.part``, which is not changed. ``written`` has the checksum of each
    channel's recorded samples (None in a recovery). Raises RecordingError when ``NAME.h5`` exists, when
    writing fails (the disk may be full), or when the copy reads back differently from what was written.
    """
    final = part.with_suffix("")
    tmp = layout.tmp_of(final)
    if final.exists() or final.is_symlink():
        raise RecordingError(f"{final} exists, and nothing is ever overwritten; move that file away.")
    try:
        meet_trouble()
        _copy(part, tmp, key, written)
        sync_file(tmp)
        rename(tmp, final)
    # HDF5 reports a full disk as OSError or as RuntimeError.
    except (OSError, RuntimeError, KeyboardInterrupt) as error:
        # Delete the incomplete copy: the .part contains all data.
        with suppress(OSError):
            tmp.unlink()
        if isinstance(error, (RecordingError, KeyboardInterrupt)):
            raise
        raise RecordingError(f"{final} could not be written: {error}. {location(part, error)}") from error
    return final


def location(part: Path, error: Exception) -> str:
    """Return a sentence that states where the committed samples are after a disk error, and what to do."""
    try:
        is_there = part.exists()
    except OSError:  # the folder no longer responds
        is_there = False
    # After FileNotFoundError, the recording was removed, and a file of this name is a different file.
    if is_there and not isinstance(error, FileNotFoundError):
        return f"All committed samples are safe in {part}; make room, then recover that file."
    return (
        f"{part} was not found: the file or its folder was removed, moved or disconnected during the"
        " recording; put the file back and recover it, or measure again."
    )


def discard(part: Path) -> None:
    """Delete ``NAME.h5.part`` when ``NAME.h5`` would survive a power cut; a remaining .part is harmless."""
    try:
        sync_folder(part.parent)
        part.unlink()
        sync_folder(part.parent)
    except OSError as error:
        if part.exists():
            name = part.with_suffix("").name
            LOG.warning("%s is complete; %s could not be deleted (%s)", name, part.name, error)


def _copy(part: Path, tmp: Path, key: SealKey | None, written: Mapping[str, str] | None) -> None:
    with h5py.File(part, "r", locking=False) as source, open_hdf5_to_write(tmp, "x", layout.LIBVER) as copy:
        samples = int(source[layout.N_VALID][0])
        state, reason = tables.ending(source)
        if state is RecordingState.RECORDING:
            state, reason = RecordingState.INTERRUPTED, INTERRUPTED_REASON
        ending = {"state": state.value, "reason": reason, "samples": samples}
        write_attributes(copy, {**read_attributes(source), **ending})
        source.copy(layout.CONFIGURATION, copy)
        digests: dict[str, str] = {}
        time_axis = _write_time(copy, samples, float(source.attrs["sample_rate_hz"]), digests)
        for role in str(read_attributes(source)["roles"]).split():
            digests[f"/{role}"], overview = _copy_channel(source[role], copy, role, samples, time_axis)
            write_view(copy, role, overview, part.with_suffix("").stem)
            if written is not None and written[role] != digests[f"/{role}"]:
                raise RecordingError(
                    f"{part}: the samples of {role!r} differ from those recorded; check disk and memory. The "
                    "file is kept unchanged; recover this file to get a recording of the readable samples."
                )
        for table in layout.TABLES:
            _write_table(copy, table, _rows(source, table, samples))
        copy.create_group(layout.RESULTS)
        write_seal(copy, digests, key)
    with h5py.File(tmp, "r", locking=False) as copy:
        found = check_seal(copy, SealDepth.WHOLE, key)
    if found.state is not SealState.INTACT:
        raise RecordingError(
            f"{tmp} differs from the data written to it ({found.sentence}); check disk and memory. All"
            f" committed samples are safe in {part}; recover that file."
        )


def _write_time(
    copy: h5py.File, samples: int, sample_rate_hz: float, digests: dict[str, str]
) -> h5py.Dataset:
    """Write the time axis as sample numbers, which compress well, with the sample interval as scale."""
    dtype = np.dtype(layout.COUNT_DTYPE if samples < INT32_SAMPLES else layout.COUNTER_DTYPE)
    dataset = copy.create_dataset(layout.TIME, shape=(samples,), dtype=dtype, **packing(samples))
    digest = hashlib.sha256()
    for begin in range(0, samples, layout.CHUNK_SAMPLES):
        end = min(begin + layout.CHUNK_SAMPLES, samples)
        numbers = np.arange(begin, end, dtype=dtype)
        dataset[begin:end] = numbers
        digest.update(numbers.data)
    digests[f"/{layout.TIME}"] = digest.hexdigest()
    write_attributes(
        dataset,
        {
            "units": "s",
            "scale_factor": 1.0 / sample_rate_hz,
            "add_offset": 0.0,
            "long_name": "time since the first sample",
            "axis": "T",
        },
    )
    dataset.make_scale(layout.TIME)
    return dataset


def _copy_channel(
    source: h5py.Dataset, copy: h5py.File, role: str, samples: int, time_axis: h5py.Dataset
) -> tuple[str, CountOverview]:
    dataset = create_counts(copy, role, samples, layout.CHUNK_SAMPLES)
    digest, sums = hashlib.sha256(), OverviewSums()
    write_chunks(dataset, sums.add_pieces(_hashed_pieces(source, samples, digest)))
    write_attributes(dataset, {**read_attributes(source), "sha256": digest.hexdigest()})
    dataset.attrs["_FillValue"] = np.int32(layout.MISSING_COUNT)
    dataset.dims[0].attach_scale(time_axis)
    overview = sums.overview()
    write_overview(copy, role, overview, float(copy.attrs["sample_rate_hz"]))
    return digest.hexdigest(), overview


def _hashed_pieces(dataset: h5py.Dataset, samples: int, digest: "hashlib._Hash") -> Iterator[Counts]:
    for begin in range(0, samples, layout.CHUNK_SAMPLES):
        piece = dataset[begin : min(begin + layout.CHUNK_SAMPLES, samples)]
        digest.update(piece.data)
        yield piece


def _rows(source: h5py.File, table: Table, samples: int) -> Columns:
    columns = tables.clip(tables.read_columns(source, table), table, samples)
    if table is layout.EVENTS and tables.ending(source)[0] is RecordingState.RECORDING:
        last: tuple[str | float, ...] = (samples, time.time(), INTERRUPTED_KIND, INTERRUPTED_REASON)
        return {
            name: np.append(columns[name], cell(column, value))
            for (name, column), value in zip(table.columns.items(), last, strict=True)
        }
    return columns


def _write_table(copy: h5py.File, table: Table, columns: Columns) -> None:
    group = copy.create_group(table.name)
    rows = len(next(iter(columns.values())))
    scale = group.create_dataset(layout.ROW, data=np.arange(rows, dtype=layout.COUNT_DTYPE))
    scale.make_scale(layout.ROW)
    for column in table.columns:
        dataset = group.create_dataset(column, shape=(rows,), dtype=_narrowest(columns[column]))
        if rows:
            dataset[:] = columns[column]
        dataset.dims[0].attach_scale(scale)


def _narrowest(values: np.ndarray[tuple[int], np.dtype[np.generic]]) -> np.dtype[np.generic]:
    """Return the type of a stored column; a text column is as wide as its longest value."""
    if values.dtype.kind != "S":
        return values.dtype
    longest = max((len(value) for value in values.tolist()), default=0)
    dtype: np.dtype[np.generic] = h5py.string_dtype("utf-8", max(longest, 1))
    return dtype


def recover(path: Path | str) -> Path:
    """Finish an interrupted recording; return the path of ``NAME.h5``.

    ``path`` is ``NAME.h5.part`` or ``NAME.h5``. After a crash there may be
    only the ``.part``, or also an incomplete or complete compressed copy. All three cases are recovered.

    Raises RecordingError when there is nothing to recover, when the file is still being recorded, or when it
    is not a recording of vibench.
    """
    path = Path(path)
    final = path.with_suffix("") if path.suffix == layout.PART_SUFFIX else path
    part = layout.part_of(final)
    if not part.exists():
        hint = f"analyse {final.name}, which exists" if final.is_file() else "give the path of a .h5.part"
        raise RecordingError(f"{part} does not exist, so there is nothing to recover; {hint}.")
    key = seal_key()
    try:
        _finish(part, final, key)
        discard(part)
    except RecordingError:
        raise
    except OSError as error:
        raise RecordingError(
            f"{part} cannot be recovered: {error}. Nothing is lost; check that folder and file are writable,"
            " and try again."
        ) from error
    return final


def _finish(part: Path, final: Path, key: SealKey | None) -> None:
    with sole_use(part):
        with open_recording(part) as source:
            if not source.is_growing:
                raise RecordingError(f"{part} is a finished recording; rename it to {final.name}")
            is_done = final.exists() and _holds(final, source.recording_id, part)
        if not is_done:
            # A crash during the copy may have left a .tmp. Delete it: the .part contains all data.
            layout.tmp_of(final).unlink(missing_ok=True)
            finalise(part, key)


def _holds(final: Path, recording_id: str, part: Path) -> bool:
    """Return True if the finished file is an undamaged copy of this recording; else raise RecordingError."""
    with open_recording(final) as copy:
        same, seal = copy.recording_id == recording_id, copy.check_seal(SealDepth.WHOLE)
    if not same:
        raise RecordingError(
            f"{final} and {part} are different recordings, and nothing is ever overwritten."
            " Nothing was changed; rename one of the two files and try again."
        )
    if seal.state in (SealState.DAMAGED, SealState.SEAL_GONE):
        raise RecordingError(
            f"{final} is damaged ({seal.sentence}), but {part} still contains its samples."
            f" Nothing was changed; rename {final.name} and try again."
        )
    return same
