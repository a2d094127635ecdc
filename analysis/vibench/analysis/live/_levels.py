"""Level meters with peak hold: the share of the input range that each channel uses."""

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from ..signals.arrays import Reals
from ._ring import Values

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
