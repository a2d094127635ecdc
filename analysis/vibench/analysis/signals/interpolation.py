"""Values of a band-limited signal between its samples, to nine digits."""

import numpy as np
from scipy.special import i0

from vibench.sim.engine.run import native_engine

from .arrays import Reals

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
    values = np.empty((len(channels), positions.size))
    engine = native_engine()
    work = engine.new(
        "Interpolation",
        samples=channels,
        channels=len(channels),
        table=_WEIGHTS,
        positions=np.ascontiguousarray(positions, dtype=np.float64),
        values=values,
    )
    engine.call("interpolate", work)
    return values.reshape(*samples.shape[:-1], positions.size)
