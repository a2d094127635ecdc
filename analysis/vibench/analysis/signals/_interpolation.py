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
        Shape (n,); the signal is taken as zero outside, so values within `REACH` of an end are wrong
        unless the signal is zero there.
    positions
        Where to evaluate, in samples from the first, shape (m,).

    Returns
    -------
    Shape (m,), exact to about 1e-9 of the signal up to `TRUSTED_BAND` of the sample rate.

    """
    result = np.empty(positions.size)
    _interpolate(np.ascontiguousarray(samples, dtype=np.float64), positions, _TABLE, result)
    return result


@kernel
def _interpolate(samples: Reals, positions: Reals, table: Reals, result: Reals) -> None:
    steps = table.size - 1
    for i in range(positions.size):
        # The nearest sample, not the one before: a position a hair below a sample would otherwise
        # divide a rounding error by a rounding error.
        whole = int(np.rint(positions[i]))
        fraction = positions[i] - whole
        if fraction == 0.0:
            result[i] = samples[whole] if 0 <= whole < samples.size else 0.0
            continue
        total = 0.0
        sign = -1.0 if REACH % 2 else 1.0
        for tap in range(-REACH, REACH + 1):
            source = whole + tap
            distance = fraction - tap
            if 0 <= source < samples.size and abs(distance) < REACH:
                place = abs(distance) / REACH * steps
                low = int(place)
                window = table[low] + (place - low) * (table[low + 1] - table[low])
                total += sign * samples[source] * window / distance
            sign = -sign
        result[i] = total * np.sin(np.pi * fraction) / np.pi
