from ._difference import (
    CurveDifference as CurveDifference,
    logarithmic_difference as logarithmic_difference,
)
from ._measurement_prediction import (
    MeasurementPrediction as MeasurementPrediction,
    predict_measurement as predict_measurement,
)
from ._overlay import (
    AbstractOverlay as AbstractOverlay,
    DwellOverlay as DwellOverlay,
    NoiseOverlay as NoiseOverlay,
    SimulatedRun as SimulatedRun,
    Simulation as Simulation,
    SteppedSineOverlay as SteppedSineOverlay,
    SweepOverlay as SweepOverlay,
    dwell_overlay as dwell_overlay,
    noise_overlay as noise_overlay,
    stepped_overlay as stepped_overlay,
    sweep_overlay as sweep_overlay,
)
from ._prediction import (
    PAPER_RESONANCES_HZ as PAPER_RESONANCES_HZ,
    PAPER_TERMINAL_RESONANCES_HZ as PAPER_TERMINAL_RESONANCES_HZ,
    PREDICTION_S as PREDICTION_S,
    WINDOW_S as WINDOW_S,
    ResponsePrediction as ResponsePrediction,
    linear_transmissibility as linear_transmissibility,
    paper_amplitude_m as paper_amplitude_m,
    predicted as predicted,
)
from ._similarity import (
    SIMILARITY_THRESHOLD as SIMILARITY_THRESHOLD,
    LogarithmOf as LogarithmOf,
    Similarity as Similarity,
    SimilarityCurve as SimilarityCurve,
    similarity as similarity,
)
from ._simulated_channels import (
    SimulatedChannels as SimulatedChannels,
    SimulatedSpecimen as SimulatedSpecimen,
    played_impacts as played_impacts,
    recorded_base_motion as recorded_base_motion,
    simulated_specimen as simulated_specimen,
)
