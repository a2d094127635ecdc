from ._distortion import (
    Distortion as Distortion,
    distortion as distortion,
    is_even_line as is_even_line,
    scatters_beyond_noise as scatters_beyond_noise,
)
from ._mode import (
    Resonance as Resonance,
)
from ._noise_response import (
    DEFAULT_REQUEST as DEFAULT_REQUEST,
    Noise as Noise,
    NoiseAnalysis as NoiseAnalysis,
    NoiseResponse as NoiseResponse,
    repeated_response as repeated_response,
    streamed_response as streamed_response,
)
from ._periodic import (
    PeriodicFrequencyResponse as PeriodicFrequencyResponse,
    PeriodicSums as PeriodicSums,
)
from ._request import (
    FrequencyResponseRequest as FrequencyResponseRequest,
    FrequencyResponseView as FrequencyResponseView,
    MagnitudeScale as MagnitudeScale,
    quantities_named as quantities_named,
)
from ._resonance import (
    resonances as resonances,
)
from ._results import (
    Estimator as Estimator,
    FrequencyResponse as FrequencyResponse,
    FrequencyResponseSettings as FrequencyResponseSettings,
    converted_frequency_response as converted_frequency_response,
)
from ._transmissibility import (
    frequency_response_of as frequency_response_of,
    transmissibility as transmissibility,
)
