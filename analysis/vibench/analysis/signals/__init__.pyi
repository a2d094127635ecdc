from ._arrays import (
    Complexes as Complexes,
    Flags as Flags,
    Integers as Integers,
    Reals as Reals,
    Samples as Samples,
)
from ._confidence import (
    DEFAULT_CONFIDENCE as DEFAULT_CONFIDENCE,
    chi_square_bounds as chi_square_bounds,
    chi_square_limit as chi_square_limit,
    chi_square_of as chi_square_of,
    coherence_significance as coherence_significance,
    magnitude_bounds as magnitude_bounds,
    phase_half_width as phase_half_width,
    relative_sd as relative_sd,
    standard_uncertainty as standard_uncertainty,
    student_half_width as student_half_width,
)
from ._decimation import (
    Decimator as Decimator,
    decimation_factor as decimation_factor,
)
from ._envelope import (
    DEFAULT_BINS as DEFAULT_BINS,
    Envelope as Envelope,
    envelope as envelope,
)
from ._interpolation import (
    REACH as REACH,
    TRUSTED_BAND as TRUSTED_BAND,
    interpolated as interpolated,
)
from ._quantity import (
    ConvertedSignal as ConvertedSignal,
    Quantity as Quantity,
    converted_signal as converted_signal,
    derivative_factor as derivative_factor,
    disturbed_samples as disturbed_samples,
)
from ._window import (
    Window as Window,
    cosine_weights as cosine_weights,
    effective_averages as effective_averages,
    hop_samples as hop_samples,
    line_correlation as line_correlation,
    named_window as named_window,
    taper as taper,
)
