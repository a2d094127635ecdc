"""Spectral densities with confidence bounds, and amplitude spectra that read a sine as its amplitude."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy import fft

from ..errors import InvalidRequest
from ..signals.arrays import Complexes, Flags, Reals
from ..signals.confidence import DEFAULT_CONFIDENCE, chi_square_bounds
from ..signals.quantity import Quantity, derivative_factor
from ..signals.window import Window, named_window, taper
from ..tables import Labelled
from .segment_spectra import SegmentSpectra, pieces


@dataclass(frozen=True)
class SpectralDensity(Labelled):
    """One-sided spectral density with bounds; arrays of shape (lines,)."""

    OWN_UNITS: ClassVar = {
        "density": "({unit})2 Hz-1",
        "lower": "({unit})2 Hz-1",
        "upper": "({unit})2 Hz-1",
        "amplitude_density": "{unit} Hz-0.5",
    }

    frequency_hz: Reals
    density: Reals
    """[unit^2 / Hz]."""
    lower: Reals
    upper: Reals
    """Bounds that hold the truth with probability ``confidence``, one line at a time."""
    n_eff: float
    """Independent averages, corrected for overlap and gaps."""
    noise_bandwidth_hz: float
    """Density times this is the power a line shows of a sine on it."""
    segments_used: int
    segments_excluded: int
    sample_rate_hz: float
    segment_samples: int
    window: Window
    overlap: float
    confidence: float

    @property
    def amplitude_density(self) -> Reals:
        """Square root of the density [unit / sqrt(Hz)]."""
        return np.sqrt(self.density)

    def rms(self, low_hz: float, high_hz: float) -> float:
        """Root mean square of the signal between two frequencies."""
        kept = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        return float(np.sqrt(np.sum(self.density[kept]) * self.sample_rate_hz / self.segment_samples))


class DensitySums:
    """Takes a long signal block by block and gives its spectral density at any moment."""

    def __init__(self, sample_rate_hz: float, *, segment_samples: int, overlap: float = 0.5) -> None:
        self._sample_rate_hz = sample_rate_hz
        self._spectra = SegmentSpectra(1, segment_samples, overlap=overlap)

    def add(self, samples: Reals, valid: Flags | None = None) -> None:
        """Take the next samples, shape (samples,)."""
        self._spectra.add(samples[np.newaxis], valid)

    def density(self) -> SpectralDensity:
        """Give the spectral density of everything added so far."""
        averages = self._spectra.averages()
        density = averages.density(0, 0, self._sample_rate_hz).real
        lower, upper = chi_square_bounds(density, averages.n_eff, DEFAULT_CONFIDENCE)
        return SpectralDensity(
            frequency_hz=averages.frequency_hz(self._sample_rate_hz),
            density=density,
            lower=lower,
            upper=upper,
            n_eff=averages.n_eff,
            noise_bandwidth_hz=self._sample_rate_hz * averages.window_energy / averages.window_sum**2,
            segments_used=averages.segments_used,
            segments_excluded=averages.segments_excluded,
            sample_rate_hz=self._sample_rate_hz,
            segment_samples=averages.segment_samples,
            window=averages.window,
            overlap=averages.overlap,
            confidence=DEFAULT_CONFIDENCE,
        )


def spectral_density(
    samples: Reals, sample_rate_hz: float, *, segment_samples: int, overlap: float = 0.5
) -> SpectralDensity:
    """Estimate the spectral density of a signal by Welch's method, with chi-square bounds.

    Equal to ``scipy.signal.welch(..., detrend=False)`` for equal settings; see `transmissibility` for the
    parameters and errors.
    """
    sums = DensitySums(sample_rate_hz, segment_samples=segment_samples, overlap=overlap)
    for block, _ in pieces((samples,), None):
        sums.add(block[0])
    return sums.density()


@dataclass(frozen=True)
class AmplitudeSpectrum(Labelled):
    """Spectrum of one stretch of signal, scaled so that a sine of amplitude 1 reads 1."""

    OWN_UNITS: ClassVar = {"value": "{unit}", "amplitude": "{unit}"}

    frequency_hz: Reals
    value: Complexes
    """Complex amplitude (peak), phase at the first sample [unit]; shape (lines,)."""
    noise_bandwidth_hz: float
    sample_rate_hz: float
    samples: int
    window: Window

    @property
    def amplitude(self) -> Reals:
        """|value|, peak [unit]."""
        return np.abs(self.value)

    @property
    def spacing_hz(self) -> float:
        """Distance of the lines [Hz]."""
        return self.sample_rate_hz / self.samples

    def converted(self, given: Quantity, wanted: Quantity) -> "AmplitudeSpectrum":
        """Express in another quantity: velocity / (i w) is displacement. NaN at 0 Hz for integrals."""
        return replace(self, value=self.value * derivative_factor(self.frequency_hz, given, wanted))


def amplitude_spectrum(
    samples: Reals, sample_rate_hz: float, *, window: Window | str = Window.HANN
) -> AmplitudeSpectrum:
    """Spectrum of a signal in amplitudes of sines.

    Parameters
    ----------
    samples
        Shape (samples,); the mean is removed, so that an offset does not hide the lowest lines.
    window
        Hann by default; between lines it reads up to 15 % low, where flat top stays within 0.1 %.

    """
    count = samples.size
    if count < 2:
        raise InvalidRequest(f"a spectrum of {count} samples was asked for; it needs at least 2")
    chosen = named_window(window)
    values = taper(chosen, count)
    spectrum = fft.rfft((samples - np.mean(samples)) * values)
    scale = np.full(spectrum.size, 2 / np.sum(values))
    scale[0] /= 2
    if count % 2 == 0:
        scale[-1] /= 2
    return AmplitudeSpectrum(
        frequency_hz=np.asarray(fft.rfftfreq(count, 1 / sample_rate_hz)),
        value=np.asarray(spectrum * scale),
        noise_bandwidth_hz=sample_rate_hz * float(values @ values) / float(np.sum(values)) ** 2,
        sample_rate_hz=sample_rate_hz,
        samples=count,
        window=chosen,
    )
