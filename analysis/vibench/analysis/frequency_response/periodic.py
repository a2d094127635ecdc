"""Transmission from periodic noise: noise told apart from nonlinear distortion, lines without leakage.

The drive is a multisine played for whole periods, in several realisations of its random phases. The scatter
between periods is noise; what the scatter between realisations has beyond it is distortion (the
robust method of Pintelon & Schoukens, System Identification, 2nd ed., section 4.3, the drive as reference).

The best linear approximation over realisations of a periodic drive, its noise and its distortion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np
import scipy

from ..errors import InvalidRequest, NotEnoughData
from ..signals.arrays import Complexes, Flags, Integers, Reals
from ..signals.confidence import DEFAULT_CONFIDENCE, coherence_significance
from ..signals.window import Window
from ..tables import Labelled
from .estimators import coherence
from .repetition import Repetition, driven_lines, measured_repetition, period_spectra
from .results import Estimator, FrequencyResponse, FrequencyResponseSettings
from .steady import steady_relative_sd

_OVER_CHANCE = 8.0
"""Times the scatter that lines share by chance that they share by a drift."""
_MOST = 0.5
"""Part of the scatter beyond noise that a drift explains at least."""


class Scatter(StrEnum):
    """What the bounds of a periodic transmission were measured from."""

    REALISATIONS = "realisations"
    """The full uncertainty: noise and nonlinear distortion."""
    PERIODS = "periods"
    """One realisation only: noise alone; a nonlinear specimen may lie outside the bounds."""


@dataclass(frozen=True)
class Drift:
    """What all lines of a realisation share, and what differs among realisations: no distortion does that."""

    OWN_UNITS: ClassVar = {"gain_share": "1", "frequency_share": "1"}

    gain_share: float
    """Relative standard deviation among realisations of a factor of all lines."""
    frequency_share: float
    """That of a factor of all frequencies."""

    @property
    def text(self) -> str:
        """What drifted, in words."""
        drifts = (("gain of the channels", self.gain_share), ("specimen's frequencies", self.frequency_share))
        shares = " and ".join(f"the {what} by {100 * share:.2g} %" for what, share in drifts if share)
        return f"realisations differ by a drift of {shares}"


@dataclass(frozen=True)
class BestLinearApproximation:
    """Response over base at the driven lines; arrays of shape (lines,)."""

    value: Complexes
    coherence: Reals
    relative_sd: Reals
    """Standard deviation of ln(magnitude), equal to that of the phase [rad]."""
    steady_relative_sd: Reals
    """The same, steadied by neighbouring lines."""
    noise_variance: Reals
    """Complex variance of one realisation's estimate that noise explains."""
    distortion_variance: Reals | None
    """What realisations scatter beyond the noise and their drift; None for a single one."""
    drift: "Drift | None"
    scatter: Scatter
    averages: int
    """Independent values the scatter was measured from: realisations, or periods of the only one."""


