"""Ring buffer of the newest samples of a run."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidRequest

Values = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class RingWindow:
    """Consecutive samples up to the newest sample."""

    first_sample: int
    """Index of the first sample, counted from the start of the run."""
    values: Values
    """Samples, shape (channels, samples); a view that later samples overwrite. Lost samples are NaN."""

    @property
    def stop_sample(self) -> int:
        """Index one past the newest sample."""
        return self.first_sample + int(self.values.shape[1])


class Ring:
    """Ring buffer that returns its samples without copying.

    Every sample is written twice, one capacity apart, so that the newest samples are always contiguous.
    """

    def __init__(self, channels: int, capacity: int) -> None:
        if channels < 1 or capacity < 1:
            raise InvalidRequest(
                f"a ring of {channels} channels and {capacity} samples was requested; give 1 or more of each"
            )
        self._capacity = capacity
        self._values: Values = np.full((channels, 2 * capacity), np.nan, dtype=np.float32)
        self._begun: int | None = None
        self.next_sample = 0
        """Index of the next sample to add."""

    @property
    def available(self) -> int:
        """Number of samples available."""
        return 0 if self._begun is None else min(self.next_sample - self._begun, self._capacity)

    def add(self, first_sample: int, values: Values) -> None:
        """Add samples, shape (channels, samples); missing samples become NaN, repeated ones are skipped."""
        if self._begun is None:
            self._begun = self.next_sample = first_sample
        late = self.next_sample - first_sample
        if late > 0:
            values, first_sample = values[:, late:], self.next_sample
        if values.shape[1] == 0:
            return
        lost = min(first_sample - self.next_sample, self._capacity)
        if lost:
            self._put(first_sample - lost, np.full((values.shape[0], lost), np.nan, dtype=np.float32))
        newest = values[:, -self._capacity :]
        self._put(first_sample + values.shape[1] - newest.shape[1], newest)
        self.next_sample = first_sample + values.shape[1]

    def newest(self, samples: int) -> RingWindow:
        """Return the newest ``samples`` samples, or all if there are fewer."""
        count = min(max(samples, 0), self.available)
        end = self.next_sample % self._capacity + self._capacity
        return RingWindow(self.next_sample - count, self._values[:, end - count : end])

    def samples_since(self, sample: int) -> RingWindow:
        """Return the samples from index ``sample`` on that are still available."""
        return self.newest(self.next_sample - sample)

    def _put(self, first_sample: int, values: Values) -> None:
        begin, count = first_sample % self._capacity, values.shape[1]
        for place in (begin, begin + self._capacity):
            end = min(place + count, 2 * self._capacity)
            self._values[:, place:end] = values[:, : end - place]
        overflow = begin + count - self._capacity
        if overflow > 0:
            self._values[:, :overflow] = values[:, count - overflow :]
