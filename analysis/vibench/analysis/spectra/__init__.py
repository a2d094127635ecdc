"""Spectra of long signals: densities with confidence bounds, amplitude spectra, spectrograms.

Records arrive block by block, and memory does not grow with them. Segments that touch lost samples
are left out and counted. An amplitude spectrum reads a sine as its amplitude.
"""

from ._segment_spectra import (
    SegmentSpectra,
    SpectralAverages,
    pieces,
)
from ._spectra import (
    AmplitudeSpectrum,
    DensitySums,
    SpectralDensity,
    amplitude_spectrum,
    spectral_density,
)
from ._spectrogram import (
    Spectrogram,
    SpectrogramSums,
)

__all__ = [
    "AmplitudeSpectrum",
    "DensitySums",
    "SegmentSpectra",
    "SpectralAverages",
    "SpectralDensity",
    "Spectrogram",
    "SpectrogramSums",
    "amplitude_spectrum",
    "pieces",
    "spectral_density",
]
