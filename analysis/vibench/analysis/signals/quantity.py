"""Conversion between displacement, velocity and acceleration, in the frequency domain."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import ClassVar

import numpy as np
from scipy import fft

from ..errors import InvalidRequest
from .arrays import Complexes, Reals


class Quantity(StrEnum):
    """Displacement, velocity or acceleration."""

    DISPLACEMENT = "displacement"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"

    @property
    def derivatives(self) -> int:
        """Order of the time derivative of displacement: 0, 1 or 2."""
        return list(Quantity).index(self)


@dataclass(frozen=True)
class ConvertedSignal:
    """A converted signal, with the number of disturbed samples at its ends."""

    OWN_UNITS: ClassVar = {"samples": "{unit}", "settled": "{unit}"}

    samples: Reals
    """Converted samples, shape (samples,) [m, m/s or m/s2]."""
    sample_rate_hz: float
    quantity: Quantity
    low_hz: float
    high_hz: float
    """Lower and upper end of the frequency band of the converted signal [Hz]."""
    edge_samples: int
    """Number of samples at each end that the conversion disturbs."""

    @property
    def settled(self) -> Reals:
        """Converted samples without the disturbed ends."""
        return self.samples[self.edge_samples : self.samples.size - self.edge_samples]


_TRANSITION = 0.5
"""Width of a band edge, as a fraction of the edge frequency; narrower edges ring longer."""
_EDGE_PERIODS = 6
"""Periods of the lower band edge after which its ringing is below 1e-3 of the disturbance."""
_ROW_SAMPLES = 1024
"""Number of samples of a steady line per computed exponential; a product takes a tenth of its time."""
hann = lru_cache(maxsize=4)(np.hanning)
"""Hann window of a given length, shared by all lines and all draws; do not change its values."""


def derivative_factor(frequency_hz: Reals, power: int) -> Complexes:
    """Return (i w)^power, which differentiates a spectrum; a negative power integrates, with NaN at 0 Hz."""
    omega = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    if power >= 0:
        return np.asarray(omega**power)
    at_rest = omega == 0
    return np.asarray(np.where(at_rest, complex(np.nan, np.nan), np.where(at_rest, 1, omega) ** power))


def converted_signal(
    samples: Reals,
    sample_rate_hz: float,
    *,
    given: Quantity,
    wanted: Quantity,
    low_hz: float,
    high_hz: float,
    lines_hz: Sequence[float] = (),
) -> ConvertedSignal:
    """Integrate or differentiate a signal within a band, without drift or the trapezoidal gain error.

    The spectrum of the whole signal is multiplied by (i w)^n and by a band with cosine edges. Each edge is
    half as wide as its frequency and lies outside the band; the band itself is unchanged. A straight line is
    subtracted first, so that offset and slow drift do not ring at the ends.

    Parameters
    ----------
    samples
        Shape (samples,), real.
    low_hz, high_hz
        The band to keep, 0 < low < high <= half the sample rate; choose ``low_hz`` well below the
        lowest line of interest and above the drift.
    lines_hz
        Frequencies of steady lines, if known. Lines in the band are converted in closed form, because a line
        cut off at an end would ring by 3e-4 at the band edge.
    """
    if not 0 < low_hz < high_hz <= sample_rate_hz / 2:
        raise InvalidRequest(
            f"the band is {low_hz:g} to {high_hz:g} Hz; it must start above 0 and end at or below "
            f"{sample_rate_hz / 2:g} Hz, half the sample rate"
        )
    edge = min(disturbed_samples(sample_rate_hz, low_hz), samples.size // 2)
    padded = fft.next_fast_len(samples.size + edge, real=True)
    frequency_hz = fft.rfftfreq(padded, 1 / sample_rate_hz)
    rest, steady = samples, np.zeros(samples.size)
    power = wanted.derivatives - given.derivatives
    for line_hz in (each for each in lines_hz if low_hz <= each <= high_hz):
        line = steady_line(rest, line_hz / sample_rate_hz)
        rest = rest - line.samples()
        steady += line.samples(complex(derivative_factor(np.array(line_hz), power)))
    centred = np.arange(rest.size) - 0.5 * (rest.size - 1)
    slope = float(centred @ rest) / max(float(centred @ centred), 1.0)
    spectrum = fft.rfft(rest - np.mean(rest) - slope * centred, padded)
    spectrum[0] = 0.0
    spectrum[1:] *= derivative_factor(frequency_hz[1:], power)
    spectrum[1:] *= _band(frequency_hz[1:], low_hz, high_hz)
    result = np.asarray(fft.irfft(spectrum, padded, overwrite_x=True)[: samples.size])
    return ConvertedSignal(result + steady, sample_rate_hz, wanted, low_hz, high_hz, edge)


@dataclass(frozen=True, eq=False)
class SteadyLine:
    """Steady sine of known frequency: real part of a phasor that is the product of row and column factors."""

    rows: Complexes
    """Phasor at the first sample of every row, shape (rows,)."""
    columns: Complexes
    """Rotation of the phasor within a row, shape (samples of a row,)."""
    count: int

    def samples(self, factor: complex = 1.0) -> Reals:
        """Return the samples of the sine, with its phasor multiplied by ``factor``; shape (count,)."""
        rows = factor * self.rows
        # A product of real matrices takes a quarter of the time that a product of complex matrices takes.
        whole = np.stack([rows.real, -rows.imag], axis=1) @ np.stack([self.columns.real, self.columns.imag])
        return np.asarray(whole.ravel()[: self.count])


def steady_line(samples: Reals, cycles_per_sample: float, beyond: int = 0) -> SteadyLine:
    """Return the steady sine of known frequency in a signal, continued by ``beyond`` samples at both ends."""
    turn = 2j * np.pi * cycles_per_sample
    columns = np.exp(turn * np.arange(_ROW_SAMPLES))
    rows = np.exp(turn * np.arange(0, samples.size, _ROW_SAMPLES))
    taper = hann(samples.size)
    tapered = np.zeros((rows.size, _ROW_SAMPLES))
    tapered.ravel()[: samples.size] = taper * samples
    in_rows = tapered @ np.stack([columns.real, columns.imag], axis=1)
    size = 2 * np.vdot(rows, in_rows[:, 0] - 1j * in_rows[:, 1]) / max(np.sum(taper), 1.0)
    from_start = np.arange(-beyond, samples.size + beyond, _ROW_SAMPLES)
    return SteadyLine(size * np.exp(turn * from_start), columns, samples.size + 2 * beyond)


def disturbed_samples(sample_rate_hz: float, low_hz: float) -> int:
    """Return the number of samples at each end that `converted_signal` disturbs."""
    return int(np.ceil(_EDGE_PERIODS * sample_rate_hz / low_hz))


def _band(frequency_hz: Reals, low_hz: float, high_hz: float) -> Reals:
    rise = (frequency_hz / low_hz - (1 - _TRANSITION)) / _TRANSITION
    fall = (1 + _TRANSITION - frequency_hz / high_hz) / _TRANSITION
    inside = np.clip(np.minimum(rise, fall), 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * inside))
