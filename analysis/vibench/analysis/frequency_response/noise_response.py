"""Results of noise: the transmission from base to m0, with bounds, resonances and distortion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy.special import digamma, polygamma

from vibench.acquisition.plan import OddMultisine, StreamedNoise, WhiteNoise
from vibench.acquisition.recording import SegmentLabel

from ..errors import InvalidRequest, NotEnoughData
from ..recordings.channels import FORCE, RecordedChannels, Stretch, only_stretch
from ..recordings.checks import AbstractAnalysis
from ..signals import (
    Complexes,
    Flags,
    Quantity,
    Reals,
    Window,
    coherence_significance,
    relative_sd,
    student_half_width,
)
from ..spectra import DensitySums
from ..tables import Tabular, columns
from ..tones import NoiseDriveLevel, noise_drive_level
from . import transmissibility
from .modal_fit import SMALLEST_RELATIVE_SD, Resonance
from .periodic import Drift, PeriodicFrequencyResponse, PeriodicSums, Repetition
from .resonance import resonances, scattered_resonances
from .results import (
    Estimator,
    FrequencyResponse,
    FrequencyResponseRequest,
    FrequencyResponseSettings,
    FrequencyResponseView,
    converted_frequency_response,
)


@dataclass(frozen=True)
class Distortion(Tabular):
    """Noise and nonlinear distortion relative to a transmission; medians over spectral lines."""

    DOCUMENT: ClassVar = (
        "realisations median_not_repeating_over_magnitude=noise_share "
        "median_distortion_over_magnitude=distortion_share gain_drift=drift.gain_share "
        "frequency_drift=drift.frequency_share odd_detection_lines_m_per_s=odd_m_per_s "
        "even_detection_lines_m_per_s=even_m_per_s noise_on_detection_lines_m_per_s=detection_noise_m_per_s"
    )

    realisations: int
    drift: Drift | None
    noise_share: float
    """Relative standard deviation of a realisation due to noise or chaos, from the scatter of its periods."""
    distortion_share: float | None
    """Relative scatter of realisations beyond `noise_share`; None for a single realisation."""
    odd_m_per_s: float | None
    """Rms response on undriven odd spectral lines, without noise; None if there are no such lines."""
    even_m_per_s: float | None
    """Rms response on undriven even spectral lines, without noise; None if there are no such lines."""
    detection_noise_m_per_s: float | None
    """Rms response due to noise on the undriven spectral lines."""


def distortion(periodic: PeriodicFrequencyResponse) -> Distortion:
    """Return noise and distortion of a transmission from periodic noise.

    Undriven lines also show the nonlinearity of amplifier and shaker, not only that of the specimen.
    """
    magnitude = periodic.frequency_response.magnitude
    varied = periodic.distortion_variance
    quiet = periodic.detection
    is_even, by_noise = quiet.order % 2 == 0, quiet.noise_amplitude**2
    power = quiet.response_amplitude**2 - by_noise
    return Distortion(
        realisations=periodic.realisations,
        drift=periodic.drift,
        noise_share=float(np.median(np.sqrt(periodic.noise_variance) / magnitude)),
        distortion_share=None if varied is None else float(np.median(np.sqrt(varied) / magnitude)),
        odd_m_per_s=_rms(power[~is_even]),
        even_m_per_s=_rms(power[is_even]),
        detection_noise_m_per_s=_rms(by_noise),
    )


_DISTORTION_SURELY = 5.0
"""Number of standard deviations by which scatter must exceed noise to count as distortion."""


def scatters_beyond_noise(periodic: PeriodicFrequencyResponse) -> bool | None:
    """Return whether realisations scatter more than periods do; None for one realisation or period.

    For a linear specimen, the mean logarithm of the variance ratio follows Fisher's F.
    """
    count, periods = periodic.realisations, min(each.periods for each in periodic.repetitions)
    if count < 2 or periods < 2:
        return None
    found = periodic.frequency_response
    total = 2.0 * count * (found.relative_sd_magnitude * found.magnitude) ** 2
    known = (periodic.noise_variance > 0) & np.isfinite(total) & (total > 0)
    ratio = np.log(total[known] / periodic.noise_variance[known])
    above, below = count - 1.0, count * (periods - 1.0)
    expected = digamma(above) - np.log(above) - digamma(below) + np.log(below)
    sd = np.sqrt((polygamma(1, above) + polygamma(1, below)) / max(ratio.size, 1))
    return bool(ratio.size and np.mean(ratio) - expected > _DISTORTION_SURELY * sd)


def _rms(power: Reals) -> float | None:
    return float(np.sqrt(max(float(np.mean(power)), 0.0))) if power.size else None


Noise = WhiteNoise | OddMultisine | StreamedNoise
Estimated = tuple[FrequencyResponse, Callable[[], "NoiseResponse"]]
"""Pair: the transmission, and a slow function that returns all results, such as resonances."""
_BLOCK = 1 << 19
"""Number of samples read at once."""
_LEVEL_SEGMENT_S = 1.0
DEFAULT_REQUEST = FrequencyResponseRequest()
_LEAST_PERIODS = 2
_SURELY = 3.0
"""Smallest median difference between two estimators that counts as bias [sd of the median]."""
_BELOW_RESONANCE = 0.8
"""Frequency, relative to the lowest resonance, up to which the static transmissibility is fitted."""
_LEAST_STATIC_LINES = 8
"""Minimum number of spectral lines for that fit."""
_CERTAIN = 4.0
"""Number of standard deviations by which a deviation must exceed its limit."""
_ALIKE = 1e-10
"""Singular value, relative to the largest, below which the terms of that fit cannot be told apart."""
_GOOD_FIT, _LARGEST_MISFIT = 4.0, 0.01
"""Reduced chi-square of a good fit, and misfit relative to a that is negligible even if it is significant."""
_NO_MODE = 0.002
"""Largest d, relative to a, that damping and the powers of x left out of the fit may cause."""
_STATIC_DEVIATION = 0.25
"""Deviation of the static transmissibility from 1 that a plausible calibration may cause."""
_MOST_BY_CHANCE = 0.75
"""Fraction of lines above the median coherence of unrelated signals from which signals count as related."""
_MOST_TURNS = 3.0
"""Largest change of the phase [turns] in a band due to broad resonances."""
_SWITCHED = 10.0
"""Steady noise does not reach this ratio of drive energies in neighbouring half segments."""
_ALIKE_LINES = 4
"""Ratio of the variance of a median over windowed lines to that of a mean over independent lines."""


@dataclass(frozen=True)
class NoiseResponse(Tabular):
    """Transmission from base displacement to m0's displacement, with resonances and data quality."""

    OWN_UNITS: ClassVar = {**dict.fromkeys(("frequency_response", "h1", "h2"), "{0.unit}"), "periodic": "s"}
    DOCUMENT: ClassVar = (
        "independent_averages=frequency_response.n_eff used_s left_out lost_samples overloaded_samples "
        "median_coherence base_rms_acceleration_m_per_s2=base_level.rms_acceleration "
        "base_rms_displacement_m=base_level.rms_displacement_m relative_sd_base_rms=base_level.relative_sd"
    )

    frequency_response: FrequencyResponse
    """Requested estimate of the transmission; the default is referenced to the drive and unbiased."""
    h1: FrequencyResponse
    h2: FrequencyResponse
    resonances: tuple[Resonance, ...]
    base_level: NoiseDriveLevel
    bias: str
    """Remark if noise biases the estimator; otherwise empty."""
    periodic: PeriodicFrequencyResponse | None
    """Result for periodic noise, which separates the sources of scatter; None for other noise."""
    used_s: float
    """Total duration of the averaged data [s]."""
    left_out: int
    """Number of realisations or segments that are incomplete or contain lost or overloaded samples."""
    lost_samples: int
    """Number of samples lost during the noise."""
    overloaded_samples: int
    """Number of samples during the noise at which a channel was near full scale."""
    unit: str = "1"
    """Unit of the transmission; kg for a force."""
    unsteady: str = ""
    """Remark if the drive of streamed noise was switched; otherwise empty."""

    @property
    def hits(self) -> int | None:
        """Number of averaged hits; None for noise."""
        found = self.frequency_response
        return None if found.settings.decay_per_s is None else found.segments_used

    @property
    def median_coherence(self) -> float:
        """Median coherence over all spectral lines."""
        return float(np.median(self.frequency_response.coherence))


