"""Measurements and predictions laid over one another, as curves of one kind.

A curve is displacement of m0 over displacement of the base, against frequency [Hz], with its relative
standard deviation; a transmission, Response I or Response II, measured, simulated or predicted. Peaks,
readings at markers and differences of curves; how recordings are analysed for it. Nothing is drawn here.
"""

from ._curve import Curve, CurveKind, CurveOrigin, curve_difference, sorted_curve
from ._curve_peaks import curve_peaks, readings
from ._options import (
    AnalysisOptions,
)
from ._recording_curves import (
    dwell_traces,
    predicted_curves,
    stepped_traces,
    sweep_traces,
    transmission_trace,
)

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
