"""Transmission from periodic noise: separates noise from nonlinear distortion, without leakage.

The drive is a multisine played for whole periods, in several realisations of its random phases. The scatter
between periods is noise. Additional scatter between realisations is distortion (robust method of Pintelon &
Schoukens, System Identification, 2nd ed., section 4.3, with the drive as reference).
"""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np
import scipy
from scipy import fft

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..signals import (
    DEFAULT_CONFIDENCE,
    REACH,
    TRUSTED_BAND,
    Complexes,
    Flags,
    Integers,
    Reals,
    Window,
    coherence_significance,
    interpolate,
)
from ..tables import Tabular
from .results import Estimator, FrequencyResponse, FrequencyResponseSettings
from .transmissibility import coherence, steady_relative_sd

_SHORTFALL = 1e-3
"""Fraction of a period that may be missing at a record's end; the record is then extended periodically."""
_WEAKEST_LINE = 1e-3
"""Minimum amplitude of a driven line relative to the strongest line: -60 dB, above quantisation."""
_ITERATIONS = 8
_CONVERGED = 1e-9
"""Relative change of the period at which iteration stops; the error is then below a tenth of this change."""
_LARGEST_OFFSET = 200e-6
"""Largest relative offset between two clocks, for oscillators of 50 to 100 ppm each."""
_LEAST_SIMILARITY = 0.5
"""Minimum ratio of the power of the mean period to the mean power of a period, for a drive that repeats."""


@dataclass(frozen=True)
class Repetition:
    """Period of a drive, measured with the converter clock."""

    period_samples: float
    """Number of converter samples per period; need not be an integer."""
    sd_samples: float
    """Standard deviation of the period due to noise of the drive channel."""
    periods: int
    """Number of whole periods in the record."""


def measured_repetition(drive: Reals, nominal_period_samples: float) -> Repetition:
    """Measure the true period of a recorded drive from the phase advance of its lines per period.

    The phases of driven lines over the periods are fitted by weighted least squares until convergence. The
    first pass uses only low lines, whose phase changes by less than a quarter turn at 200 ppm. Raises
    NotEnoughData for fewer than two periods, and UnusableData when the drive is silent or does not repeat.
    """
    period = nominal_period_samples
    highest = 0.25 / _LARGEST_OFFSET
    for _ in range(_ITERATIONS):
        count = whole_periods(drive.size, period)
        if count < 2:
            raise NotEnoughData(
                f"the record contains {drive.size / period:.2f} periods of {period:.1f} samples; "
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
    """Return the number of whole periods in a record; the last period may be a thousandth too short."""
    return int(np.floor(samples / period_samples + _SHORTFALL))


def period_spectra(samples: Reals, period_samples: float, periods: int) -> Complexes:
    """Return the Fourier coefficients of each period, at exact multiples of the repetition frequency.

    Samples have shape (n,) or (channels, n). Each period is resampled to a whole number of points, so that
    its transform has no leakage (below 1e-8).

    Returns
    -------
    Amplitudes (a sine of amplitude 1 has magnitude 1), shape (..., periods, lines); line k is at k times
    the repetition frequency, up to `TRUSTED_BAND` of the sample rate.
    """
    points = fft.next_fast_len(int(np.ceil(period_samples)), real=True)
    # Continue the record periodically beyond both ends, as far as the interpolation needs samples.
    size = samples.shape[-1]
    missing = max(0, int(np.ceil(periods * period_samples)) - size)
    before = interpolate(samples, np.arange(-REACH, 0, dtype=np.float64) + period_samples)
    after = interpolate(samples, size + np.arange(REACH + missing, dtype=np.float64) - period_samples)
    start, extended = REACH, np.concatenate((before, samples, after), axis=-1)
    positions = start + np.arange(periods * points, dtype=np.float64) * (period_samples / points)
    cut = interpolate(extended, positions).reshape(*samples.shape[:-1], periods, points)
    lines = int(TRUSTED_BAND * period_samples) + 1
    return np.asarray(fft.rfft(cut, axis=-1)[..., :lines] * (2 / points))


def driven_lines(spectra: Complexes) -> Flags:
    """Return flags of the driven spectral lines, from spectra of shape (periods or realisations, lines)."""
    amplitude = np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
    amplitude[0] = 0.0
    strongest = float(np.max(amplitude))
    if not strongest > 0:
        raise UnusableData("the drive channel is silent; check that the drive was recorded")
    return np.asarray(amplitude > _WEAKEST_LINE * strongest)


def _phase_slope(spectra: Complexes, highest: float) -> tuple[float, float]:
    """Return the relative change of the period that makes the phases constant, and its standard deviation."""
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
            "the drive does not repeat at the stated rate; check the repetition rate of this segment, "
            "and that the segment contains only one realisation"
        )
    phase = np.angle(turned * np.conj(mean))
    information = np.sum(weight * lines**2.0) * np.sum(order**2)
    fine = np.sum(weight * lines * (order @ phase)) / information
    residual = phase - fine * np.outer(order, lines)
    freedom = max(1, (len(order) - 1) * lines.size - 1)
    variance = np.sum(weight * residual**2) / freedom / information
    return float(-(coarse + fine) / (2 * np.pi)), float(np.sqrt(variance) / (2 * np.pi))


