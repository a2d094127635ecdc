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
    Curve,
    CurveKind,
    CurveOrigin,
    curve_difference,
    sorted_curve,
)
from ._trace_peaks import curve_peaks, readings

__all__ = [
    "AnalysisOptions",
    "Curve",
    "CurveKind",
    "CurveOrigin",
    "curve_difference",
    "curve_peaks",
    "dwell_traces",
    "predicted_curves",
    "readings",
    "sorted_curve",
    "stepped_traces",
    "sweep_traces",
    "transmission_trace",
]
