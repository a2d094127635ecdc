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
_TAPS = 2 * REACH
_PHASES = 512
"""Fractions of a sample with weights of their own; a cubic between four of them errs by 1e-10."""


def _weights_of_phases() -> Reals:
    """Give the windowed sinc at every tap, from one phase before a sample to one phase behind the next."""
    fraction = np.arange(-1, _PHASES + 2, dtype=np.float64) / _PHASES
    distance = fraction[:, np.newaxis] - np.arange(1 - REACH, REACH + 1)
    shape = np.sqrt(np.maximum(1 - (distance / REACH) ** 2, 0.0))
    window = np.where(np.abs(distance) <= REACH, i0(_KAISER_BETA * shape) / i0(_KAISER_BETA), 0.0)
    # A sample is read exactly: the sine of a whole number of half turns is not quite nothing.
    sinc = np.where(distance == np.rint(distance), distance == 0.0, np.sinc(distance))
    return np.asarray(sinc * window)


_WEIGHTS = _weights_of_phases()


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
    _interpolate(channels, positions, _WEIGHTS, result)
    return result.reshape(*samples.shape[:-1], positions.size)


@kernel
def _interpolate(channels: Reals, positions: Reals, table: Reals, result: Reals) -> None:
    size = channels.shape[1]
    weights = np.empty(_TAPS)
    for i in range(positions.size):
        whole = int(np.floor(positions[i]))
        _weigh(positions[i] - whole, table, weights)
        # The part of the taps that lies on the signal.
        begin = whole + 1 - REACH
        first = min(max(-begin, 0), _TAPS)
        stop = max(first, min(size - begin, _TAPS))
        used = weights[first:stop]
        for channel in range(len(channels)):
            result[channel, i] = _product(used, channels[channel, begin + first : begin + stop])


@kernel
def _weigh(fraction: float, table: Reals, weights: Reals) -> None:
    """Give the weight of every tap: Lagrange's cubic through the phases around the fraction."""
    place = fraction * _PHASES
    row = min(int(place), _PHASES - 1)
    t = place - row
    a = -t * (t - 1) * (t - 2) / 6
    b = (t + 1) * (t - 1) * (t - 2) / 2
    c = -(t + 1) * t * (t - 2) / 2
    d = (t + 1) * t * (t - 1) / 6
    before, low, high, behind = table[row], table[row + 1], table[row + 2], table[row + 3]
    for tap in range(_TAPS):
        weights[tap] = (a * before[tap] + b * low[tap]) + (c * high[tap] + d * behind[tap])


@kernel
def _product(u: Reals, v: Reals) -> float:
    # Eight sums that do not wait for each other: a processor makes them in one instruction.
    a = b = c = d = e = f = g = h = 0.0
    eights = len(u) - len(u) % 8
    for k in range(0, eights, 8):
        a += u[k] * v[k]
        b += u[k + 1] * v[k + 1]
        c += u[k + 2] * v[k + 2]
        d += u[k + 3] * v[k + 3]
        e += u[k + 4] * v[k + 4]
        f += u[k + 5] * v[k + 5]
        g += u[k + 6] * v[k + 6]
        h += u[k + 7] * v[k + 7]
    for k in range(eights, len(u)):
        a += u[k] * v[k]
    return ((a + b) + (c + d)) + ((e + f) + (g + h))
