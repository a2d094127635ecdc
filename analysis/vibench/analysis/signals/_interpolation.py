"""Values of a band-limited signal between its samples, to nine digits."""

import numpy as np
from scipy.special import i0

from vibench.sim.kernels import kernel

from ._arrays import Reals

REACH = 32
"""Samples on either side that one value is made of."""
TRUSTED_BAND = 0.4
"""Fraction of the sample rate up to which the interpolation is exact to about 1e-9."""

_KAISER_BETA = 19.9
"""Kaiser's formula for 64 taps and a transition from 0.4 to 0.6 of the sample rate: 189 dB."""
_TABLE_STEPS = 1 << 16
"""Linear interpolation in the window's table then errs by 1e-8 of the outer taps' weights."""
_TABLE = np.asarray(
    i0(_KAISER_BETA * np.sqrt(1 - np.linspace(0, 1, _TABLE_STEPS + 1) ** 2)) / i0(_KAISER_BETA),
    dtype=np.float64,
)


def interpolated(samples: Reals, positions: Reals) -> Reals:
    """Evaluate a signal at fractional sample positions by a Kaiser-windowed sinc.

    Parameters
    ----------
    samples
        Shape (n,), or (channels, n) of channels that are read at the same places; the signal is taken as zero
        outside, so values within `REACH` of an end are wrong unless the signal is zero there.
    positions
        Where to evaluate, in samples from the first, shape (m,).

    Returns
    -------
    Shape (m,) or (channels, m), exact to about 1e-9 of the signal up to `TRUSTED_BAND` of the sample rate.

    """
    channels = np.ascontiguousarray(np.atleast_2d(samples), dtype=np.float64)
    result = np.empty((len(channels), positions.size))
    _interpolate(channels, positions, _TABLE, result)
    return result.reshape(*samples.shape[:-1], positions.size)


@kernel
def _interpolate(channels: Reals, positions: Reals, table: Reals, result: Reals) -> None:
    size = channels.shape[1]
    weights = np.empty(2 * REACH)
    for i in range(positions.size):
        # The nearest sample, not the one before: a position a hair below a sample would otherwise
        # divide a rounding error by a rounding error.
        whole = int(np.rint(positions[i]))
        fraction = positions[i] - whole
        if fraction == 0.0:
            for channel in range(len(channels)):
                result[channel, i] = channels[channel, whole] if 0 <= whole < size else 0.0
            continue
        lowest = 1 - REACH if fraction > 0.0 else -REACH
        first = max(lowest, -whole)
        stop = max(first, min(lowest + 2 * REACH, size - whole))
        _weigh(fraction, first, stop, table, weights)
        for channel in range(len(channels)):
            result[channel, i] = _weighted(channels[channel], whole + first, weights, stop - first)


@kernel
def _weigh(fraction: float, first: int, stop: int, table: Reals, weights: Reals) -> None:
    """Give the weight of every tap: the windowed sinc at its distance."""
    steps = table.size - 1
    per_sample = steps / REACH
    scale = np.sin(np.pi * fraction) / np.pi
    sign = scale if first % 2 == 0 else -scale
    for tap in range(first, stop):
        distance = fraction - tap
        place = abs(distance) * per_sample
        # A fraction of a rounding error leaves the last tap on the window's edge.
        low = min(int(place), steps - 1)
        window = table[low] + (place - low) * (table[low + 1] - table[low])
        weights[tap - first] = sign * window / distance
        sign = -sign


@kernel
def _weighted(samples: Reals, first: int, weights: Reals, count: int) -> float:
    # Four sums that do not wait for each other.
    a = b = c = d = 0.0
    fours = count - count % 4
    for k in range(0, fours, 4):
        a += weights[k] * samples[first + k]
        b += weights[k + 1] * samples[first + k + 1]
        c += weights[k + 2] * samples[first + k + 2]
        d += weights[k + 3] * samples[first + k + 3]
    for k in range(fours, count):
        a += weights[k] * samples[first + k]
    return a + b + (c + d)
