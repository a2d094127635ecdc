"""WAV as a source: integers are fractions of full scale, -1 to 1, as every sound program takes them."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import wavfile

from ..signals import Reals
from ._source_channel import SourceChannel

OFFSETS = {"u": 128.0}
"""Eight bits are stored without sign."""


@dataclass(frozen=True, eq=False)
class WavSource:
    """Channels named ``"1"``, ``"2"``, ..."""

    data: NDArray[Any]
    """Shape (samples, channels); on disk until it is read, but for 24 bits."""
    channels: tuple[SourceChannel, ...]

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Read a stretch."""
        column = np.asarray(self.data[start:stop, self.channels.index(channel)], dtype=np.float64)
        return (column - OFFSETS.get(self.data.dtype.kind, 0.0)) / _full_count(self.data.dtype)


@contextmanager
def opened_wav(path: Path) -> Iterator[WavSource]:
    """Open a file; ValueError when it is no WAV, or compressed."""
    rate, data = _read(path)
    table = data.reshape(len(data), -1)
    is_integer = table.dtype.kind in "iu"
    yield WavSource(
        table,
        tuple(
            SourceChannel(
                name=str(number),
                samples=len(table),
                sample_rate_hz=float(rate),
                step=1 / _full_count(table.dtype) if is_integer else None,
                full_scale=1.0 if is_integer else None,
            )
            for number in range(1, table.shape[1] + 1)
        ),
    )


def _read(path: Path) -> tuple[int, NDArray[Any]]:
    with warnings.catch_warnings():
        # Chunks that are not sound: cue points, broadcast data.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        try:
            return wavfile.read(path, mmap=True)
        except ValueError:
            # 24 bits cannot be mapped: read whole, as the upper bytes of 32.
            return wavfile.read(path)


def _full_count(dtype: np.dtype[Any]) -> float:
    return 2.0 ** (8 * dtype.itemsize - 1) if dtype.kind in "iu" else 1.0
