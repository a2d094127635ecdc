"""Where base and specimen are, from what is measured: integrated block by block, and high-passed."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter, lfilter_zi

from ..instruments import Samples

HIGH_PASS_HZ = 2.0
"""Corner of every high pass: a sine of 10 Hz comes out 0.2 % too small, one of 5 Hz 2.5 %."""


class _Section:
    """A second-order filter that goes on where the last block ended."""

    def __init__(self, numerator: tuple[float, ...], sample_rate_hz: float) -> None:
        corner = 2 * pi * HIGH_PASS_HZ
        self._b, self._a = bilinear(numerator, (1.0, sqrt(2.0) * corner, corner**2), sample_rate_hz)
        self._state: NDArray[np.float64] | None = None

    def run(self, values: Samples) -> Samples:
        if self._state is None:
            # As if the first block's mean had been there for ever. Its first value alone would be the peak
            # of whatever still rings from the run before, and swing for a second.
            self._state = lfilter_zi(self._b, self._a) * float(np.mean(values))
        out, self._state = lfilter(self._b, self._a, values, zi=self._state)
        return np.asarray(out)


def _integrator(sample_rate_hz: float) -> _Section:
    return _Section((1.0, 0.0), sample_rate_hz)


def _high_pass(sample_rate_hz: float) -> _Section:
    return _Section((1.0, 0.0, 0.0), sample_rate_hz)


@dataclass(frozen=True)
class BaseMotion:
    """The base in the samples of a block."""

    velocity: Samples
    """[m/s]"""
    displacement: Samples
    """[m]"""


class BaseTracker:
    """Follows the base from its acceleration: each integration is one with a second-order high pass."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._to_velocity = _integrator(sample_rate_hz)
        self._to_displacement = _integrator(sample_rate_hz)

    def follow(self, acceleration: Samples) -> BaseMotion:
        """Take the next samples [m/s2]; they must follow the last ones without a gap."""
        velocity = self._to_velocity.run(acceleration)
        return BaseMotion(velocity, self._to_displacement.run(velocity))


class SpecimenTracker:
    """Follows the main mass against the base: what its springs are stretched by.

    The vibrometer's velocity passes the same high pass as the base's, so that both have the same
    phase and their difference is right at low frequencies too.
    """

    def __init__(self, sample_rate_hz: float) -> None:
        self._high_pass = _high_pass(sample_rate_hz)
        self._to_displacement = _integrator(sample_rate_hz)

    def follow(self, mass_velocity: Samples, base_velocity: Samples, is_blind: NDArray[np.bool_]) -> Samples:
        """Give the displacement of the mass relative to the base [m] for the next velocities [m/s].

        Where the vibrometer is past its range (``is_blind``) it shows no motion, and none is assumed.
        """
        relative = self._high_pass.run(np.where(is_blind, 0.0, mass_velocity)) - base_velocity
        return self._to_displacement.run(np.where(is_blind, 0.0, relative))
