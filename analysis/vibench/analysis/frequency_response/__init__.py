"""Response over drive against frequency, from noise and multisines, with bounds on every line.

Estimators h1, h2, hv and drive-referenced from averaged spectra; for periodic noise the best linear
approximation, which tells noise from nonlinear distortion (Pintelon & Schoukens, System Identification,
2nd ed., section 4.3). Resonances are fitted with frequency, damping and their uncertainties.
Displacement over displacement unless a view says otherwise. No sweep, dwell or model is known here.
"""

from ._distortion import (
    Distortion,
    distortion,
    is_even_line,
)
from ._noise_response import (
    DEFAULT_REQUEST,
    Noise,
    NoiseAnalysis,
    NoiseResponse,
    noise_response,
)
from ._periodic import PeriodicFrequencyResponse
from ._request import FrequencyResponseRequest, MagnitudeScale, quantities_named
from ._resonance import (
    Resonance,
    resonances,
)
from ._results import (
    Estimator,
    FrequencyResponse,
    FrequencyResponseSettings,
    converted_frequency_response,
)
from ._transmissibility import frequency_response_of, transmissibility

__all__ = [
    "DEFAULT_REQUEST",
    "Distortion",
    "Estimator",
    "FrequencyResponse",
    "FrequencyResponseRequest",
    "FrequencyResponseSettings",
    "MagnitudeScale",
    "Noise",
    "NoiseAnalysis",
    "NoiseResponse",
    "PeriodicFrequencyResponse",
    "Resonance",
    "converted_frequency_response",
    "distortion",
    "frequency_response_of",
    "is_even_line",
    "noise_response",
    "quantities_named",
    "resonances",
    "transmissibility",
]
