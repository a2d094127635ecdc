"""Correction of both channels for their sensors by short symmetric filters."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from vibench.acquisition.recording import coupling_cut_hz

from ..recordings.channels import SensedChannel, sensor_gain
from ..signals.arrays import Complexes, Reals

HALF_LENGTH = 16
"""Samples on each side that a corrected sample needs: a third of a millisecond at 51.2 kS/s."""
_EXACT_BAND = 0.42
"""Fraction of the sample rate up to which the correction is fitted; converters pass up to 0.45."""
_FIT_POINTS = 400
_REST_WEIGHT = 1e-3
"""Weight of the correction's fit above its band; the weight only limits the gain there."""


@dataclass(frozen=True, eq=False)
class SensorCorrection:
    """Filters for both channels, and the AC coupling for the tracker."""

    acceleration: Reals
    """Filter weights, shape (2 HALF_LENGTH + 1,); they also correct for linear interpolation."""
    velocity: Reals
    coupling_rad_per_s: float
    """Corner of the accelerometer's AC coupling, which the tracker corrects; 0 for DC."""

    def correct(self, acceleration: Reals, velocity: Reals) -> tuple[Reals, Reals]:
        """Return the motion of base and m0; values within HALF_LENGTH samples of an end are wrong."""
        return (
            np.convolve(acceleration, self.acceleration, "same"),
            np.convolve(velocity, self.velocity, "same"),
        )


def sensor_correction(
    bench: Mapping[str, Any], base: SensedChannel, response: SensedChannel, sample_rate_hz: float
) -> SensorCorrection:
    """Design the filters from a recording's sensors; undescribed sensors are assumed ideal."""

    def base_gain(frequency_hz: Reals) -> Complexes:
        interpolation = np.sinc(frequency_hz / sample_rate_hz) ** 2
        return np.asarray(sensor_gain(bench, base, frequency_hz) * interpolation)

    return SensorCorrection(
        acceleration=_inverse(base_gain, sample_rate_hz),
        velocity=_inverse(partial(sensor_gain, bench, response), sample_rate_hz),
        coupling_rad_per_s=2.0 * np.pi * coupling_cut_hz(base.coupling),
    )


def ideal_sensors(sample_rate_hz: float) -> SensorCorrection:
    """Return a correction for the interpolation between samples only."""

    def interpolation(frequency_hz: Reals) -> Complexes:
        return np.asarray(np.sinc(frequency_hz / sample_rate_hz) ** 2, dtype=np.complex128)

    only = np.zeros(2 * HALF_LENGTH + 1)
    only[HALF_LENGTH] = 1.0
    return SensorCorrection(_inverse(interpolation, sample_rate_hz), only, 0.0)


def _inverse(sensor: Callable[[Reals], Complexes], sample_rate_hz: float) -> Reals:
    """Return weights whose response is the inverse of a sensor's, by least squares over the band."""
    cycles = np.linspace(0.0, 0.5, _FIT_POINTS)
    inside = cycles <= _EXACT_BAND
    target = np.where(inside, 1.0 / sensor(cycles * sample_rate_hz), 0.0)
    lags = np.arange(-HALF_LENGTH, HALF_LENGTH + 1)
    matrix = np.exp(-2j * np.pi * cycles[:, np.newaxis] * lags)
    weight = np.where(inside, 1.0, _REST_WEIGHT)[:, np.newaxis]
    rows = np.concatenate([(matrix * weight).real, (matrix * weight).imag])
    aims = target * weight[:, 0]
    weights, *_ = np.linalg.lstsq(rows, np.concatenate([aims.real, aims.imag]))
    return np.asarray(weights / weights.sum())
