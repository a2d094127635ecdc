"""Write 32-bit WAV files in which 1 is the full scale of each channel.

Read WAV files; integers become fractions of full scale, -1 to 1.
"""

import struct
import warnings
import wave
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import wavfile

from ..errors import InvalidRequest
from ..signals import Reals
from ._excerpt import Excerpt, TransferObserver, ignore_progress
from ._source_channel import Source, SourceChannel

BYTES = 4
LARGEST_BYTES = 2**32 - 1024
"""Largest WAV file; sizes have 32 bits."""
FULL_COUNT = 2**31


def write_wav(excerpt: Excerpt, path: Path, observer: TransferObserver = ignore_progress) -> None:
    """Write all channels in blocks; lost samples become zero, and values beyond full scale are clipped.

    Counts of converters of up to 32 bits stay exact. Raises InvalidRequest for a fractional sample rate, or
    too many samples for a WAV file.
    """
    rate = excerpt.recording.sample_rate_hz
    if rate != round(rate):
        raise InvalidRequest(
            f"{excerpt.recording.path.name} has {rate!r} samples/s, but the rate of a WAV file is a whole "
            "number; export it as uff, csv or mat"
        )
    size = excerpt.values * BYTES
    if size >= LARGEST_BYTES:
        raise InvalidRequest(
            f"{excerpt.samples} samples of {len(excerpt.channels)} channels need {size / 2**30:.1f} GiB, but "
            "a WAV file has at most 4 GiB; export fewer seconds, or fewer channels"
        )
    full_scales = np.array([[abs(each.physical_per_volt) * each.range_v] for each in excerpt.channels])
    with path.open("xb") as raw, wave.open(raw, "wb") as file:
        file.setnchannels(len(excerpt.channels))
        file.setsampwidth(BYTES)
        file.setframerate(round(excerpt.recording.sample_rate_hz))
        file.setnframes(excerpt.samples)
        for block in excerpt.blocks():
            counts = np.rint(np.nan_to_num(block.values) / full_scales * FULL_COUNT)
            inside = np.clip(counts, -FULL_COUNT, FULL_COUNT - 1)
            file.writeframesraw(inside.T.astype("<i4").tobytes())
            observer(block.values.size)


ORDERS = {b"RIFF": "<", b"RIFX": ">"}
"""Byte order, keyed by the file's first bytes; RF64 (above 4 GiB) stores sizes elsewhere and is not read."""
FIRST_CHUNK = 12
FORMAT_BYTES, EXTENSIBLE_BYTES = 16, 40
"""Sizes of two format chunks: the plain chunk, and one with the number of used bits per sample."""
UNKNOWN_SIZE = 2**32 - 1
"""Size field of a streamed file, written before the size was known."""


@contextmanager
def open_wav(path: Path) -> Iterator[Source]:
    """Open a WAV file with channels ``"1"``, ``"2"``, ..., memory-mapped unless samples have 24 bits.

    Floats from -1 to 1 are fractions of full scale too, as audio programs write them.

    Raises ValueError when the file is not WAV, or is compressed or truncated.
    """
    bits = _valid_bits(path)
    rate, data = _read(path)
    table = data.reshape(len(data), -1) if data.size else np.empty((0, 0))
    is_integer = table.dtype.kind in "iu"
    are_fractions = is_integer or (table.size and table.min() >= -1 and table.max() <= 1)
    unused = 2 ** max(8 * table.itemsize - bits, 0) - 1
    if table.dtype.kind == "i" and np.bitwise_or.reduce(table, axis=None) & unused:
        raise ValueError(f"it states {bits} bits per sample, but its samples have more")
    yield Source(
        {
            SourceChannel(
                name=str(number),
                samples=len(table),
                sample_rate_hz=float(rate),
                step=1 / _full_count(table.dtype) if is_integer else None,
                full_scale=1.0 if are_fractions else None,
            ): partial(_read_column, column)
            for number, column in enumerate(table.T, start=1)
        }
    )


def _read_column(column: NDArray[Any], start: int, stop: int) -> Reals:
    fractions = np.asarray(column[start:stop], dtype=np.float64) / _full_count(column.dtype)
    return fractions - 1.0 if column.dtype.kind == "u" else fractions


def _valid_bits(path: Path) -> int:
    """Return the stated bits per sample; raises ValueError for a truncated file or several data chunks."""
    bits = 8 * BYTES
    with path.open("rb") as file:
        order = ORDERS.get(file.read(4))
        file.seek(FIRST_CHUNK)
        chunks = 0
        while order is not None:
            name, size_bytes = file.read(4), file.read(4)
            if len(size_bytes) < len(name) or not name:
                if chunks:
                    return bits
                raise ValueError("it ends before its samples")
            (size,) = struct.unpack(f"{order}I", size_bytes)
            left = path.stat().st_size - file.tell()
            if not chunks and (left < size != UNKNOWN_SIZE or (name == b"data" and not size)):
                what = "of samples" if name == b"data" else "about its samples"
                raise ValueError(f"it states {size} bytes {what}, but contains {left}")
            chunks += name == b"data"
            if chunks > 1:
                raise ValueError("it has samples in several chunks; only one chunk can be read")
            after = file.tell() + size + size % 2
            if name == b"fmt " and size >= FORMAT_BYTES:
                bits = _format_bits(file.read(EXTENSIBLE_BYTES), order, size)
            file.seek(after)
        return bits


def _format_bits(form: bytes, order: str, size: int) -> int:
    channels, rate, width, bits = struct.unpack(f"{order}2xHI4xHH", form[:FORMAT_BYTES])
    if not (rate and channels) or width % channels or 8 * width < channels * bits:
        raise ValueError(f"it states {rate} Hz, and {width} bytes for {channels} samples of {bits} bits")
    valid = struct.unpack_from(f"{order}H", form, 18)[0] if size >= EXTENSIBLE_BYTES else 0
    return min(valid or bits, 8 * BYTES)


def _read(path: Path) -> tuple[int, NDArray[Any]]:
    with warnings.catch_warnings():
        # Ignore the warnings on other chunks, such as cue points or broadcast data.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        try:
            return wavfile.read(path, mmap=True)
        except ValueError:
            # scipy cannot memory-map samples of 24 bits, but reads them into the upper bytes of 32 bits.
            return wavfile.read(path)


def _full_count(dtype: np.dtype[Any]) -> float:
    return 2.0 ** (8 * dtype.itemsize - 1) if dtype.kind in "iu" else 1.0