def repeated_response(
    channels: RecordedChannels,
    noise: WhiteNoise | OddMultisine,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    *,
    repetitions: Sequence[Repetition] = (),
) -> Estimated:
    """Estimate the transmission from all usable periodic noise.

    Raises NotEnoughData when no realisation is usable, and InvalidRequest when the request sets segments:
    here each period is a segment.

    Parameters
    ----------
    channels, noise, request
        Record, excitation and request.
    repetitions
        Period of every realisation, if known from the same drive; measured by default. With given periods, as
        for simulated records, the scatter of resonances among realisations is not computed.
    """
    if request.cuts_segments:
        raise InvalidRequest(
            f"this noise repeats every {1 / noise.repetition_hz:g} s, so each segment is one period without "
            f"a window, and lines are {noise.repetition_hz:g} Hz apart; resolution, segment, averages, "
            "window and overlap can be chosen for streamed noise only"
        )
    rate = channels.sample_rate_hz
    sums = PeriodicSums(rate, noise.repetition_hz, confidence=request.confidence)
    level = DensitySums(
        rate, segment_samples=round(rate * min(_LEVEL_SEGMENT_S, _LEAST_PERIODS / noise.repetition_hz))
    )
    stretches = channels.stretches(SegmentLabel.REALISATION)
    known: Sequence[Repetition | None] = repetitions or [None] * len(stretches)
    taken = used = 0
    bad = _Unusable()
    for stretch, repetition in zip(stretches, known, strict=True):
        data = _usable(channels, stretch, rate / noise.repetition_hz, bad)
        if data is None:
            continue
        sums.add(*data, repetition=repetition)
        level.add(data[1])
        used += data.shape[1]
        taken += 1
    if not taken:
        raise NotEnoughData(
            f"none of the {noise.realisations} planned realisations of noise contains two whole periods of "
            f"{1 / noise.repetition_hz:g} s without a fault{bad.text}; measure again"
        )
    periodic = sums.frequency_response(delay_s=channels.response_delay_s, orders=noise.lines)
    order = np.rint(periodic.frequency_response.frequency_hz / noise.repetition_hz).astype(int)
    sensors = channels.response_gain(periodic.frequency_response.frequency_hz)

    def estimate_by(estimator: Estimator, given: PeriodicSums = sums) -> FrequencyResponse:
        found = (
            periodic
            if given is sums
            else given.frequency_response(delay_s=channels.response_delay_s, orders=noise.lines)
        ).frequency_response
        if estimator is Estimator.DRIVE:
            return as_displacements(found, channels).without_gain(sensors)
        return _least_squares(
            found, given.motion()[..., order], estimator, channels, request.noise_ratio
        ).without_gain(sensors)

    chosen = estimate_by(request.estimator)

    def response() -> NoiseResponse:
        found = _resonances(chosen)
        if found and not repetitions and scatters_beyond_noise(periodic):
            without = (_resonances(estimate_by(request.estimator, each)) for each in sums.without_each())
            found = scattered_resonances(found, tuple(without))
        band = {"low_hz": noise.band_start_hz, "high_hz": noise.band_stop_hz}
        return NoiseResponse(
            **_estimates(chosen, found, estimate_by, channels, bad),
            base_level=noise_drive_level(level.density(), **band),
            periodic=periodic,
            used_s=used / rate,
            left_out=len(stretches) - taken,
        )

    return chosen, response