def best_linear_approximation(
    drive: Complexes,
    base: Complexes,
    response: Complexes,
    covariance: Complexes,
    periods: int,
    frequency_hz: Reals,
) -> BestLinearApproximation:
    """Form response over base, referenced to the drive, and split its scatter.

    H = sum Y U* / sum X U*, with residuals v = Y - H X; Var(H) = s_v^2 sum |U|^2 / |sum X U*|^2
    (Pintelon & Schoukens, System Identification, 2nd ed., section 4.3.2, known reference).

    Parameters
    ----------
    drive, base, response
        Spectra U, X, Y averaged over the periods of each realisation, shape (realisations, lines).
    covariance
        Of these averages of (X, Y) between periods, averaged over realisations, shape (2, 2, lines).
    periods
        Periods per realisation.
    frequency_hz
        Of the lines.

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
    if count == 1:
        signal = np.abs(value) ** 2
        relative_sd = np.sqrt(noise_variance / 2) / np.abs(value)
        return BestLinearApproximation(
            value=value,
            coherence=signal / (signal + periods * noise_variance),
            relative_sd=relative_sd,
            steady_relative_sd=steady_relative_sd(relative_sd, value, 1 / to_one, 2 * (periods - 1)),
            noise_variance=noise_variance,
            distortion_variance=None,
            drift=None,
            scatter=Scatter.PERIODS,
            averages=periods,
        )
    residual = response - value * base
    variance = to_one * np.sum(np.abs(residual) ** 2, axis=0) / (count - 1)
    relative_sd = np.sqrt(variance / count / 2) / np.abs(value)
    steady_sd = steady_relative_sd(relative_sd, value, 1 / to_one, 2 * (count - 1))
    drift, left = _without_drift(residual / (value * base), value, frequency_hz, noise_variance, steady_sd)
    varied = to_one * np.sum(np.abs(left * value * base) ** 2, axis=0) / (count - 1)
    return BestLinearApproximation(
        value=value,
        coherence=coherence(
            np.sum(np.abs(base) ** 2, axis=0),
            np.sum(np.abs(response) ** 2, axis=0),
            np.sum(np.conj(base) * response, axis=0),
        ),
        relative_sd=relative_sd,
        steady_relative_sd=steady_sd,
        noise_variance=noise_variance,
        distortion_variance=np.maximum(varied - noise_variance, 0.0),
        drift=drift,
        scatter=Scatter.REALISATIONS,
        averages=count,
    )


def _without_drift(
    off: Complexes, value: Complexes, frequency_hz: Reals, noise_variance: Reals, sd: Reals
) -> tuple[Drift | None, Complexes]:
    """Find a drift of gain and of frequencies; give what it leaves.

    Distortion of random phases is independent from line to line, so it has hardly a part in common. A drift
    is one that explains most of the scatter beyond noise, and far more than chance does.

    Parameters
    ----------
    off
        Relative deviations of the realisations, shape (realisations, lines).
    value, frequency_hz, noise_variance, sd
        Transmission, frequencies, complex variance by noise, and relative standard deviation of the mean.

    """
    count, lines = off.shape
    stretch = frequency_hz * np.gradient(value, frequency_hz) / value if lines > 1 else np.zeros_like(value)
    known = np.isfinite(off).all(axis=0) & np.isfinite(stretch) & np.isfinite(sd) & (sd > 0)
    weight = 1 / sd[known, None]
    shapes = weight * np.stack((np.ones_like(stretch), stretch), axis=1)[known]
    target = weight * off[:, known].T
    by_noise = (noise_variance / np.abs(value) ** 2)[known, None]
    excess = float(np.sum(np.abs(target) ** 2) - (count - 1) * np.sum(weight**2 * by_noise))
    left, shares = target, [0.0, 0.0]
    for used in range(1, shapes.shape[1] + 1):
        factors = np.linalg.lstsq(shapes[:, :used], target, rcond=None)[0]
        rest = target - shapes[:, :used] @ factors
        before, after = (float(np.sum(np.abs(each) ** 2)) for each in (left, rest))
        if before - after > max(_OVER_CHANCE * before / lines, _MOST * excess):
            left, excess = rest, excess - (before - after)
            shares[:used] = np.sqrt(np.sum(np.abs(factors) ** 2, axis=1) / (count - 1)).tolist()
    if not any(shares):
        return None, off
    off = off.copy()
    off[:, known] = (left / weight).T
    return Drift(*shares), off


@dataclass(frozen=True)
class DetectionLines:
    """Lines that were not driven, inside the driven band: what is on them, the specimen made."""

    OWN_UNITS: ClassVar = {"response_amplitude": "{unit}", "noise_amplitude": "{unit}"}

    order: Integers
    """Multiple of the repetition frequency, shape (lines,): even ones show even, odd ones odd distortion."""
    frequency_hz: Reals
    response_amplitude: Reals
    """Rms over realisations of the response's amplitude [unit of the response]."""
    noise_amplitude: Reals
    """The part of it that noise explains (standard deviation of the mean over periods)."""


