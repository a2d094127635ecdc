"""Cut a periodic recording into its true periods, though generator and converter run on different clocks."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from ..errors import NotEnoughData, UnusableData
from ..signals.arrays import Complexes, Flags, Reals
from ..signals.interpolation import REACH, TRUSTED_BAND, interpolated

_SHORTFALL = 1e-3
"""Part of a period that may be missing at the end: clocks differ by less, and periodicity fills it in."""
_WEAKEST_LINE = 1e-3
"""A line is driven when its amplitude is within 60 dB of the strongest; quantisation lies below."""
_ITERATIONS = 8
_CONVERGED = 1e-9
"""Relative change of the period behind which all further passes move it by less than a tenth of that."""
_LARGEST_OFFSET = 200e-6
"""Relative clock offset that is looked for: two oscillators of 50 to 100 ppm each."""
_LEAST_SIMILARITY = 0.5
"""Power of the mean period over the mean power of the periods, below which nothing repeats."""


@dataclass(frozen=True)
class Repetition:
    """The period of a drive as the converter saw it."""

    period_samples: float
    """Converter samples in one period; need not be whole."""
    sd_samples: float
    """Standard deviation of it, from the drive channel's own noise."""
    periods: int
    """Whole periods in the record."""


def measured_repetition(drive: Reals, nominal_period_samples: float) -> Repetition:
    """Measure the true period of a recorded drive from the phase its lines gain per period.

    Weighted least squares of the phases of the driven lines over the periods, repeated on the newly cut
    periods until nothing moves. The first pass uses only the low lines, whose phase an offset of 200 ppm
    cannot turn by more than a quarter; high ones (images of a held waveform among them) join after it. Raises
    NotEnoughData for fewer than two periods, and UnusableData when the drive is silent or does not repeat.
    """
    period = nominal_period_samples
    highest = 0.25 / _LARGEST_OFFSET
    for _ in range(_ITERATIONS):
        count = whole_periods(drive.size, period)
        if count < 2:
            raise NotEnoughData(
                f"the record holds {drive.size / period:.2f} periods of {period:.1f} samples; "
                "measuring the repetition rate needs at least 2"
            )
        spectra = period_spectra(drive, period, count)
        change, spread = _phase_slope(spectra, highest)
        period *= 1 + change
        if abs(change) < _CONVERGED and highest > spectra.shape[1]:
            break
        highest = np.inf
    return Repetition(period, spread * period, count)


def whole_periods(samples: int, period_samples: float) -> int:
    """Count the periods in a record, a last one that lacks a thousandth included."""
    return int(np.floor(samples / period_samples + _SHORTFALL))


def period_spectra(samples: Reals, period_samples: float, periods: int) -> Complexes:
    """Fourier coefficients of each period, at exact multiples of the repetition frequency.

    Of samples of shape (n,), or (channels, n) of channels recorded together. The periods are resampled to a
    whole number of points, so a transform of each has no leakage (below 1e-8) although a period need not be
    a whole number of samples.

    Returns
    -------
    Amplitudes (a sine of amplitude 1 has magnitude 1), shape (..., periods, lines); line k is k times the
    repetition frequency; lines past `TRUSTED_BAND` of the sample rate are left out.

    """
    points = fft.next_fast_len(int(np.ceil(period_samples)), real=True)
    start, extended = _extended(samples, period_samples, periods)
    positions = start + np.arange(periods * points, dtype=np.float64) * (period_samples / points)
    cut = interpolated(extended, positions).reshape(*samples.shape[:-1], periods, points)
    lines = int(TRUSTED_BAND * period_samples) + 1
    return np.asarray(fft.rfft(cut, axis=-1)[..., :lines] * (2 / points))


def driven_lines(spectra: Complexes) -> Flags:
    """Tell which lines carry drive, from its spectra of shape (periods or realisations, lines)."""
    amplitude = np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
    amplitude[0] = 0.0
    strongest = float(np.max(amplitude))
    if not strongest > 0:
        raise UnusableData("the drive channel is silent; check that it was recorded")
    return np.asarray(amplitude > _WEAKEST_LINE * strongest)


def _extended(samples: Reals, period: float, periods: int) -> tuple[int, Reals]:
    """Continue a periodic record by its own neighbouring periods, as far as the interpolation reaches."""
    size = samples.shape[-1]
    missing = max(0, int(np.ceil(periods * period)) - size)
    before = interpolated(samples, np.arange(-REACH, 0, dtype=np.float64) + period)
    after = interpolated(samples, size + np.arange(REACH + missing, dtype=np.float64) - period)
    return REACH, np.concatenate((before, samples, after), axis=-1)


def _phase_slope(spectra: Complexes, highest: float) -> tuple[float, float]:
    """Relative change of the period that straightens the phases, and its standard deviation."""
    driven = np.flatnonzero(driven_lines(spectra))
    lines = driven[driven <= max(highest, driven[0])]
    chosen = spectra[:, lines]
    step = np.sum(chosen[1:] * np.conj(chosen[:-1]), axis=0)
    coarse = np.sum(np.abs(step) * lines * np.angle(step)) / np.sum(np.abs(step) * lines**2.0)
    order = np.arange(len(chosen)) - (len(chosen) - 1) / 2
    turned = chosen * np.exp(-1j * coarse * np.outer(order, lines))
    mean = np.mean(turned, axis=0)
    weight = np.abs(mean) ** 2
    if np.sum(weight) < _LEAST_SIMILARITY * np.mean(np.sum(np.abs(turned) ** 2, axis=1)):
        raise UnusableData(
            "the drive does not repeat at the stated rate; check the repetition rate of this segment "
            "and that it holds one realisation only"
        )
    phase = np.angle(turned * np.conj(mean))
    information = np.sum(weight * lines**2.0) * np.sum(order**2)
    fine = np.sum(weight * lines * (order @ phase)) / information
    residual = phase - fine * np.outer(order, lines)
    freedom = max(1, (len(order) - 1) * lines.size - 1)
    variance = np.sum(weight * residual**2) / freedom / information
    return float(-(coarse + fine) / (2 * np.pi)), float(np.sqrt(variance) / (2 * np.pi))
