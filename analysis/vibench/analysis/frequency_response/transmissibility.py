"""Transmission from noise or hammer hits: response over drive by averaged spectra, with bounds.

Hits are analysed with an exponential window of known decay.
"""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from ..errors import InvalidRequest, NotEnoughData
from ..recordings.channels import RecordedChannels, Stretch
from ..signals import (
    DEFAULT_CONFIDENCE,
    Complexes,
    Flags,
    Reals,
    Window,
    by_name,
    coherence_significance,
    relative_sd,
    student_half_width,
)
from ..spectra import SegmentSpectra, SpectralAverages, pieces
from .modal_fit import Resonance
from .results import Estimator, FrequencyResponse, FrequencyResponseSettings, require_estimator

_ENOUGH_FREEDOM = 24.0
"""Degrees of freedom at which the estimated variance of a spectral line is accurate to a third."""
_FREEDOM = 96.0
"""Degrees of freedom, summed over neighbouring lines, for estimating the noise levels."""
_FEWEST_FREEDOM = 4.0
"""If all lines together have more degrees of freedom than this, smoothing over neighbours helps."""
_ROUNDS = 40
_NOTHING = 1e-300
_FAINT = 1e-12
"""Lower limit of variances and shapes, relative to the mean of their neighbours."""


def steady_relative_sd(relative_sd: Reals, value: Complexes, power: Reals, freedom: float) -> Reals:
    """Return the standard deviation of ln(magnitude) for weighting lines in a fit.

    With two realisations, the estimate of one line can be 100 times too small, and a few lines would dominate
    a fit. Instead, noise levels are assumed smooth over neighbouring lines. y - H x has the variance
    a + b |H|^2 + c |dH|^2. Here a and b are due to sensors, c to leakage; dH is the step between lines. The
    levels are maximum likelihood estimates for chi-square distributed variances.

    Parameters
    ----------
    relative_sd
        Estimate from each line alone, shape (lines,).
    value
        Response over drive H, in units in which the sensor noise is white; shape (lines,).
    power
        Mean square of the drive on any scale, shape (lines,).
    freedom
        Degrees of freedom of each line's own variance.
    """
    # If the segments overlap almost fully, the number of independent averages may approach one.
    freedom = max(freedom, 1.0)
    lines = min(ceil(_FREEDOM / freedom), value.size)
    if freedom >= _ENOUGH_FREEDOM or lines * freedom <= _FEWEST_FREEDOM:
        return relative_sd
    gain = np.abs(value) ** 2
    with np.errstate(invalid="ignore"):
        variance = relative_sd**2 * gain * power
        steps = np.nan_to_num(np.abs(np.gradient(value)) ** 2)
    known = np.isfinite(variance)
    shapes = np.where(known, [np.ones_like(gain), gain, steps], 0.0)
    # Stretches overlap by half. Interpolate the factors of the shapes between the centres of stretches.
    last = value.size - lines
    firsts = np.append(np.arange(0, last, max(lines // 2, 1)), last)
    around = firsts[:, None] + np.arange(lines)
    sizes = _sizes(np.where(known, variance, 0.0)[around], shapes[:, around])
    places, middles = np.arange(value.size), firsts + (lines - 1) / 2
    smooth = sum(np.interp(places, middles, size) * shape for size, shape in zip(sizes, shapes, strict=True))
    # Student's t: squared deviation / variance with n degrees of freedom has the mean n / (n - 2).
    wider = lines * freedom / (lines * freedom - 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(known, np.sqrt(wider * smooth / (gain * power)), np.nan)


def _sizes(variance: Reals, shapes: Reals) -> Reals:
    """Return the non-negative factors of the shapes that fit each row of variances, shape (shapes, rows).

    Fevotte, Bertin and Durrieu 2009 (Neural Comput. 21, 793-830): each update increases the likelihood of
    chi-square distributed values.
    """
    level = np.maximum(variance.mean(axis=1), _NOTHING)[:, None]
    heights = np.maximum(shapes.mean(axis=2, keepdims=True), _NOTHING)
    variance, shapes = variance / level, shapes / heights
    sizes = np.full((*shapes.shape[:2], 1), 1 / len(shapes))
    for _ in range(_ROUNDS):
        inverse = 1 / np.maximum(np.sum(sizes * shapes, axis=0), _FAINT)
        seen = np.sum(shapes * variance * inverse**2, axis=2, keepdims=True)
        sizes = sizes * np.sqrt(seen / np.maximum(np.sum(shapes * inverse, axis=2, keepdims=True), _FAINT))
    return np.asarray(sizes * level / heights)[..., 0]


def coherence(s_xx: Reals, s_yy: Reals, s_xy: Complexes) -> Reals:
    """Return the coherence |S_xy|^2 / (S_xx S_yy); 0 for a dead channel."""
    power = s_xx * s_yy
    ratio = np.divide(np.abs(s_xy) ** 2, power, out=np.zeros_like(power), where=power > 0)
    return np.asarray(np.clip(ratio, 0.0, 1.0))


def least_squares(
    estimator: Estimator, s_xx: Reals, s_yy: Reals, s_xy: Complexes, noise_ratio: float | None
) -> Complexes:
    """Return the estimate h1, h2 or hv, as selected by ``estimator``.

    Raises InvalidRequest for the drive-referenced estimator, which needs a third channel, and for hv without
    a noise ratio.
    """
    match estimator, noise_ratio:
        case Estimator.H1, _:
            return _ratio(s_xy, s_xx.astype(np.complex128))
        case Estimator.H2, _:
            return _ratio(s_yy.astype(np.complex128), np.conj(s_xy))
        case Estimator.HV, float(ratio):
            return _hv(s_xx, s_yy, s_xy, ratio)
        case _:
            raise InvalidRequest(
                f"{estimator.value} needs a third channel; use h1, h2, or hv with a noise ratio"
            )


def _hv(s_xx: Reals, s_yy: Reals, s_xy: Complexes, noise_ratio: float) -> Complexes:
    """Return the total least squares estimate for r = S_nn / S_mm, response noise over drive noise.

    [S_yy - r S_xx + sqrt((S_yy - r S_xx)^2 + 4 r |S_xy|^2)] / (2 conj(S_xy)); r to infinity is h1, r = 0 is
    h2. r is needed because the result would otherwise depend on the units of the channels.
    """
    difference = s_yy - noise_ratio * s_xx
    root = np.sqrt(difference**2 + 4 * noise_ratio * np.abs(s_xy) ** 2)
    # If the difference is negative, the sum loses digits by cancellation; use the conjugate form.
    stable = np.divide(
        4 * noise_ratio * np.abs(s_xy) ** 2,
        root - difference,
        out=np.zeros_like(root),
        where=(root - difference) > 0,
    )
    numerator = np.where(difference > 0, difference + root, stable)
    return _ratio(numerator.astype(np.complex128), 2 * np.conj(s_xy))


def drive_referenced_relative_sd(products: Complexes, value: Complexes, n_eff: float) -> Reals:
    """Return the relative standard deviation of the drive-referenced estimate.

    Var(H) = S_vv S_rr / (n |S_rx|^2) with the residual v = y - H x (instrumental variables; Wellstead 1981,
    Automatica 17, 669-673). ln(magnitude) and phase each have half of this variance.

    Parameters
    ----------
    products
        Averaged products of x, y, r in this order, shape (3, 3, lines), any common scale.
    value
        The estimate H, shape (lines,).
    n_eff
        Independent averages.
    """
    s_xx, s_yy, s_rr = (products[i, i].real for i in range(3))
    s_xy, s_rx = products[0, 1], products[2, 0]
    magnitude2 = np.abs(value) ** 2
    residual = np.maximum(s_yy - 2 * np.real(np.conj(value) * s_xy) + magnitude2 * s_xx, 0.0)
    bottom = 2 * n_eff * magnitude2 * np.abs(s_rx) ** 2
    variance = np.divide(residual * s_rr, bottom, out=np.full_like(bottom, np.inf), where=bottom > 0)
    return np.asarray(np.sqrt(variance))


def _ratio(numerator: Complexes, denominator: Complexes) -> Complexes:
    """Return the quotient of two spectra; NaN for lines without drive."""
    missing = np.full_like(numerator, complex(np.nan, np.nan))
    return np.asarray(np.divide(numerator, denominator, out=missing, where=denominator != 0))


_LEAST_SEGMENTS = 2
_DRIVE, _RESPONSE, _REFERENCE = range(3)
_ROWS = ("drive", "response", "reference")


class FrequencyResponseSums:
    """Averages for the transmission of a record that arrives in blocks, in constant memory.

    Each block has a row for the drive, a row for the response and, for the drive-referenced estimator, a row
    for the reference.
    """

    def __init__(self, settings: FrequencyResponseSettings) -> None:
        _check(settings)
        self._settings = settings
        self._channels = 3 if settings.estimator is Estimator.DRIVE else 2
        self._spectra = SegmentSpectra(
            self._channels, settings.segment_samples, window=settings.window, overlap=settings.overlap
        )

    def add(self, block: Reals, valid: Flags | None = None) -> None:
        """Add the next samples, shape (2 or 3, samples); see `SegmentSpectra.add` for ``valid``."""
        if block.shape[0] != self._channels:
            name, needed = self._settings.estimator.value, _ROWS[: self._channels]
            raise InvalidRequest(
                f"a block has {block.shape[0]} rows; {name} takes the rows {', '.join(needed)}"
            )
        self._spectra.add(block, valid)

    def frequency_response(self) -> FrequencyResponse:
        """Return the transmission of all samples added so far.

        Raises NotEnoughData for fewer than two valid segments, whose coherence would always be 1.
        """
        return self.with_estimator(self._settings.estimator, self._settings.noise_ratio)

    def with_estimator(self, estimator: Estimator, noise_ratio: float | None = None) -> FrequencyResponse:
        """Return the transmission by another estimator; raises the same errors as `transmissibility`."""
        settings = replace(self._settings, estimator=estimator, noise_ratio=noise_ratio)
        _check(settings)
        if estimator is Estimator.DRIVE and self._channels < len(_ROWS):
            raise InvalidRequest(
                "the estimator 'drive' needs a reference channel; create the sums with this estimator"
            )
        averages = self._spectra.averages()
        if averages.segments_used < _LEAST_SEGMENTS:
            raise NotEnoughData(
                f"{averages.segments_used} segments of {averages.segment_samples} samples are valid, and "
                f"{averages.segments_excluded} contain invalid samples. A coherence needs at least "
                f"{_LEAST_SEGMENTS}: use shorter segments or a longer record"
            )
        return frequency_response_of(averages, settings)


def transmissibility(
    x: Reals,
    y: Reals,
    sample_rate_hz: float,
    *,
    segment_samples: int,
    window: Window | str = Window.HANN,
    overlap: float = 0.5,
    estimator: Estimator | str = Estimator.H1,
    reference: Reals | None = None,
    noise_ratio: float | None = None,
    valid: Flags | None = None,
    confidence: float = DEFAULT_CONFIDENCE,
) -> FrequencyResponse:
    """Estimate response y over drive x from a noise record, with bounds for every line.

    Parameters
    ----------
    x, y
        Drive and response, shape (samples,), any units.
    sample_rate_hz
        Samples per second [Hz].
    segment_samples
        Samples per segment; a resonance needs a segment several times longer than its decay time.
    window, overlap
        The window, and the overlap of segments as a fraction (scipy's ``noverlap`` is
        ``int(overlap * segment_samples)``).
    estimator
        ``"h1"``, ``"h2"``, ``"hv"`` (needs ``noise_ratio``) or ``"drive"`` (needs ``reference``).
    reference
        A noise-free record of the signal that drives both channels, such as the generator voltage.
    noise_ratio
        Noise density of y over that of x [(unit of y / unit of x)^2].
    valid
        Flags of valid samples; segments with invalid samples are left out and counted.
    confidence
        Probability that the bounds of a line contain the true value.

    Raises
    ------
    InvalidRequest
        For an unknown name, ``"hv"`` without ``noise_ratio``, or ``"drive"`` without ``reference``.
    NotEnoughData
        For fewer than two valid segments.
    UnusableData
        For samples that are not finite and not marked invalid.
    """
    signals = (x, y) if reference is None else (x, y, reference)
    sums = FrequencyResponseSums(
        FrequencyResponseSettings(
            estimator=by_name(Estimator, estimator),
            sample_rate_hz=sample_rate_hz,
            segment_samples=segment_samples,
            window=str(window),
            overlap=overlap,
            confidence=confidence,
            noise_ratio=None if noise_ratio is None else float(noise_ratio),
        )
    )
    for block, marks in pieces(signals, valid):
        sums.add(block, marks)
    return sums.frequency_response()


def _check(settings: FrequencyResponseSettings) -> None:
    require_estimator(settings.estimator, settings.noise_ratio, settings.confidence)
    if not settings.sample_rate_hz > 0:
        raise InvalidRequest(f"sample_rate_hz is {settings.sample_rate_hz:g}; it must be more than 0")


def frequency_response_of(
    averages: SpectralAverages, settings: FrequencyResponseSettings
) -> FrequencyResponse:
    """Return the transmission with bounds from averaged products of drive, response and any reference."""
    products = averages.products
    s_xx, s_yy = products[_DRIVE, _DRIVE].real, products[_RESPONSE, _RESPONSE].real
    s_xy = products[_DRIVE, _RESPONSE]
    ordinary = coherence(s_xx, s_yy, s_xy)
    power, reference_coherence = s_xx, None
    if settings.estimator is Estimator.DRIVE:
        s_rx, s_ry = products[_REFERENCE, _DRIVE], products[_REFERENCE, _RESPONSE]
        # The reference is an instrumental variable: the noise of x and y averages out.
        value = _ratio(s_ry, s_rx)
        spread = drive_referenced_relative_sd(products, value, averages.n_eff)
        s_rr = products[_REFERENCE, _REFERENCE].real
        power = np.abs(s_rx) ** 2 / np.maximum(s_rr, np.finfo(float).tiny)
        reference_coherence = np.minimum(coherence(s_rr, s_xx, s_rx), coherence(s_rr, s_yy, s_ry))
    else:
        value = least_squares(settings.estimator, s_xx, s_yy, s_xy, settings.noise_ratio)
        spread = relative_sd(ordinary, averages.n_eff)
    line_hz = settings.sample_rate_hz / averages.segment_samples
    bandwidth_lines = averages.segment_samples * averages.window_energy / averages.window_sum**2
    return FrequencyResponse(
        frequency_hz=averages.frequency_hz(settings.sample_rate_hz),
        value=value,
        coherence=ordinary,
        n_eff=averages.n_eff,
        relative_sd_magnitude=spread,
        sd_phase_rad=spread,
        half_width=student_half_width(spread, averages.n_eff, settings.confidence),
        coherence_significance=coherence_significance(averages.n_eff, settings.confidence),
        resolution_hz=bandwidth_lines * line_hz,
        segments_used=averages.segments_used,
        segments_excluded=averages.segments_excluded,
        settings=settings,
        steady_relative_sd=steady_relative_sd(spread, value, power, 2 * (averages.n_eff - 1)),
        drive_slope_per_hz=_slope(products, value, settings) / line_hz,
        reference_coherence=reference_coherence,
    )


def _slope(products: Complexes, value: Complexes, settings: FrequencyResponseSettings) -> Complexes:
    """Return the relative change per line of the density P that weights H within a line.

    P is the cross density of the drive x and the instrument: the reference, x for h1, y for h2, and
    r x + H* y for hv with the noise ratio r. P is taken relative to the density of the reference, or of x if
    there is no reference; both are assumed flat.
    """
    s_xx, s_yx = products[_DRIVE, _DRIVE], products[_RESPONSE, _DRIVE]
    level = products[-1, -1].real if len(products) > _REFERENCE else s_xx.real
    match settings.estimator:
        case Estimator.DRIVE:
            density = products[_REFERENCE, _DRIVE]
        case Estimator.H1:
            density = s_xx
        case Estimator.H2:
            density = s_yx
        case Estimator.HV:
            density = (settings.noise_ratio or 0.0) * s_xx + value * s_yx
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = density / level
        slope = np.gradient(relative) / relative
    return np.asarray(np.where(np.abs(slope) < 1, slope, 0.0))


_BLOCK = 1 << 19
_PIECE_S, _FEWEST_PIECES = 0.01, 100
"""Usual length [s] and minimum number of the pieces into which the drive is divided to compare energies."""
_SHORT, _MOST_ENERGY = 0.05, 0.9
"""The strongest 0.05 of the time contains over 0.9 of the energy of hits, but 0.06 of that of noise."""
_TRIGGER = 0.1
"""Trigger level of a hit relative to the peak of the hardest hit."""
_LEAD_PERIODS = 2.0
"""Time from the start of a segment to the trigger, in periods of the highest frequency."""
_REMAINDER = 1e-3
"""Largest rms of the windowed response in a segment's last part, relative to its strongest part."""
_PARTS = 20
"""Number of equal parts into which a segment is divided; the rms values of the parts show the decay."""
EXPONENTIAL = "exponential"
_ASSUMED_SD = 0.01
"""Scatter assumed to weight the lines of a single hit, relative to each line and to the largest line."""


@dataclass(frozen=True)
class Hits:
    """Segments of a record that each begin with a hit."""

    starts: tuple[int, ...]
    """Index of the first sample of each segment."""
    segment_samples: int
    left_out: int
    """Number of hits whose segment is cut short by the next hit or by the end of the record."""


def find_hits(
    channels: RecordedChannels, stretch: Stretch, band_hz: tuple[float, float], segment_s: float | None
) -> Hits | None:
    """Return the segments of the hits in the drive; None if the drive does not consist of hits.

    Pulses within a period of the lowest frequency count as one hit. The default segment length keeps as much
    recorded time as possible from at least two hits.

    Raises NotEnoughData when no hit has a segment of the given length.

    Parameters
    ----------
    channels, stretch
        The record, and its part to search.
    band_hz
        Lowest and highest frequency of the analysis.
    segment_s
        Length of a segment, if given.
    """
    rate, low_hz, high_hz = channels.sample_rate_hz, *band_hz
    blocks = range(stretch.start, stretch.stop, _BLOCK)
    piece = max(1, min(round(_PIECE_S * rate), stretch.samples // _FEWEST_PIECES))
    powers = [_drive(channels, first, min(first + _BLOCK, stretch.stop)) ** 2 for first in blocks]
    energies = np.concatenate([np.add.reduceat(each, np.arange(0, each.size, piece)) for each in powers])
    short = np.sort(energies)[::-1][: max(1, int(_SHORT * energies.size))]
    if not np.sum(short) > _MOST_ENERGY * np.sum(energies):
        return None
    drive = _drive(channels, stretch.start, stretch.stop)
    above = np.flatnonzero(np.abs(drive) > _TRIGGER * np.max(np.abs(drive)))
    firsts = above[np.diff(above, prepend=-drive.size) > rate / low_hz]
    starts = stretch.start + np.maximum(firsts - round(_LEAD_PERIODS * rate / high_hz), 0)
    clear = np.diff(starts, append=stretch.stop)
    segment = _longest(clear) if segment_s is None else round(segment_s * rate)
    kept = starts[clear >= segment]
    if not kept.size or segment < rate / low_hz:
        raise NotEnoughData(
            f"{starts.size} hits were found, at most {np.max(clear) / rate:.3g} s apart; a segment of "
            f"{segment / rate:.3g} s must end before the next hit and contain a period of "
            f"{low_hz:g} Hz: request another segment length, or wait longer between hits"
        )
    return Hits(tuple(int(each) for each in kept), int(segment), int(starts.size - kept.size))


def _drive(channels: RecordedChannels, start: int, stop: int) -> Reals:
    """Return the drive without its offset; lost samples are zero."""
    drive = np.nan_to_num(channels.read(start, stop)[0])
    return np.asarray(drive - np.median(drive))


def _longest(clear: Reals) -> int:
    """Return the segment length that maximises (segments - 1) * length; the longest if all products are 0."""
    kept_s = [(np.count_nonzero(clear >= each) - 1) * each for each in clear]
    return int(clear[int(np.argmax(kept_s))] if max(kept_s) > 0 else np.max(clear))


@dataclass(frozen=True, eq=False)
class HitSpectra:
    """Spectra of the hits under an exponential window, from which responses are estimated.

    The window multiplies all channels by exp(-decay t), which turns H(i w) into H(i w + decay). The decay is
    the smallest that reduces the response to a thousandth at the end of a segment; 0 with ``Window.BOXCAR``.
    """

    settings: FrequencyResponseSettings
    spectra: Complexes
    """Base, response and drive of each hit, shape (hits, 3, lines)."""
    left_out: int

    @property
    def count(self) -> int:
        """Number of hits in the spectra."""
        return len(self.spectra)

    def response(self, estimator: Estimator, noise_ratio: float | None = None) -> FrequencyResponse:
        """Estimate response over base; bounds are infinite for a single hit, whose scatter is unknown."""
        products = np.einsum("kif,kjf->ijf", np.conj(self.spectra), self.spectra) / self.count
        averages = SpectralAverages(
            products, self.count, self.left_out, max(self.count, 2.0), self.settings.segment_samples,
            Window.BOXCAR, 0.0, 1.0, 1.0,
        )  # fmt: skip
        settings = replace(self.settings, estimator=estimator, noise_ratio=noise_ratio)
        added_hz = (settings.decay_per_s or 0.0) / np.pi
        found = replace(frequency_response_of(averages, settings), resolution_hz=added_hz)
        if self.count > 1:
            return found
        unknown = np.full(found.frequency_hz.size, np.inf)
        return replace(
            found, n_eff=1.0, relative_sd_magnitude=unknown, sd_phase_rad=unknown, half_width=unknown,
            coherence_significance=1.0, steady_relative_sd=None,
        )  # fmt: skip

    def without_each(self) -> tuple["HitSpectra", ...]:
        """For each hit, return the set of spectra without that hit."""
        return tuple(
            replace(self, spectra=np.delete(self.spectra, each, axis=0)) for each in range(self.count)
        )


def hit_spectra(
    data: Reals, hits: Hits, settings: FrequencyResponseSettings, high_hz: float, *, fades: bool
) -> HitSpectra:
    """Return the spectra of the segments that begin with hits.

    Parameters
    ----------
    data
        Drive, base and response of each usable hit, shape (hits, 3, samples).
    hits
        Positions of the hits in the record.
    settings
        Settings of the response; window and decay are filled in.
    high_hz
        Highest frequency to keep.
    fades
        Whether to apply an exponential window if the response has not decayed by the end of a segment.
    """
    rate, size = settings.sample_rate_hz, hits.segment_samples
    # A free body still moves after a hit, so the velocity is known to be zero only before the hit.
    data = data - np.mean(data[..., : max(round(rate / high_hz), 1)], axis=2, keepdims=True)
    levels = np.sqrt([np.mean(part**2) for part in np.array_split(data[:, 2], _PARTS, axis=1)])
    lasting = np.log(max(levels[-1] / max(np.max(levels), _NOTHING) / _REMAINDER, 1.0)) if fades else 0.0
    decay_per_s = float(lasting) * rate / size
    lines = int(high_hz * size / rate) + 1
    windowed = data[:, [1, 2, 0]] * np.exp(-decay_per_s * np.arange(size) / rate)
    chosen = replace(
        settings, segment_samples=size, window=EXPONENTIAL if lasting else Window.BOXCAR.value, overlap=0.0,
        decay_per_s=decay_per_s,
    )  # fmt: skip
    return HitSpectra(chosen, np.fft.rfft(windowed)[..., :lines], hits.left_out)


def with_assumed_scatter(response: FrequencyResponse) -> FrequencyResponse:
    """Return a single hit's response with an assumed scatter, for a fit without bounds."""
    # Assume that all lines of the velocity have the same noise and, in addition, the same relative error.
    size = response.magnitude / response.frequency_hz
    assumed = _ASSUMED_SD * np.hypot(1.0, np.max(size) / np.maximum(size, _NOTHING))
    return replace(
        response, relative_sd_magnitude=assumed, coherence_significance=0.0, reference_coherence=None
    )


def without_bounds(found: Resonance) -> Resonance:
    """Return the resonance with infinite standard deviations."""
    return replace(
        found, sd_frequency_hz=np.inf, sd_damping_ratio=np.inf, sd_peak_magnitude=np.inf,
        reduced_chi_square=np.nan, overlap=1.0,
    )  # fmt: skip