@dataclass(frozen=True)
class PeriodicFrequencyResponse(Labelled):
    """Best linear approximation of response over drive, and where its scatter comes from."""

    OWN_UNITS: ClassVar = {
        "frequency_response": "{unit}",
        "noise_variance": "({unit})2",
        "distortion_variance": "({unit})2",
        "detection": "m s-1",
    }

    frequency_response: FrequencyResponse
    noise_variance: Reals
    """Complex variance of one realisation's estimate that noise explains [(unit of the value)^2]."""
    distortion_variance: Reals | None
    """What realisations scatter beyond it and their drift; None when there was one realisation only."""
    drift: Drift | None
    scatter: Scatter
    realisations: int
    repetitions: tuple[Repetition, ...]
    """The measured period of every realisation, in converter samples."""
    detection: DetectionLines


@dataclass(frozen=True)
class _Realisation:
    """Mean spectra of one realisation, shape (lines,), and the scatter of its periods."""

    repetition: Repetition
    drive: Complexes
    base: Complexes
    response: Complexes
    covariance: Complexes
    """Of the means of (base, response) over the periods, shape (2, 2, lines)."""


class PeriodicSums:
    """Takes one realisation after the other and keeps their mean spectra only.

    Parameters
    ----------
    sample_rate_hz
        Nominal rate of the converter; its clock is the one frequencies are stated in.
    repetition_hz
        Nominal repetition frequency of the drive; the true one is measured.
    confidence
        Probability that a pair of bounds holds the truth, one line at a time.
    begun_with
        Realisations of other sums.

    """

    def __init__(
        self,
        sample_rate_hz: float,
        repetition_hz: float,
        *,
        confidence: float = DEFAULT_CONFIDENCE,
        begun_with: Sequence[_Realisation] = (),
    ) -> None:
        if not 0 < repetition_hz < sample_rate_hz / 4:
            raise InvalidRequest(
                f"repetition_hz is {repetition_hz:g}; it must lie above 0 and below a quarter of the "
                f"sample rate, {sample_rate_hz / 4:g} Hz"
            )
        self._sample_rate_hz = sample_rate_hz
        self._repetition_hz = repetition_hz
        self._confidence = confidence
        self._realisations = list(begun_with)

    def add(
        self, drive: Reals, base: Reals, response: Reals, *, repetition: Repetition | None = None
    ) -> None:
        """Take the settled samples of one realisation, each of shape (samples,).

        Raises NotEnoughData for fewer than two periods.

        Parameters
        ----------
        drive
            The clean reference: the recorded generator voltage.
        base, response
            What stands below and above the fraction bar.
        repetition
            Of this drive, where it was measured before.

        """
        if not drive.size == base.size == response.size:
            sizes = f"{drive.size}, {base.size} and {response.size}"
            raise InvalidRequest(f"drive, base and response hold {sizes} samples; they must be equally long")
        if repetition is None:
            repetition = measured_repetition(drive, self._sample_rate_hz / self._repetition_hz)
        channels = np.stack([drive, base, response])
        spectra = period_spectra(channels, repetition.period_samples, repetition.periods)
        motion = spectra[1:]
        deviation = motion - motion.mean(axis=1, keepdims=True)
        freedom = repetition.periods * (repetition.periods - 1)
        covariance = np.einsum("ipk,jpk->ijk", np.conj(deviation), deviation) / freedom
        self._realisations.append(
            _Realisation(
                repetition,
                spectra[0].mean(axis=0),
                motion[0].mean(axis=0),
                motion[1].mean(axis=0),
                covariance,
            )
        )

    def without_each(self) -> Iterator["PeriodicSums"]:
        """Give what stays when each realisation in turn is left out; nothing where there is one."""
        for place in range(len(self._realisations) if len(self._realisations) > 1 else 0):
            yield PeriodicSums(
                self._sample_rate_hz,
                self._repetition_hz,
                confidence=self._confidence,
                begun_with=[*self._realisations[:place], *self._realisations[place + 1 :]],
            )

    def motion(self) -> Complexes:
        """Give the mean spectra of base and response, shape (realisations, 2, lines)."""
        lines = min(one.drive.size for one in self._realisations)
        return np.stack([[one.base[:lines], one.response[:lines]] for one in self._realisations])

    def frequency_response(
        self, *, delay_s: float = 0.0, orders: Integers | None = None
    ) -> PeriodicFrequencyResponse:
        """Give the transmission of the realisations added so far, at the driven lines.

        The bounds are Student's with 2 (realisations - 1) degrees of freedom, so that they also hold for two
        or three realisations.

        Parameters
        ----------
        delay_s
            By how much the response channel lags the base channel (vibrometer decoder, filters);
            removed from the phase.
        orders
            Of the lines that are driven, as multiples of the repetition frequency; where they are not known,
            those that carry drive: a converter's noise and images of a held waveform may pass for it.

        """
        if not self._realisations:
            raise NotEnoughData("no realisation was added; give at least one")
        lines = min(one.drive.size for one in self._realisations)
        drive = np.stack([one.drive[:lines] for one in self._realisations])
        base = np.stack([one.base[:lines] for one in self._realisations])
        response = np.stack([one.response[:lines] for one in self._realisations])
        covariance = np.mean([one.covariance[:, :, :lines] for one in self._realisations], axis=0)
        period = float(np.mean([one.repetition.period_samples for one in self._realisations]))
        frequency_hz = np.arange(lines, dtype=np.float64) * (self._sample_rate_hz / period)
        driven = driven_lines(drive) if orders is None else _lines_of(orders, frequency_hz)
        periods = self._realisations[0].repetition.periods
        estimate = best_linear_approximation(
            drive[:, driven],
            base[:, driven],
            response[:, driven],
            covariance[:, :, driven],
            periods,
            frequency_hz[driven],
        )
        return PeriodicFrequencyResponse(
            frequency_response=self._frequency_response(frequency_hz[driven], estimate, period).without_delay(
                delay_s
            ),
            noise_variance=estimate.noise_variance,
            distortion_variance=estimate.distortion_variance,
            drift=estimate.drift,
            scatter=estimate.scatter,
            realisations=len(self._realisations),
            repetitions=tuple(one.repetition for one in self._realisations),
            detection=_detection(frequency_hz, driven, response, covariance[1, 1].real),
        )

    def _frequency_response(
        self, frequency_hz: Reals, estimate: BestLinearApproximation, period: float
    ) -> FrequencyResponse:
        quantile = float(scipy.stats.t.ppf((1 + self._confidence) / 2, 2 * (estimate.averages - 1)))
        return FrequencyResponse(
            frequency_hz=frequency_hz,
            value=estimate.value,
            coherence=estimate.coherence,
            n_eff=float(estimate.averages),
            relative_sd_magnitude=estimate.relative_sd,
            sd_phase_rad=estimate.relative_sd,
            half_width=quantile * estimate.relative_sd,
            coherence_significance=coherence_significance(estimate.averages, self._confidence),
            resolution_hz=0.0,
            segments_used=sum(one.repetition.periods for one in self._realisations),
            segments_excluded=0,
            steady_relative_sd=estimate.steady_relative_sd,
            settings=FrequencyResponseSettings(
                estimator=Estimator.DRIVE,
                sample_rate_hz=self._sample_rate_hz,
                segment_samples=round(period),
                window=Window.BOXCAR.value,
                overlap=0.0,
                confidence=self._confidence,
            ),
        )


def _lines_of(orders: Integers, frequency_hz: Reals) -> Flags:
    """Mark the lines of these orders, as far as the sample rate shows them."""
    marked = np.isin(np.arange(frequency_hz.size), orders)
    if not np.any(marked):
        raise InvalidRequest(
            f"the lowest line asked for is {np.min(orders)}; lines are known up to {frequency_hz.size - 1}, "
            f"{frequency_hz[-1]:g} Hz: record with a higher sample rate"
        )
    return np.asarray(marked)


def _detection(frequency_hz: Reals, driven: Flags, response: Complexes, variance: Reals) -> DetectionLines:
    strong = np.flatnonzero(driven)
    inside = np.arange(strong[0], strong[-1] + 1)
    quiet = inside[~driven[inside]]
    return DetectionLines(
        order=quiet,
        frequency_hz=frequency_hz[quiet],
        response_amplitude=np.sqrt(np.mean(np.abs(response[:, quiet]) ** 2, axis=0)),
        noise_amplitude=np.sqrt(variance[quiet]),
    )