_OVER_CHANCE = 8.0
"""Minimum ratio of the scatter explained by a drift to the amount expected by chance."""
_MOST = 0.5
"""A drift must explain at least this fraction of the scatter beyond noise."""


_SMALL = 0.03
"""Lines up to this relative deviation are used to find a drift; deviations near narrow modes are larger."""
_OFTEN = 3.0
"""Lines up to this multiple of the median deviation are also used to find a drift."""


class Scatter(StrEnum):
    """Scatter that determines the bounds of a periodic transmission."""

    REALISATIONS = "realisations"
    """Bounds contain the full uncertainty: noise and nonlinear distortion."""
    PERIODS = "periods"
    """Bounds contain noise only, from one realisation; a nonlinear response may lie outside."""


@dataclass(frozen=True)
class Drift:
    """Changes between realisations that are common to all spectral lines, and therefore not distortion."""

    OWN_UNITS: ClassVar = {"gain_share": "1", "frequency_share": "1", "common_share": "1"}

    gain_share: float
    """Relative standard deviation of the gain among realisations."""
    frequency_share: float
    """Relative standard deviation of all frequencies among realisations."""
    common_share: float
    """Relative standard deviation of other changes common to all lines, such as damping or delay; median over
    the lines."""

    @property
    def text(self) -> str:
        """Description of the drift in words."""
        drifts = {
            "the gain of the channels": self.gain_share,
            "the specimen's frequencies": self.frequency_share,
            "all lines together": self.common_share,
        }
        shares = " and ".join(f"{what} by {100 * share:.2g} %" for what, share in drifts.items() if share)
        return f"realisations differ because of a drift of {shares}"


def best_linear_approximation(
    drive: Complexes,
    base: Complexes,
    response: Complexes,
    covariance: Complexes,
    repetitions: tuple[Repetition, ...],
    frequency_hz: Reals,
    settings: FrequencyResponseSettings,
) -> tuple[FrequencyResponse, Reals, Reals | None, Drift | None]:
    """Estimate response over base, referenced to the drive, and separate noise from distortion.

    H = sum Y U* / sum X U*, with residuals v = Y - H X; Var(H) = s_v^2 sum |U|^2 / |sum X U*|^2
    (Pintelon & Schoukens, System Identification, 2nd ed., section 4.3.2, known reference).

    Parameters
    ----------
    drive, base, response
        Spectra U, X, Y averaged over the periods of each realisation, shape (realisations, lines).
    covariance
        Covariance of the averages of (X, Y) from the scatter of the periods, mean over realisations, shape
        (2, 2, lines).
    repetitions
        Measured period of each realisation.
    frequency_hz
        Frequencies of the lines.

    Returns
    -------
    The response at the lines, the variance of one realisation's value due to noise, the variance beyond
    noise and drift, and the drift; the last two are None for a single realisation.
    """
    count = len(drive)
    through = np.sum(base * np.conj(drive), axis=0)
    value = np.sum(response * np.conj(drive), axis=0) / through
    to_one = count * np.sum(np.abs(drive) ** 2, axis=0) / np.abs(through) ** 2
    noise = np.maximum(
        covariance[1, 1].real
        + np.abs(value) ** 2 * covariance[0, 0].real
        - 2 * np.real(np.conj(value) * covariance[0, 1]),
        0.0,
    )
    noise_variance = to_one * noise
    residual = response - value * base
    if count == 1:
        averages, variance = repetitions[0].periods, noise_variance
        coherent = np.abs(value) ** 2 / (np.abs(value) ** 2 + averages * noise_variance)
    else:
        averages, variance = count, to_one * np.sum(np.abs(residual) ** 2, axis=0) / (count - 1)
        of_base, of_response = (np.sum(np.abs(each) ** 2, axis=0) for each in (base, response))
        coherent = coherence(of_base, of_response, np.sum(np.conj(base) * response, axis=0))
    relative_sd = np.sqrt(variance / count / 2) / np.abs(value)
    steady_sd = steady_relative_sd(relative_sd, value, 1 / to_one, 2 * (averages - 1))
    distortion_variance = drift = None
    if count > 1:
        off = residual / (value * base)
        drift, left = _without_drift(off, value, frequency_hz, noise_variance, steady_sd)
        varied = to_one * np.sum(np.abs(left * value * base) ** 2, axis=0) / (count - 1)
        distortion_variance = np.maximum(varied - noise_variance, 0.0)
    estimate = FrequencyResponse(
        frequency_hz=frequency_hz,
        value=value,
        coherence=coherent,
        n_eff=float(averages),
        relative_sd_magnitude=relative_sd,
        sd_phase_rad=relative_sd,
        half_width=scipy.stats.t.ppf((1 + settings.confidence) / 2, 2 * (averages - 1)) * relative_sd,
        coherence_significance=coherence_significance(averages, settings.confidence),
        resolution_hz=0.0,
        segments_used=sum(one.periods for one in repetitions),
        segments_excluded=0,
        steady_relative_sd=steady_sd,
        settings=settings,
    )
    return estimate, noise_variance, distortion_variance, drift


