"""The newest samples of a run, for viewers that come when they like and may miss some."""

import threading
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..instruments import Block

HELD_S = 10.0
"""How much of the run is held for viewers [s]."""


@dataclass(frozen=True, eq=False)
class SampleSlice:
    """Samples as a viewer gets them."""

    run_id: int
    first_sample: int
    sample_rate_hz: float
    volts: NDArray[np.float32]
    """Shape (channels, samples) [V] at the converter's input."""


class SampleBuffer:
    """A window over the newest samples: written by the run, read by anybody, bounded in memory."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._blocks: deque[tuple[int, NDArray[np.float32]]] = deque()
        self._run_id = 0
        self._channels = 0
        self._rate_hz = 1.0
        self._end = 0
        self._gaps = 0

    @property
    def run_id(self) -> int:
        """Number of the run that the samples belong to."""
        return self._run_id

    @property
    def samples(self) -> int:
        """Samples per channel of the run so far."""
        return self._end

    @property
    def gaps(self) -> int:
        """Places at which samples are missing."""
        return self._gaps

    def begin(self, channels: int, sample_rate_hz: float) -> None:
        """Forget the last run; a new one begins."""
        with self._lock:
            self._blocks.clear()
            self._run_id += 1
            self._channels, self._rate_hz = channels, sample_rate_hz
            self._end = self._gaps = 0

    def add(self, block: Block) -> None:
        """Take the next block, and forget what is older than `HELD_S`."""
        volts = block.volts.astype(np.float32)
        with self._lock:
            if block.first_sample != self._end:
                self._gaps += 1
                self._blocks.clear()
            self._blocks.append((block.first_sample, volts))
            self._end = block.first_sample + volts.shape[1]
            oldest = self._end - round(HELD_S * self._rate_hz)
            while self._blocks and self._blocks[0][0] + self._blocks[0][1].shape[1] <= oldest:
                self._blocks.popleft()

    def since(self, sample: int, most: int) -> SampleSlice:
        """Give what is held from ``sample`` on, the newest ``most`` of it."""
        with self._lock:
            blocks = tuple(self._blocks)
            end, run_id, rate_hz, channels = self._end, self._run_id, self._rate_hz, self._channels
        first = max(sample, end - most, blocks[0][0] if blocks else end)
        parts = [
            volts[:, max(0, first - begin) :] for begin, volts in blocks if begin + volts.shape[1] > first
        ]
        volts = np.concatenate(parts, axis=1) if parts else np.empty((channels, 0), np.float32)
        return SampleSlice(run_id, min(first, end), rate_hz, volts)