@dataclass
class _Unusable:
    """Counters of unusable samples."""

    lost: int = 0
    overloaded: int = 0

    def valid(self, data: Reals, overloaded: Flags) -> Flags:
        """Return flags of the usable samples, and count the unusable samples."""
        lost = np.isnan(data).any(axis=0)
        self.lost += int(np.count_nonzero(lost))
        self.overloaded += int(np.count_nonzero(overloaded & ~lost))
        return np.asarray(~(lost | overloaded))

    @property
    def text(self) -> str:
        """Return the counts as text to append to a sentence; empty if all samples are usable."""
        found = ((self.lost, "lost"), (self.overloaded, "near full scale"))
        text = " and ".join(f"{count} samples {what}" for count, what in found if count)
        return f" ({text})" if text else ""


def _usable(
    channels: RecordedChannels, stretch: Stretch, period_samples: float, bad: _Unusable
) -> Reals | None:
    """Return the samples of a realisation; None if it is faulty or shorter than two periods."""
    shortfall = 1e-3
    periods = int(stretch.samples / period_samples + shortfall)
    if periods < _LEAST_PERIODS:
        return None
    data = channels.read(stretch.start, stretch.stop)
    valid = bad.valid(data, channels.overload_flags(stretch.start, stretch.stop))
    return data if valid.all() else None