def _without_drift(
    off: Complexes, value: Complexes, frequency_hz: Reals, noise_variance: Reals, sd: Reals
) -> tuple[Drift | None, Complexes]:
    """Return the drift between realisations, None if insignificant, and the deviations without drift.

    Distortion with random phases is independent between lines, so a part common to all lines is a drift. The
    drift must explain most of the scatter beyond noise, and far more than chance would.

    Parameters
    ----------
    off
        Relative deviations of the realisations, shape (realisations, lines).
    value, frequency_hz, noise_variance, sd
        Transmission, frequencies, complex variance due to noise, and relative standard deviation of the mean.
    """
    count = len(off)
    # The ratio of displacements is value * frequency, so a common shift of frequencies scales the ratio.
    moved = value * frequency_hz
    stretch = frequency_hz * _slope(moved, frequency_hz) / moved
    known = np.isfinite(off).all(axis=0) & np.isfinite(stretch) & np.isfinite(sd) & (sd > 0)
    shapes, target = np.stack((np.ones_like(stretch), stretch), axis=1)[known], off[:, known].T
    largest = np.abs(target).max(axis=1, initial=0.0)
    is_small = largest < max(_SMALL, _OFTEN * float(np.median(largest)))
    weight, lines = is_small[:, None] / sd[known, None], max(1, int(np.count_nonzero(is_small)))
    by_noise = (noise_variance / np.abs(value) ** 2)[known, None]
    excess = float(np.sum(np.abs(weight * target) ** 2) - (count - 1) * np.sum(weight**2 * by_noise))
    left, shares = target, np.zeros(2)
    for used in ([0], [1], [0, 1]):
        factors = np.linalg.lstsq(weight * shapes[:, used], weight * target, rcond=None)[0]
        rest = target - shapes[:, used] @ factors
        before, after = (float(np.sum(np.abs(weight * each) ** 2)) for each in (left, rest))
        if before - after > max(_OVER_CHANCE * before / lines, _MOST * excess):
            left, excess = rest, excess - (before - after)
            shares[:] = 0.0
            shares[used] = np.sqrt(np.sum(np.abs(factors) ** 2, axis=1) / (count - 1))
    left, common_share = _without_common(left, by_noise)
    if not np.any(shares) and common_share == 0.0:
        return None, off
    off = off.copy()
    off[:, known] = left.T
    return Drift(float(shares[0]), float(shares[1]), common_share), off


_TOGETHER = 0.8
"""Changes common to all spectral lines must explain at least this fraction of the scatter."""
_BEYOND_CHANCE = 1.25
"""Minimum ratio of the explained fraction to the largest fraction expected for independent lines."""


def _without_common(off: Complexes, by_noise: Reals) -> tuple[Complexes, float]:
    """Remove up to two changes common to all lines; return the rest and the median size of the changes.

    Singular values of independent lines have a known largest size (Marchenko and Pastur, Math. USSR-Sbornik 1
    (1967) 457).

    Parameters
    ----------
    off
        Relative deviations, shape (lines, realisations).
    by_noise
        Relative complex variance due to noise, shape (lines, 1).
    """
    freedom = off.shape[1] - 1
    variance = np.maximum(np.sum(np.abs(off) ** 2, axis=1, keepdims=True) / freedom, 1e-300)
    weight = np.sqrt(np.maximum(1.0 - by_noise / variance, 0.0) / variance)
    rows = np.concatenate([(weight * off).real, (weight * off).imag])
    _, sizes, courses = np.linalg.svd(rows, full_matrices=False)
    total = max(float(np.sum(sizes**2)), 1e-300)
    by_chance = (1.0 + np.sqrt(freedom / max(np.count_nonzero(weight), 1) / 2)) ** 2 / freedom
    for used in (1, 2):
        least = max(_TOGETHER, _BEYOND_CHANCE * used * by_chance)
        if least < 1.0 and np.sum(sizes[:used] ** 2) > least * total:
            common = off @ courses[:used].T @ courses[:used]
            moved = np.sqrt(np.sum(np.abs(common) ** 2, axis=1) / freedom)
            return (off - common) * np.sqrt(freedom / (freedom - used)), float(np.median(moved))
    return off, 0.0


