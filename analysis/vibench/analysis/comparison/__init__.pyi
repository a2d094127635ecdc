from ._curve import (
    Curve as Curve,
    CurveKind as CurveKind,
    CurveOrigin as CurveOrigin,
    curve_difference as curve_difference,
    sorted_curve as sorted_curve,
)
from ._curve_peaks import (
    curve_peaks as curve_peaks,
    readings as readings,
)
from ._options import (
    AnalysisOptions as AnalysisOptions,
)
from ._recording_curves import (
    dwell_traces as dwell_traces,
    noise_traces as noise_traces,
    predicted_curves as predicted_curves,
    stepped_traces as stepped_traces,
    sweep_traces as sweep_traces,
)
