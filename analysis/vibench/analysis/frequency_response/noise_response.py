"""Results of a noise measurement: the transmission from base to m0, with bounds and resonances."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from vibench.acquisition.plan import OddMultisine, StreamedNoise, WhiteNoise
from vibench.acquisition.recording import SegmentLabel

from ..errors import InvalidRequest, NotEnoughData
from ..recordings.channels import Channels, Stretch, only_stretch
from ..recordings.checks import AbstractAnalysis
from ..recordings.response import FORCE
from ..signals.arrays import Complexes, Flags, Reals
from ..signals.confidence import relative_sd, student_half_width
from ..signals.quantity import Quantity
from ..signals.window import Window
from ..spectra.spectra import DensitySums
from ..tables import Tabular, columns
from ..tones.sine_fit import NoiseDriveLevel, noise_drive_level
from .distortion import Distortion, distortion, scatters_beyond_noise
from .hits import Hits, HitSpectra, find_hits, hit_spectra, with_assumed_scatter, without_bounds
from .modal_fit import Resonance
from .periodic import PeriodicFrequencyResponse, PeriodicSums, Repetition
from .request import FrequencyResponseRequest, FrequencyResponseView
from .resonance import resonances, scattered_resonances
from .results import (
    Estimator,
    FrequencyResponse,
    FrequencyResponseSettings,
    converted_frequency_response,
)
from .transmissibility import FrequencyResponseSums, coherence, least_squares

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
    """Result for periodic noise, with the sources of scatter; None for other noise."""
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
    channels: Channels,
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
            f"this noise repeats every {1 / noise.repetition_hz:g} s, so segments are its periods, without "
            f"window, and lines are {noise.repetition_hz:g} Hz apart; resolution, segment, averages, "
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
            frequency_response=chosen,
            h1=estimate_by(Estimator.H1),
            h2=estimate_by(Estimator.H2),
            resonances=found,
            base_level=noise_drive_level(level.density(), **band),
            bias=_bias(chosen, estimate_by(Estimator.DRIVE), found),
            periodic=periodic,
            used_s=used / rate,
            left_out=len(stretches) - taken,
            lost_samples=bad.lost,
            overloaded_samples=bad.overloaded,
            unit="kg" if channels.is_force else "1",
        )

    return chosen, response


@dataclass
class _Unusable:
    """Counters of unusable samples."""

    lost: int = 0
    overloaded: int = 0

    def valid(self, data: Reals, overloaded: Flags) -> Flags:
        """Return flags of the usable samples, and count the unusable ones."""
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


def _usable(channels: Channels, stretch: Stretch, period_samples: float, bad: _Unusable) -> Reals | None:
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
    channels: Channels,
    noise_ratio: float | None,
) -> FrequencyResponse:
    """Estimate h1, h2 or hv from realisations; ``motion`` has the shape (realisations, 2, lines)."""
    s_xx = np.sum(np.abs(motion[:, 0]) ** 2, axis=0)
    s_yy = np.sum(np.abs(motion[:, 1]) ** 2, axis=0)
    s_xy = np.sum(np.conj(motion[:, 0]) * motion[:, 1], axis=0)
    value = least_squares(estimator, s_xx, s_yy, s_xy, noise_ratio)
    agreement = coherence(s_xx, s_yy, s_xy)
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
    channels: Channels, noise: StreamedNoise, request: FrequencyResponseRequest = DEFAULT_REQUEST
) -> NoiseResponse:
    """Estimate the transmission from all usable non-periodic noise, or from all hits of a hammer.

    Raises NotEnoughData when fewer than two segments of noise, or no hits, are left.
    """
    rate = channels.sample_rate_hz
    stretch = only_stretch(channels, SegmentLabel.NOISE)
    band = (noise.band_start_hz, noise.band_stop_hz)
    hits = find_hits(channels, stretch, band, request.segment_s)
    if hits is not None:
        return _response_to_hits(channels, hits, band, request)
    segment = request.segment_samples(stretch.samples, rate)
    if segment < round(rate / noise.band_start_hz):
        raise NotEnoughData(
            f"{stretch.samples / rate:.3g} s of noise allow segments of {segment / rate:.3g} s, but each "
            f"must contain a period of {noise.band_start_hz:g} Hz: request fewer averages, or measure "
            "longer"
        )
    sums = FrequencyResponseSums(
        rate,
        segment_samples=segment,
        window=request.window,
        overlap=request.overlap,
        estimator=Estimator.DRIVE,
        confidence=request.confidence,
    )
    level = DensitySums(rate, segment_samples=min(round(_LEVEL_SEGMENT_S * rate), segment))
    bad = _Unusable()
    for first in range(stretch.start, stretch.stop, _BLOCK):
        last = min(first + _BLOCK, stretch.stop)
        data = channels.read(first, last)
        valid = bad.valid(data, channels.overload_flags(first, last))
        if not valid.all():
            data = np.where(valid, data, 0.0)
        # The sums expect base, response and reference (the drive), in this order.
        sums.add(data[[1, 2, 0]], valid)
        level.add(data[1], valid)

    def estimate_by(estimator: Estimator) -> FrequencyResponse:
        noise_ratio = request.noise_ratio if estimator is Estimator.HV else None
        found = sums.with_estimator(estimator, noise_ratio).without_delay(channels.response_delay_s)
        inside = found.between(*band)
        return as_displacements(inside, channels).without_gain(channels.response_gain(inside.frequency_hz))

    chosen = estimate_by(request.estimator)
    found = _resonances(chosen)
    return NoiseResponse(
        frequency_response=chosen,
        h1=estimate_by(Estimator.H1),
        h2=estimate_by(Estimator.H2),
        resonances=found,
        base_level=noise_drive_level(level.density(), low_hz=band[0], high_hz=band[1]),
        bias=_bias(chosen, estimate_by(Estimator.DRIVE), found),
        periodic=None,
        used_s=stretch.samples / rate,
        left_out=chosen.segments_excluded,
        lost_samples=bad.lost,
        overloaded_samples=bad.overloaded,
        unit="kg" if channels.is_force else "1",
    )


def _response_to_hits(
    channels: Channels, hits: Hits, band_hz: tuple[float, float], request: FrequencyResponseRequest
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
    spectra = hit_spectra(data, hits, settings, band_hz[1], fades=request.window is not Window.BOXCAR)
    decay_per_s = spectra.settings.decay_per_s or 0.0

    def estimate_by(estimator: Estimator, given: HitSpectra = spectra) -> FrequencyResponse:
        noise_ratio = request.noise_ratio if estimator is Estimator.HV else None
        found = given.response(estimator, noise_ratio).without_delay(channels.response_delay_s)
        inside = found.between(*band_hz)
        # The response is known at i w + decay; conversion to displacements must use this instead of i w.
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
        frequency_response=chosen,
        h1=estimate_by(Estimator.H1),
        h2=estimate_by(Estimator.H2),
        resonances=found,
        base_level=NoiseDriveLevel(*band_hz, float(motion[0]), float(motion[1]), np.nan),
        bias=_bias(chosen, estimate_by(Estimator.DRIVE), found),
        periodic=None,
        used_s=spectra.count * size / rate,
        left_out=hits.left_out + len(hits.starts) - spectra.count,
        lost_samples=bad.lost,
        overloaded_samples=bad.overloaded,
        unit="kg" if channels.is_force else "1",
    )


def _bias(chosen: FrequencyResponse, referenced: FrequencyResponse, found: Sequence[Resonance]) -> str:
    """Return a remark if an estimate is biased; channel noise does not bias the drive-referenced one.

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


def as_displacements(frequency_response: FrequencyResponse, channels: Channels) -> FrequencyResponse:
    """Convert velocity over base acceleration to a displacement ratio; leave force over acceleration [kg]."""
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
    found = resonances(with_assumed_scatter(frequency_response), low_hz=low, high_hz=high)
    return tuple(without_bounds(each) for each in found)


_QUIET_S = 0.05
_QUIET_BLOCKS = 200


def scatter_over_silence(channels: Channels, noise: Noise, found: NoiseResponse) -> float:
    """Return the variance about the linear response, relative to silence, as the median over the lines.

    NaN for hits. Chaos scatters periods as much as realisations, so only a comparison with silence reveals
    it. Recordings start or end in silence (no drive); without silence, the ratio is too small.
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
    played = np.nanmean(powers(starts[:: -(-starts.size // _QUIET_BLOCKS)]), axis=0)
    silent = np.sum(np.mean(calm[level <= 2 * np.nanmin(level)], axis=0) / played, axis=0)
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
        """Requested quantities and scale; for a force always the apparent mass."""
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
