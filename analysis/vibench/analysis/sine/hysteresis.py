"""An up and a down sweep of the same level: where they differ, and how far their jumps lie apart."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..errors import InvalidRequest
from ..signals.arrays import Flags, Reals
from ..tables import Labelled
from .jumps import Jump
from .sweep import SweepResponse

_POINTS = 1000
_APART_DB = 1.5
_SMOOTHED_POINTS = 21
"""Two per cent of the band: chaos scatters from point to point, and that is no hysteresis."""
_PER_BEL_DB = 20.0


@dataclass(frozen=True, eq=False)
class Hysteresis(Labelled):
    """What depends on the direction of a sweep; arrays of shape (points,)."""

    frequency_hz: Reals
    up: Reals
    down: Reals
    """Response II."""
    differs: Flags
    """Where the two lie more than 1.5 dB apart in the mean over two per cent of the band."""
    pairs: tuple[tuple[Jump, Jump], ...]
    """Each jump upwards with the nearest one downwards of the opposite step: (up sweep, down sweep)."""

    @property
    def widths_hz(self) -> tuple[tuple[float, float, float], ...]:
        """Width of each pair, with its lower and upper bound: jump of the up sweep minus that of the down."""
        return tuple(
            (
                up.frequency_hz - down.frequency_hz,
                up.lower_hz - down.upper_hz,
                up.upper_hz - down.lower_hz,
            )
            for up, down in self.pairs
        )


def hysteresis(
    up: SweepResponse, down: SweepResponse, up_jumps: tuple[Jump, ...], down_jumps: tuple[Jump, ...]
) -> Hysteresis:
    """Compare an up with a down sweep where both have been.

    Raises InvalidRequest when the directions are not up and down, or the two share no frequency.
    """
    if not (up.sweep_rate_hz_per_s > 0 > down.sweep_rate_hz_per_s):
        raise InvalidRequest("hysteresis needs an up sweep and a down sweep, in this order")
    low = max(float(up.frequency_hz.min()), float(down.frequency_hz.min()))
    high = min(float(up.frequency_hz.max()), float(down.frequency_hz.max()))
    if low >= high:
        raise InvalidRequest("the two sweeps share no frequency; compare sweeps of the same range")
    frequency_hz = np.linspace(low, high, _POINTS)
    curves = [_read(each, frequency_hz) for each in (up, down)]
    apart_db = _PER_BEL_DB * np.log10(curves[0] / curves[1])
    together = uniform_filter1d(apart_db, _SMOOTHED_POINTS, mode="nearest")
    differs = np.asarray(np.abs(together) > _APART_DB)
    return Hysteresis(frequency_hz, curves[0], curves[1], differs, _pairs(up_jumps, down_jumps))


def _read(sweep: SweepResponse, frequency_hz: Reals) -> Reals:
    order = np.argsort(sweep.frequency_hz)
    return np.asarray(np.interp(frequency_hz, sweep.frequency_hz[order], sweep.response_ii[order]))


def _pairs(up: tuple[Jump, ...], down: tuple[Jump, ...]) -> tuple[tuple[Jump, Jump], ...]:
    """Pair jumps of opposite sign: what steps up in time going up steps down in time coming back."""
    pairs, free = [], list(down)
    for jump in up:
        opposite = [each for each in free if each.decibel * jump.decibel < 0]
        if opposite:
            nearest = min(opposite, key=lambda each: abs(each.frequency_hz - jump.frequency_hz))
            free.remove(nearest)
            pairs.append((jump, nearest))
    return tuple(pairs)
