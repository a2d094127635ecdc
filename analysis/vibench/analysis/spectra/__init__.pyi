from ._segment_spectra import (
    SegmentSpectra as SegmentSpectra,
    SpectralAverages as SpectralAverages,
    pieces as pieces,
)
from ._spectra import (
    AmplitudeSpectrum as AmplitudeSpectrum,
    DensitySums as DensitySums,
    SpectralDensity as SpectralDensity,
    amplitude_spectrum as amplitude_spectrum,
    spectral_density as spectral_density,
)
from ._spectrogram import (
    Spectrogram as Spectrogram,
    SpectrogramSums as SpectrogramSums,
)
