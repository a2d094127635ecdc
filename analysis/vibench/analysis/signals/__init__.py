"""Sampled signals, whatever they are of: windows, envelopes, integration, interpolation, confidence.

Arrays are float64 of shape (samples,). Integration and differentiation work in a band of the frequency
domain; what the missing past and future disturb at the ends is counted and given with the signal.
Bounds of averaged estimates follow Bendat & Piersol, Random Data. No recording is known here.
"""

from ._arrays import (
    Complexes,
    Flags,
    Integers,
    Reals,
)
from ._confidence import (
    DEFAULT_CONFIDENCE,
    chi_square_bounds,
    coherence_significance,
    magnitude_bounds,
    phase_half_width,
    relative_sd,
    student_half_width,
)
from ._decimation import (
    Decimator,
    decimation_factor,
)
from ._envelope import (
    DEFAULT_BINS,
    Envelope,
    envelope,
)
from ._interpolation import (
    REACH,
    TRUSTED_BAND,
    interpolated,
)
from ._quantity import (
    ConvertedSignal,
    Quantity,
    converted_signal,
    derivative_factor,
)
from ._window import (
    Window,
    effective_averages,
    hop_samples,
    named_window,
    taper,
)

__all__ = [
    "DEFAULT_BINS",
    "DEFAULT_CONFIDENCE",
    "REACH",
    "TRUSTED_BAND",
    "Complexes",
    "ConvertedSignal",
    "Decimator",
    "Envelope",
    "Flags",
    "Integers",
    "Quantity",
    "Reals",
    "Window",
    "chi_square_bounds",
    "coherence_significance",
    "converted_signal",
    "decimation_factor",
    "derivative_factor",
    "effective_averages",
    "envelope",
    "hop_samples",
    "interpolated",
    "magnitude_bounds",
    "named_window",
    "phase_half_width",
    "relative_sd",
    "student_half_width",
    "taper",
]