def _least_squares(
    like: FrequencyResponse,
    motion: Complexes,
    estimator: Estimator,
    channels: RecordedChannels,
    noise_ratio: float | None,
) -> FrequencyResponse:
    """Estimate h1, h2 or hv from realisations; ``motion`` has the shape (realisations, 2, lines)."""
    s_xx = np.sum(np.abs(motion[:, 0]) ** 2, axis=0)
    s_yy = np.sum(np.abs(motion[:, 1]) ** 2, axis=0)
    s_xy = np.sum(np.conj(motion[:, 0]) * motion[:, 1], axis=0)
    value = transmissibility.least_squares(estimator, s_xx, s_yy, s_xy, noise_ratio)
    agreement = transmissibility.coherence(s_xx, s_yy, s_xy)
    spread = relative_sd(np.maximum(agreement, np.finfo(float).tiny), like.n_eff)
    result = replace(
        like,
        value=value,
        coherence=agreement,
        relative_sd_magnitude=spread,
        sd_phase_rad=spread,
        half_width=student_half_width(spread, like.n_eff, like.settings.confidence),
        settings=replace(like.settings, estimator=estimator, noise_ratio=noise_ratio, delay_s=0.0),
    )
    return as_displacements(result.without_delay(channels.response_delay_s), channels)


