"""Measurements and predictions laid over one another, as curves of one kind.

A curve is displacement of m0 over displacement of the base, against frequency [Hz], with its relative
standard deviation; a transmission, Response I or Response II, measured, simulated or predicted. Peaks,
readings at markers and differences of curves; how recordings are analysed for it. Nothing is drawn here.
"""

from ._options import (
    AnalysisOptions,
)
from ._recording_traces import (
    dwell_traces,
    predicted_curves,
    stepped_traces,
    sweep_traces,
    transmission_trace,
)
from ._trace import (
    CurveOrigin,
    CurveKind,
    Curve,
    sorted_curve,
    curve_difference,
)
from ._trace_peaks import readings, curve_peaks

__all__ = [
    "AnalysisOptions",
    "CurveOrigin",
    "CurveKind",
    "Curve",
    "dwell_traces",
    "predicted_curves",
    "readings",
    "sorted_curve",
    "stepped_traces",
    "sweep_traces",
    "curve_difference",
    "curve_peaks",
    "transmission_trace",
]