def _slope(value: Complexes, frequency_hz: Reals) -> Complexes:
    """Return the frequency derivative at each line, from a local quotient of linear functions (one mode)."""
    if value.size == 1:
        return np.zeros_like(value)
    slope = np.gradient(value, frequency_hz)
    steps = np.diff(value) / np.diff(frequency_hz)
    across = (value[2:] - value[:-2]) / (frequency_hz[2:] - frequency_hz[:-2])
    product = steps[1:] * steps[:-1]
    # The modal slope would be too large at smooth extrema, and in modes narrower than three lines.
    is_mode = np.abs(product) < np.abs(across) ** 2
    slope[1:-1][is_mode] = product[is_mode] / across[is_mode]
    return np.asarray(slope)


@dataclass(frozen=True)
class DetectionLines:
    """Undriven spectral lines inside the driven band, which show distortion."""

    OWN_UNITS: ClassVar = {"response_amplitude": "{unit}", "noise_amplitude": "{unit}"}

    order: Integers
    """Multiple of the repetition frequency, shape (lines,); odd distortion appears at odd orders."""
    frequency_hz: Reals
    response_amplitude: Reals
    """Rms over realisations of the response's amplitude [unit of the response]."""
    noise_amplitude: Reals
    """Part of the response's amplitude caused by noise (standard deviation of the mean over periods)."""


@dataclass(frozen=True)
class PeriodicFrequencyResponse(Tabular):
    """Best linear approximation of response over drive, with the sources of its scatter."""

    OWN_UNITS: ClassVar = {
        "frequency_response": "{unit}",
        "noise_variance": "({unit})2",
        "distortion_variance": "({unit})2",
        "detection": "m s-1",
    }

    frequency_response: FrequencyResponse
    noise_variance: Reals
    """Variance of the complex value of one realisation due to noise [(unit of the value)^2]."""
    distortion_variance: Reals | None
    """Variance of the complex response beyond noise and drift; None for a single realisation."""
    drift: Drift | None
    scatter: Scatter
    realisations: int
    repetitions: tuple[Repetition, ...]
    """The measured period of every realisation, in converter samples."""
    detection: DetectionLines


@dataclass(frozen=True)
class _Realisation:
    """Mean spectra of one realisation, and the scatter of its periods."""

    repetition: Repetition
    spectra: Complexes
    """Mean spectra of drive, base and response over the periods, shape (3, lines)."""
    covariance: Complexes
    """Covariance of the means of (base, response) over the periods, shape (2, 2, lines)."""


