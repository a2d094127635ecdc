"""Transmission from noise records: response over drive by averaged spectra, with bounds."""

from dataclasses import replace

import numpy as np

from ..errors import InvalidRequest, NotEnoughData
from ..signals.arrays import Complexes, Flags, Reals
from ..signals.confidence import DEFAULT_CONFIDENCE, coherence_significance, relative_sd, student_half_width
from ..signals.window import Window
from ..spectra.segment_spectra import SegmentSpectra, SpectralAverages, pieces
from .estimators import (
    coherence,
    drive_referenced,
    drive_referenced_relative_sd,
    least_squares,
    named_estimator,
)
from .results import Estimator, FrequencyResponse, FrequencyResponseSettings
from .steady import steady_relative_sd

_LEAST_SEGMENTS = 2
_DRIVE, _RESPONSE, _REFERENCE = range(3)
_ROWS = ("drive", "response", "reference")


class FrequencyResponseSums:
    """Takes a long record block by block and gives its transmission at any moment.

    Memory does not grow with the record. Blocks have the rows drive, response and, for the
    drive-referenced estimator, reference.
    """

    def __init__(
        self,
        sample_rate_hz: float,
        *,
        segment_samples: int,
        window: Window | str = Window.HANN,
        overlap: float = 0.5,
        estimator: Estimator | str = Estimator.H1,
        noise_ratio: float | None = None,
        confidence: float = DEFAULT_CONFIDENCE,
    ) -> None:
        self._settings = FrequencyResponseSettings(
            estimator=named_estimator(estimator),
            sample_rate_hz=sample_rate_hz,
            segment_samples=segment_samples,
            window=str(window),
            overlap=overlap,
            confidence=confidence,
            noise_ratio=None if noise_ratio is None else float(noise_ratio),
        )
        _check(self._settings)
        self._channels = 3 if self._settings.estimator is Estimator.DRIVE else 2
        self._spectra = SegmentSpectra(self._channels, segment_samples, window=window, overlap=overlap)

    def add(self, block: Reals, valid: Flags | None = None) -> None:
        """Take the next samples, shape (2 or 3, samples); see `SegmentSpectra.add` for ``valid``."""
        if block.shape[0] != self._channels:
            name, needed = self._settings.estimator.value, _ROWS[: self._channels]
            raise InvalidRequest(
                f"a block has {block.shape[0]} rows; {name} takes the rows {', '.join(needed)}"
            )
        self._spectra.add(block, valid)

    def frequency_response(self) -> FrequencyResponse:
        """Give the transmission of everything added so far.

        Raises NotEnoughData when fewer than two valid segments were found: their coherence would be 1
        whatever they hold.
        """
        return self.by(self._settings.estimator, self._settings.noise_ratio)

    def by(self, estimator: Estimator, noise_ratio: float | None = None) -> FrequencyResponse:
        """Give what another estimator makes of the same averages; errors as `transmissibility` has them."""
        settings = replace(self._settings, estimator=estimator, noise_ratio=noise_ratio)
        _check(settings)
        if estimator is Estimator.DRIVE and self._channels < len(_ROWS):
            raise InvalidRequest("drive was asked for of sums without a reference; begin them for drive")
        averages = self._spectra.averages()
        if averages.segments_used < _LEAST_SEGMENTS:
            raise NotEnoughData(
                f"{averages.segments_used} valid segment of {averages.segment_samples} samples was found, "
                f"{averages.segments_excluded} touched invalid samples; a coherence needs at least "
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
    """Estimate response y over drive x from a noise record, with bounds on every line.

    Parameters
    ----------
    x, y
        Drive and response, shape (samples,), any units.
    sample_rate_hz
        Samples per second [Hz].
    segment_samples
        Samples per segment; a resonance needs a segment several times longer than its ring time.
    window, overlap
        The taper, and the fraction by which neighbouring segments overlap (scipy's ``noverlap`` is
        ``int(overlap * segment_samples)``).
    estimator
        ``"h1"``, ``"h2"``, ``"hv"`` (needs ``noise_ratio``) or ``"drive"`` (needs ``reference``).
    reference
        A clean record of what drives both, such as the generator's voltage.
    noise_ratio
        Noise density of y over that of x [(unit of y / unit of x)^2].
    valid
        Which samples may be used; segments that touch others are left out and counted.
    confidence
        Probability that a pair of bounds holds the truth, one line at a time.

    Raises
    ------
    InvalidRequest
        For an unknown name, hv without its noise ratio, or drive without its reference.
    NotEnoughData
        For fewer than two valid segments.
    UnusableData
        For samples that are not finite and not marked invalid.

    """
    signals = (x, y) if reference is None else (x, y, reference)
    sums = FrequencyResponseSums(
        sample_rate_hz,
        segment_samples=segment_samples,
        window=window,
        overlap=overlap,
        estimator=estimator,
        noise_ratio=noise_ratio,
        confidence=confidence,
    )
    for block, marks in pieces(signals, valid):
        sums.add(block, marks)
    return sums.frequency_response()


def _check(settings: FrequencyResponseSettings) -> None:
    ratio = settings.noise_ratio
    if settings.estimator is Estimator.HV:
        if ratio is None:
            raise InvalidRequest(
                "hv was asked for without a noise ratio; give noise_ratio = noise density of the response "
                "over that of the drive, or use the drive-referenced estimator"
            )
        if not (ratio >= 0 and np.isfinite(ratio)):
            raise InvalidRequest(f"noise_ratio is {ratio:g}; it is a finite number, zero or more")
    elif ratio is not None:
        raise InvalidRequest(f"noise_ratio has no meaning for {settings.estimator.value}; only hv uses it")
    if not 0 < settings.confidence < 1:
        raise InvalidRequest(f"confidence is {settings.confidence:g}; it lies between 0 and 1")
    if not settings.sample_rate_hz > 0:
        raise InvalidRequest(f"sample_rate_hz is {settings.sample_rate_hz:g}; it is more than 0")


def frequency_response_of(
    averages: SpectralAverages, settings: FrequencyResponseSettings
) -> FrequencyResponse:
    """Form the transmission of averaged products, rows drive, response and perhaps reference, with bounds."""
    products = averages.products
    s_xx, s_yy = products[_DRIVE, _DRIVE].real, products[_RESPONSE, _RESPONSE].real
    s_xy = products[_DRIVE, _RESPONSE]
    ordinary = coherence(s_xx, s_yy, s_xy)
    value = _value(products, settings)
    spread = relative_sd(ordinary, averages.n_eff)
    power, reference_coherence = s_xx, None
    if settings.estimator is Estimator.DRIVE:
        spread = drive_referenced_relative_sd(products, value, averages.n_eff)
        s_rr = products[_REFERENCE, _REFERENCE].real
        power = np.abs(products[_REFERENCE, _DRIVE]) ** 2 / np.maximum(s_rr, np.finfo(float).tiny)
        reference_coherence = np.minimum(
            coherence(s_rr, s_xx, products[_REFERENCE, _DRIVE]),
            coherence(s_rr, s_yy, products[_REFERENCE, _RESPONSE]),
        )
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


def _value(products: Complexes, settings: FrequencyResponseSettings) -> Complexes:
    if settings.estimator is Estimator.DRIVE:
        return drive_referenced(products[_REFERENCE, _DRIVE], products[_REFERENCE, _RESPONSE])
    s_xx, s_yy = products[_DRIVE, _DRIVE].real, products[_RESPONSE, _RESPONSE].real
    return least_squares(settings.estimator, s_xx, s_yy, products[_DRIVE, _RESPONSE], settings.noise_ratio)


def _slope(products: Complexes, value: Complexes, settings: FrequencyResponseSettings) -> Complexes:
    """Give the relative change from line to line of the density P that value = (H P) / P is averaged with.

    The estimator weights lines by the drive and by its instrument: the reference, x for h1, y for h2, and
    r x + H* y for hv with the noise ratio r. The instrument is compared with the reference, or with x where
    there is none; both are assumed level.
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
