"""The model beside the measurement: predicted responses to sines, and the same test simulated.

The specimen is simulated under the base motion that was recorded and goes through the estimators of the
measurement; the difference is in dB, and in standard errors of both. A plan's responses and collisions
are predicted before it is played. Similarity of two curves: eqs. 6 and 7 of Gong et al. 2025, whose
logarithm is a named option. Nothing is fitted here.
"""

from ._difference import (
    CurveDifference,
    logarithmic_difference,
)
from ._measurement_prediction import MeasurementPrediction, predict_measurement
from ._overlay import (
    DwellOverlay,
    NoiseOverlay,
    SimulatedRun,
    Simulation,
    SteppedSineOverlay,
    SweepOverlay,
    dwell_overlay,
    noise_overlay,
    stepped_overlay,
    sweep_overlay,
)
from ._prediction import (
    PAPER_RESONANCES_HZ,
    PAPER_TERMINAL_RESONANCES_HZ,
    PREDICTION_S,
    WINDOW_S,
    ResponsePrediction,
    linear_transmissibility,
    paper_amplitude_m,
    predicted,
)
from ._similarity import (
    SIMILARITY_THRESHOLD,
    LogarithmOf,
    Similarity,
    SimilarityCurve,
    similarity,
)
from ._simulated_channels import SimulatedChannels, SimulatedSpecimen, played_impacts, simulated_specimen

__all__ = [
    "PAPER_RESONANCES_HZ",
    "PAPER_TERMINAL_RESONANCES_HZ",
    "PREDICTION_S",
    "SIMILARITY_THRESHOLD",
    "WINDOW_S",
    "CurveDifference",
    "DwellOverlay",
    "LogarithmOf",
    "MeasurementPrediction",
    "NoiseOverlay",
    "ResponsePrediction",
    "Similarity",
    "SimilarityCurve",
    "SimulatedChannels",
    "SimulatedRun",
    "SimulatedSpecimen",
    "Simulation",
    "SteppedSineOverlay",
    "SweepOverlay",
    "dwell_overlay",
    "linear_transmissibility",
    "logarithmic_difference",
    "noise_overlay",
    "paper_amplitude_m",
    "played_impacts",
    "predict_measurement",
    "predicted",
    "similarity",
    "simulated_specimen",
    "stepped_overlay",
    "sweep_overlay",
]