class PeriodicSums:
    """Mean spectra of realisations, which are added one by one.

    Parameters
    ----------
    sample_rate_hz
        Nominal rate of the converter, whose clock defines all frequencies.
    repetition_hz
        Nominal repetition frequency of the drive; the true frequency is measured.
    confidence
        Probability that the bounds of a line contain the true value.
    """

    def __init__(
        self,
        sample_rate_hz: float,
        repetition_hz: float,
        *,
        confidence: float = DEFAULT_CONFIDENCE,
    ) -> None:
        if not 0 < repetition_hz < sample_rate_hz / 4:
            raise InvalidRequest(
                f"repetition_hz is {repetition_hz:g}; it must lie above 0 and below a quarter of the "
                f"sample rate, {sample_rate_hz / 4:g} Hz"
            )
        self._sample_rate_hz = sample_rate_hz
        self._repetition_hz = repetition_hz
        self._confidence = confidence
        self.realisations: list[_Realisation] = []
        """Realisations added so far."""

    def add(
        self, drive: Reals, base: Reals, response: Reals, *, repetition: Repetition | None = None
    ) -> None:
        """Add the settled samples of one realisation, each of shape (samples,).

        Raises NotEnoughData for fewer than two periods.

        Parameters
        ----------
        drive
            Reference without noise: the recorded generator voltage.
        base, response
            Denominator and numerator of the transmission.
        repetition
            Repetition of this drive, if known.
        """
        if not drive.size == base.size == response.size:
            sizes = f"{drive.size}, {base.size} and {response.size}"
            raise InvalidRequest(f"drive, base and response have {sizes} samples; they must be equally long")
        if repetition is None:
            repetition = measured_repetition(drive, self._sample_rate_hz / self._repetition_hz)
        channels = np.stack([drive, base, response])
        spectra = period_spectra(channels, repetition.period_samples, repetition.periods)
        motion = spectra[1:]
        deviation = motion - motion.mean(axis=1, keepdims=True)
        freedom = repetition.periods * (repetition.periods - 1)
        covariance = np.einsum("ipk,jpk->ijk", np.conj(deviation), deviation) / freedom
        self.realisations.append(_Realisation(repetition, spectra.mean(axis=1), covariance))

    def without_each(self) -> Iterator["PeriodicSums"]:
        """Yield, for each realisation, the spectra of all other realisations; nothing for one alone."""
        for place in range(len(self.realisations) if len(self.realisations) > 1 else 0):
            others = copy(self)
            others.realisations = [*self.realisations[:place], *self.realisations[place + 1 :]]
            yield others

    def motion(self) -> Complexes:
        """Return the mean spectra of base and response, shape (realisations, 2, lines)."""
        return self._spectra()[:, 1:]

    def _spectra(self) -> Complexes:
        """Return the mean spectra of drive, base and response, shape (realisations, 3, lines)."""
        lines = min(one.spectra.shape[1] for one in self.realisations)
        return np.stack([one.spectra[:, :lines] for one in self.realisations])

    def frequency_response(
        self, *, delay_s: float = 0.0, orders: Integers | None = None
    ) -> PeriodicFrequencyResponse:
        """Return the frequency response at the driven lines, from the realisations added so far.

        Bounds follow Student's t with 2 (realisations - 1) degrees of freedom, valid from two realisations.

        Parameters
        ----------
        delay_s
            Delay of the response channel behind the base channel (vibrometer decoder, filters),
            removed from the phase.
        orders
            Driven lines as multiples of the repetition frequency. By default they are the strong lines of the
            drive, which may include noise and images of a sample-and-hold output.
        """
        if not self.realisations:
            raise NotEnoughData("no realisation was added; give at least one")
        drive, base, response = self._spectra().transpose(1, 0, 2)
        lines = drive.shape[1]
        covariance = np.mean([one.covariance[:, :, :lines] for one in self.realisations], axis=0)
        period = float(np.mean([one.repetition.period_samples for one in self.realisations]))
        frequency_hz = np.arange(lines, dtype=np.float64) * (self._sample_rate_hz / period)
        driven = driven_lines(drive) if orders is None else _lines_of(orders, frequency_hz)
        repetitions = tuple(one.repetition for one in self.realisations)
        estimate, noise_variance, distortion_variance, drift = best_linear_approximation(
            drive[:, driven],
            base[:, driven],
            response[:, driven],
            covariance[:, :, driven],
            repetitions,
            frequency_hz[driven],
            FrequencyResponseSettings(
                estimator=Estimator.DRIVE,
                sample_rate_hz=self._sample_rate_hz,
                segment_samples=round(period),
                window=Window.BOXCAR.value,
                overlap=0.0,
                confidence=self._confidence,
            ),
        )
        strong = np.flatnonzero(driven)
        inside = np.arange(strong[0], strong[-1] + 1)
        quiet = inside[~driven[inside]]
        return PeriodicFrequencyResponse(
            frequency_response=estimate.without_delay(delay_s),
            noise_variance=noise_variance,
            distortion_variance=distortion_variance,
            drift=drift,
            scatter=Scatter.PERIODS if len(repetitions) == 1 else Scatter.REALISATIONS,
            realisations=len(repetitions),
            repetitions=repetitions,
            detection=DetectionLines(
                order=quiet,
                frequency_hz=frequency_hz[quiet],
                response_amplitude=np.sqrt(np.mean(np.abs(response[:, quiet]) ** 2, axis=0)),
                noise_amplitude=np.sqrt(covariance[1, 1].real[quiet]),
            ),
        )


def _lines_of(orders: Integers, frequency_hz: Reals) -> Flags:
    """Return flags of the spectral lines with these orders, up to the limit of the sample rate."""
    marked = np.isin(np.arange(frequency_hz.size), orders)
    if not np.any(marked):
        raise InvalidRequest(
            f"the lowest requested line is {np.min(orders)}; known lines end at {frequency_hz.size - 1} "
            f"({frequency_hz[-1]:g} Hz): record with a higher sample rate"
        )
    return np.asarray(marked)