def streamed_response(
    channels: RecordedChannels, noise: StreamedNoise, request: FrequencyResponseRequest = DEFAULT_REQUEST
) -> NoiseResponse:
    """Estimate the transmission from all usable non-periodic noise, or from all hits of a hammer.

    Raises NotEnoughData when fewer than two segments of noise remain, or no hit remains.
    """
    rate = channels.sample_rate_hz
    stretch = only_stretch(channels, SegmentLabel.NOISE)
    band = (noise.band_start_hz, noise.band_stop_hz)
    hits = transmissibility.find_hits(channels, stretch, band, request.segment_s)
    if hits is not None:
        return _response_to_hits(channels, hits, band, request)
    segment = request.segment_samples(stretch.samples, rate)
    if segment < round(rate / noise.band_start_hz):
        raise NotEnoughData(
            f"{stretch.samples / rate:.3g} s of noise allow segments of {segment / rate:.3g} s, but each "
            f"segment must contain a period of {noise.band_start_hz:g} Hz: request fewer averages, or "
            "measure longer"
        )
    sums = transmissibility.FrequencyResponseSums(
        FrequencyResponseSettings(
            Estimator.DRIVE, rate, segment, request.window, request.overlap, request.confidence
        )
    )
    level = DensitySums(rate, segment_samples=min(round(_LEVEL_SEGMENT_S * rate), segment))
    half = -(-segment // 2)
    energy = np.zeros(-(-stretch.samples // half))
    bad = _Unusable()
    for first in range(stretch.start, stretch.stop, _BLOCK):
        last = min(first + _BLOCK, stretch.stop)
        data = channels.read(first, last)
        valid = bad.valid(data, channels.overload_flags(first, last))
        if not valid.all():
            data = np.where(valid, data, 0.0)
        # The sums need the rows in this order: base, response, reference (the drive).
        sums.add(data[[1, 2, 0]], valid)
        level.add(data[1], valid)
        energy += np.bincount((np.arange(first, last) - stretch.start) // half, data[0] ** 2, energy.size)

    def estimate_by(estimator: Estimator) -> FrequencyResponse:
        noise_ratio = request.noise_ratio if estimator is Estimator.HV else None
        found = sums.with_estimator(estimator, noise_ratio).without_delay(channels.response_delay_s)
        inside = found.between(*band)
        return as_displacements(inside, channels).without_gain(channels.response_gain(inside.frequency_hz))

    chosen = estimate_by(request.estimator)
    found = _resonances(chosen)
    return NoiseResponse(
        **_estimates(chosen, found, estimate_by, channels, bad),
        base_level=noise_drive_level(level.density(), low_hz=band[0], high_hz=band[1]),
        periodic=None,
        used_s=stretch.samples / rate,
        left_out=chosen.segments_excluded,
        unsteady=_switching(energy[: stretch.samples // half]),
    )


def _switching(energy: Reals) -> str:
    """Return a remark if neighbouring half segments have very different drive energies (``energy``)."""
    jumps = int(np.sum(energy[1:] > _SWITCHED * energy[:-1]) + np.sum(energy[:-1] > _SWITCHED * energy[1:]))
    return (
        f"the drive's level changed by a factor of over {np.sqrt(_SWITCHED):.2g} within a segment ({jumps} "
        "times); motion that decays across the ends of segments biases damping beyond its bounds; import "
        "each part with steady noise alone"
        if jumps
        else ""
    )


def _response_to_hits(
    channels: RecordedChannels,
    hits: transmissibility.Hits,
    band_hz: tuple[float, float],
    request: FrequencyResponseRequest,
) -> NoiseResponse:
    rate, size, bad = channels.sample_rate_hz, hits.segment_samples, _Unusable()
    usable = []
    for start in hits.starts:
        data = channels.read(start, start + size)
        if bad.valid(data, channels.overload_flags(start, start + size)).all():
            usable.append(data)
    if not usable:
        raise NotEnoughData(f"all {len(hits.starts)} hits have a fault{bad.text}; measure again")
    data = np.array(usable)
    settings = FrequencyResponseSettings(request.estimator, rate, size, "", 0.0, request.confidence)
    spectra = transmissibility.hit_spectra(
        data, hits, settings, band_hz[1], fades=request.window is not Window.BOXCAR
    )
    decay_per_s = spectra.settings.decay_per_s or 0.0

    def estimate_by(estimator: Estimator, given: transmissibility.HitSpectra = spectra) -> FrequencyResponse:
        noise_ratio = request.noise_ratio if estimator is Estimator.HV else None
        found = given.response(estimator, noise_ratio).without_delay(channels.response_delay_s)
        inside = found.between(*band_hz)
        # The response is known at i w + decay, so convert to displacements with i w + decay, not with i w.
        shift = 1 + (not channels.is_force) * decay_per_s / (2j * np.pi * inside.frequency_hz)
        gain = channels.response_gain(inside.frequency_hz) / shift
        return as_displacements(inside, channels).without_gain(gain)

    chosen = estimate_by(request.estimator)
    found = _resonances(chosen)
    if spectra.count > 1:
        without = (_resonances(estimate_by(request.estimator, each)) for each in spectra.without_each())
        found = scattered_resonances(found, tuple(without))
    power = 2 * np.mean(np.abs(np.fft.rfft(data[:, 1])) ** 2, axis=0) / size**2
    line_hz = np.fft.rfftfreq(size, 1 / rate)
    inside = (line_hz >= band_hz[0]) & (line_hz <= band_hz[1])
    motion = np.sqrt([np.sum(power[inside] / (2 * np.pi * line_hz[inside]) ** each) for each in (0, 4)])
    return NoiseResponse(
        **_estimates(chosen, found, estimate_by, channels, bad),
        base_level=NoiseDriveLevel(*band_hz, float(motion[0]), float(motion[1]), np.nan),
        periodic=None,
        used_s=spectra.count * size / rate,
        left_out=hits.left_out + len(hits.starts) - spectra.count,
    )


def _estimates(
    chosen: FrequencyResponse,
    found: tuple[Resonance, ...],
    estimate_by: Callable[[Estimator], FrequencyResponse],
    channels: RecordedChannels,
    bad: _Unusable,
) -> dict[str, Any]:
    """Return the values of a `NoiseResponse` that all kinds of noise have in common."""
    return {
        "frequency_response": chosen,
        "h1": estimate_by(Estimator.H1),
        "h2": estimate_by(Estimator.H2),
        "resonances": found,
        "bias": _bias(chosen, estimate_by(Estimator.DRIVE), found),
        "lost_samples": bad.lost,
        "overloaded_samples": bad.overloaded,
        "unit": "kg" if channels.is_force else "1",
    }


def _bias(chosen: FrequencyResponse, referenced: FrequencyResponse, found: Sequence[Resonance]) -> str:
    """Return a remark if an estimate is biased; channel noise does not bias drive-referenced ones.

    The median difference of the two estimates, over the band or about a resonance, is a bias if it exceeds
    both three times its standard deviation and half the standard deviation of a line.
    """
    sd = np.fmax(chosen.relative_sd_magnitude, referenced.relative_sd_magnitude)
    known = np.isfinite(sd) & (chosen.magnitude > 0) & (referenced.magnitude > 0) & referenced.is_significant
    stretches = [("over the band", np.inf, 0.0)]
    stretches += [
        (f"about {each.frequency_hz:.4g} Hz", each.half_power_bandwidth_hz, each.frequency_hz)
        for each in found
    ]
    deviations = []
    for where, width_hz, middle_hz in stretches:
        lines = known & (np.abs(chosen.frequency_hz - middle_hz) <= width_hz)
        worth = np.count_nonzero(lines) / _ALIKE_LINES
        if worth >= 1:
            off = float(np.median(chosen.magnitude[lines] / referenced.magnitude[lines])) - 1
            if abs(off) > np.median(sd[lines]) * max(0.5, _SURELY / np.sqrt(worth)):
                deviations.append(f"{100 * abs(off):.2g} % {'above' if off > 0 else 'below'} 'drive' {where}")
    name = chosen.settings.estimator
    return f"noise biases {name}; use 'drive'. {name} is {' and '.join(deviations)}" if deviations else ""


def implausible_static_ratio(found: NoiseResponse) -> float | None:
    """Return the static transmissibility if it is certainly not 1, as wrong scales or signs cause; else None.

    Below the lowest resonance f1, the product of H and all factors 1 - (f / fn)^2 is fitted by
    a + b x + c x^2 + d / x with x = (f / f1)^2. The static transmissibility is a, unless d shows a mode below
    the band.
    """
    lines = found.frequency_response
    resonances_hz = np.array([each.frequency_hz for each in found.resonances])
    highest_hz = _BELOW_RESONANCE * min(resonances_hz, default=0.0)
    sd = np.maximum(lines.relative_sd_magnitude, SMALLEST_RELATIVE_SD) * lines.magnitude
    usable = (lines.frequency_hz <= highest_hz) & lines.is_significant & np.isfinite(sd) & (sd > 0)
    if found.unit == "kg" or np.count_nonzero(usable) < _LEAST_STATIC_LINES:
        return None
    squared = (lines.frequency_hz[usable] / resonances_hz[:, None]) ** 2
    x, flat = squared.max(axis=0), np.prod(1 - squared, axis=0)
    weights = 1 / (sd[usable] * flat)
    shapes = np.stack([np.ones_like(x), x, x**2, 1 / x], axis=1) * weights[:, None]
    wanted = lines.value.real[usable] * flat * weights
    sizes, _, rank, _ = np.linalg.lstsq(shapes, wanted, rcond=_ALIKE)
    if rank < len(sizes):
        return None
    residuals = wanted - shapes @ sizes
    scatter, misfit = np.mean(residuals**2), np.sqrt(np.mean((residuals / weights) ** 2))
    sd_ratio, _, _, sd_below = np.sqrt(max(scatter, 1.0) * np.sum(np.linalg.pinv(shapes) ** 2, axis=1))
    ratio, _, _, below = sizes
    # A mode that was not found, in the band or below it, leaves residuals beyond the noise.
    is_fitted = scatter < _GOOD_FIT or misfit < _LARGEST_MISFIT * abs(ratio)
    has_mode_below = abs(below) > _CERTAIN * sd_below + _NO_MODE * abs(ratio)
    is_implausible = abs(ratio - 1) > _STATIC_DEVIATION + _CERTAIN * sd_ratio
    return float(ratio) if is_fitted and not has_mode_below and is_implausible else None


def unrelated_motion(lines: FrequencyResponse) -> str:
    """Return a remark if base and response are not coherent, or if one is late; otherwise empty.

    By chance, half of the lines of unrelated signals exceed the median coherence of such signals. A delay
    changes the phase equally from line to line, but a resonance changes it at few lines.
    """
    size, spacing_hz = lines.frequency_hz.size, float(np.median(np.diff(lines.frequency_hz)))
    deviation = _CERTAIN * np.sqrt(max(1.0, lines.resolution_hz / spacing_hz) / size)
    share = np.mean(lines.coherence > coherence_significance(lines.n_eff, 0.5))
    if lines.n_eff > 1 and share < min(0.5 + 0.5 * deviation, _MOST_BY_CHANCE):
        return (
            f"the coherence of base and response (median {np.median(lines.coherence):.2g}) is not above that "
            "of unrelated signals; check channels and start times, or measure longer if the motion is chaotic"
        )
    steps = np.exp(1j * np.diff(np.angle(np.nan_to_num(lines.value))))
    mean = np.sum(steps)
    scatter = np.angle(steps * np.conj(mean))
    step = np.angle(mean) + np.median(scatter)
    if abs(step) < 2 * deviation * np.median(np.abs(scatter)) + 2 * np.pi * _MOST_TURNS / size:
        return ""
    late_s = -step / (2 * np.pi * spacing_hz)
    return (
        f"the phase changes with frequency as if the response moved about {abs(late_s):.2g} s "
        f"{'after' if late_s > 0 else 'before'} the base; align the channels"
    )


def as_displacements(frequency_response: FrequencyResponse, channels: RecordedChannels) -> FrequencyResponse:
    """Convert velocity over base acceleration to a displacement ratio; keep force over acceleration [kg]."""
    if channels.is_force:
        return frequency_response
    return converted_frequency_response(
        frequency_response,
        drive=(Quantity.ACCELERATION, Quantity.DISPLACEMENT),
        response=(Quantity.VELOCITY, Quantity.DISPLACEMENT),
    )


def _resonances(frequency_response: FrequencyResponse) -> tuple[Resonance, ...]:
    low, high = float(frequency_response.frequency_hz[0]), float(frequency_response.frequency_hz[-1])
    if frequency_response.n_eff > 1:
        return resonances(frequency_response, low_hz=low, high_hz=high)
    found = resonances(transmissibility.with_assumed_scatter(frequency_response), low_hz=low, high_hz=high)
    return tuple(transmissibility.without_bounds(each) for each in found)


_QUIET_S = 0.05
_QUIET_BLOCKS = 200


def scatter_over_silence(channels: RecordedChannels, noise: Noise, found: NoiseResponse) -> float:
    """Return the variance about the linear response, relative to silence, as the median over the lines.

    NaN for hits, or if all samples of the silence were lost. Chaos scatters periods as much as realisations,
    so only a comparison with silence reveals chaos. Recordings start or end in silence (no drive); without
    silence, the ratio is too small.
    """
    length, rate = round(_QUIET_S * channels.sample_rate_hz), round(channels.sample_rate_hz)
    label = SegmentLabel.NOISE if found.periodic is None else SegmentLabel.REALISATION
    stretches = channels.stretches(label)
    starts = np.concatenate([np.arange(each.start, each.stop - length, length) for each in stretches])
    if found.hits is not None or not starts.size:
        return np.nan

    def powers(at: Reals) -> Reals:
        blocks = [channels.read(int(each), int(each) + length)[1:] for each in at]
        return np.abs(np.fft.rfft(blocks * np.hanning(length))) ** 2

    lines = found.frequency_response
    block_hz = np.fft.rfftfreq(length, 1 / channels.sample_rate_hz)
    inside = (block_hz >= noise.band_start_hz) & (block_hz <= noise.band_stop_hz)
    ends = [np.arange(0, rate - length, length), channels.samples - np.arange(length, rate, length)]
    calm = powers(np.concatenate(ends))
    level = calm[:, 1, inside].sum(axis=1)
    calm = calm[level <= 2 * np.nanmin(level, initial=np.inf)]
    if not len(calm):
        return np.nan
    played = np.nanmean(powers(starts[:: -(-starts.size // _QUIET_BLOCKS)]), axis=0)
    silent = np.sum(np.mean(calm, axis=0) / played, axis=0)
    if found.periodic is None:
        scatter = 2 * lines.n_eff * lines.relative_sd_magnitude**2
    else:
        periods = min(each.periods for each in found.periodic.repetitions)
        varied = found.periodic.distortion_variance
        scatter = found.periodic.noise_variance + (0.0 if varied is None else varied)
        scatter = scatter * periods / found.periodic.frequency_response.magnitude**2
    return float(np.nanmedian(scatter / np.interp(lines.frequency_hz, block_hz, silent)))


@dataclass(frozen=True, eq=False)
class NoiseAnalysis(AbstractAnalysis[Noise, NoiseResponse]):
    """Analysis of a noise measurement: the transmission from base to m0."""

    DOCUMENT: ClassVar = "resonances=response.resonances transmission distortion *response"

    request: FrequencyResponseRequest
    """Request that produced this analysis."""

    @property
    def view(self) -> FrequencyResponseView:
        """Requested quantities and scale; for a force, always the apparent mass."""
        return replace(self.request.view, is_force=self.facts.response.endswith(f"_{FORCE}"))

    @property
    def transmission(self) -> dict[str, Any]:
        """The transmission in the requested quantities, as JSON."""
        view = self.view
        return columns(view, "quantity=name unit") | columns(
            view.apply(self.response.frequency_response),
            "estimator=settings.estimator noise_ratio=settings.noise_ratio window=settings.window "
            "segment_s=settings.segment_s overlap=settings.overlap resolution_hz segments_used "
            "segments_excluded delay_removed_s=settings.delay_s confidence=settings.confidence "
            "coherence_significance frequency_hz magnitude magnitude_lower magnitude_upper phase_rad "
            "phase_lower_rad phase_upper_rad coherence is_significant",
        )

    @property
    def distortion(self) -> Distortion | None:
        """Distortion from periodic noise; None for streamed noise."""
        return None if self.response.periodic is None else distortion(self.response.periodic)
