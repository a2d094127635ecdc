"""Ring buffer of the newest samples of a run, and level meters with peak hold."""

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidRequest
from ..signals import Reals

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


OVER_SHARE = 0.95
"""Fraction of full scale from which a channel is close to clipping."""
QUIET_SHARE = 0.01
"""Fraction of full scale below which the input range is too large or the sensor is missing."""
QUIET_AFTER_S = 3.0
HOLD_S = 1.5


class LevelVerdict(Enum):
    """Assessment of a channel's level: too high, good, or too low."""

    OVER = auto()
    GOOD = auto()
    QUIET = auto()


@dataclass(frozen=True)
class Level:
    """Level of one channel, relative to full scale; a value above 1 is an overload."""

    peak_share: float
    rms_share: float
    held_share: float
    """Largest peak of the last 1.5 s, relative to full scale."""
    verdict: LevelVerdict


class LevelMeters:
    """Level meters for several channels.

    Parameters
    ----------
    full_scale
        Full scale of each channel in the unit of the samples, shape (channels,).
    sample_rate_hz
        Sample rate [Hz], for the duration of the peak hold.
    """

    def __init__(self, full_scale: Reals, sample_rate_hz: float) -> None:
        self._full_scale = np.asarray(full_scale, dtype=np.float64)
        self._rate_hz = sample_rate_hz
        self._held = np.zeros(self._full_scale.size)
        self._held_for_s = np.zeros(self._full_scale.size)
        self._quiet_for_s = np.zeros(self._full_scale.size)
        self._levels: tuple[Level, ...] = ()

    def add(self, values: Values) -> tuple[Level, ...]:
        """Add the next samples, shape (channels, samples), and return the new levels."""
        known = values[:, np.isfinite(values).all(axis=0)]
        if known.shape[1] == 0:
            return self._levels
        peak = np.max(np.abs(known), axis=1) / self._full_scale
        rms = np.sqrt(np.mean(known.astype(np.float64) ** 2, axis=1)) / self._full_scale
        lasted_s = values.shape[1] / self._rate_hz
        self._held_for_s += lasted_s
        is_new = (peak >= self._held) | (self._held_for_s > HOLD_S)
        self._held = np.where(is_new, peak, self._held)
        self._held_for_s = np.where(is_new, 0.0, self._held_for_s)
        self._quiet_for_s = np.where(peak < QUIET_SHARE, self._quiet_for_s + lasted_s, 0.0)
        self._levels = tuple(
            Level(float(p), float(r), float(h), _verdict(float(h), float(q)))
            for p, r, h, q in zip(peak, rms, self._held, self._quiet_for_s, strict=True)
        )
        return self._levels


def _verdict(held_share: float, quiet_for_s: float) -> LevelVerdict:
    if held_share >= OVER_SHARE:
        return LevelVerdict.OVER
    return LevelVerdict.QUIET if quiet_for_s >= QUIET_AFTER_S else LevelVerdict.GOOD
