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
    predicted_traces,
    stepped_traces,
    sweep_traces,
    transmission_trace,
)
from ._trace import (
    Origin,
    Response,
    Trace,
    sorted_trace,
    trace_difference,
)
from ._trace_peaks import readings, trace_peaks

__all__ = [
    "AnalysisOptions",
    "Origin",
    "Response",
    "Trace",
    "dwell_traces",
    "predicted_traces",
    "readings",
    "sorted_trace",
    "stepped_traces",
    "sweep_traces",
    "trace_difference",
    "trace_peaks",
    "transmission_trace",
]
