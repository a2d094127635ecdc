"""Sensor dynamics on the grid of the world: exact poles, zeros fitted to the analogue response."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._recursive_filter import RecursiveFilter

_FIT_BAND = 0.2
"""The fit covers zero to this part of the grid's rate: what a converter at half the rate can pass."""
_FIT_FLOOR = 1e-2
"""Its lower end: below, the exact gain at zero hertz leads."""
_FIT_POINTS = 64
_ZEROS = 6
"""Numerator weights fitted."""


@dataclass(frozen=True)
class LowPass:
    """An analogue all-pole low-pass of unit gain at zero hertz."""

    poles: tuple[complex, ...]
    """In the left half plane, complex ones in pairs [rad/s]."""

    @property
    def delay_s(self) -> float:
        """Group delay at zero hertz [s]."""
        return float(-sum(1 / pole for pole in self.poles).real) if self.poles else 0.0

    def response(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Complex gain, shape of ``frequency_hz``."""
        s = 2j * np.pi * np.asarray(frequency_hz)
        return np.asarray(np.prod([pole / (pole - s) for pole in self.poles], axis=0), dtype=np.complex128)


def first_order(cut_hz: float) -> LowPass:
    """Build one real pole, -3 dB at ``cut_hz``."""
    return LowPass((complex(-2 * np.pi * cut_hz),))


def resonant(resonance_hz: float, damping_ratio: float) -> LowPass:
    """Build the response of a mass on a spring, below, at and above its resonance."""
    omega = 2 * np.pi * resonance_hz
    imaginary = omega * np.sqrt(1 - damping_ratio**2)
    pole = complex(-damping_ratio * omega, imaginary)
    return LowPass((pole, pole.conjugate()))


class RunningFilter:
    """A low-pass running on a grid of time, its state carried from call to call.

    The poles are mapped exactly (z = exp(s T)), so a resonance sits where it belongs even close to
    the grid's Nyquist frequency; one that lies beyond has no place there, and would ring at another. The
    zeros are the least-squares fit to the analogue response, phase included, with the gain at zero hertz
    exact.
    """

    def __init__(self, analogue: LowPass, step_s: float) -> None:
        """Design for a grid of ``step_s`` and start at rest."""
        poles = np.array([pole for pole in analogue.poles if abs(pole.imag) * step_s < np.pi])
        self._denominator = np.atleast_1d(np.asarray(np.poly(np.exp(poles * step_s)).real, dtype=np.float64))
        self._numerator = _fitted_zeros(analogue, self._denominator, step_s)
        self._running = RecursiveFilter(self._numerator, self._denominator)

    def run(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the next output values, one for each input value."""
        return self._running.run(values)

    def response(self, frequency_hz: NDArray[np.float64], step_s: float) -> NDArray[np.complex128]:
        """Complex gain of the filter as it runs, shape of ``frequency_hz``."""
        z = np.exp(-2j * np.pi * np.asarray(frequency_hz) * step_s)
        gain = np.polynomial.polynomial.polyval(z, self._numerator)
        return np.asarray(gain / np.polynomial.polynomial.polyval(z, self._denominator))


def _fitted_zeros(analogue: LowPass, denominator: NDArray[np.float64], step_s: float) -> NDArray[np.float64]:
    frequency_hz = np.geomspace(_FIT_FLOOR, _FIT_BAND, _FIT_POINTS) / step_s
    z = np.exp(-2j * np.pi * frequency_hz * step_s)
    target = analogue.response(frequency_hz) * np.polynomial.polynomial.polyval(z, denominator)
    powers = z[:, np.newaxis] ** np.arange(_ZEROS)
    # The weights sum to the denominator's: unit gain at zero hertz, taken out of the unknowns.
    total = denominator.sum()
    reduced = powers[:, 1:] - powers[:, :1]
    remainder = target - total * powers[:, 0]
    weight = (1 / frequency_hz)[:, np.newaxis]  # errors as delays: the low end counts as much as the high
    matrix = np.concatenate([reduced.real * weight, reduced.imag * weight])
    aim = np.concatenate([remainder.real * weight[:, 0], remainder.imag * weight[:, 0]])
    weights, *_ = np.linalg.lstsq(matrix, aim)
    return np.concatenate([[total - weights.sum()], weights])
