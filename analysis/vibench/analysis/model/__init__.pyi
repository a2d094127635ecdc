from ._difference import (
    CurveDifference as CurveDifference,
    logarithmic_difference as logarithmic_difference,
)
from ._draws import (
    CLOCK_TOLERANCE as CLOCK_TOLERANCE,
    DRAWS as DRAWS,
    Draw as Draw,
    Drawn as Drawn,
    DrawSource as DrawSource,
    SimulatedRun as SimulatedRun,
    StretchDraws as StretchDraws,
    base_source as base_source,
    drawn as drawn,
    stretch_draws as stretch_draws,
    voltage_source as voltage_source,
)
from ._driven_rig import (
    Driven as Driven,
    described_shaker as described_shaker,
    says_shaker as says_shaker,
)
from ._ensemble import (
    FEWEST_DRAWS as FEWEST_DRAWS,
    EnsembleCurve as EnsembleCurve,
    Quantity as Quantity,
    z_limit as z_limit,
)
from ._escape import (
    Ending as Ending,
    EscapeRate as EscapeRate,
    escape_rate as escape_rate,
)
from ._measurement_prediction import (
    MeasurementPrediction as MeasurementPrediction,
    predict_measurement as predict_measurement,
)
from ._overlay import (
    RESPONSE_I as RESPONSE_I,
    RESPONSE_II as RESPONSE_II,
    SPECTRUM as SPECTRUM,
    TRANSMISSION as TRANSMISSION,
    AbstractOverlay as AbstractOverlay,
    DwellOverlay as DwellOverlay,
    NoiseOverlay as NoiseOverlay,
    Simulation as Simulation,
    SteppedSineOverlay as SteppedSineOverlay,
    SweepOverlay as SweepOverlay,
    dwell_overlay as dwell_overlay,
    dwell_quantities as dwell_quantities,
    noise_overlay as noise_overlay,
    noise_quantities as noise_quantities,
    stepped_overlay as stepped_overlay,
    stepped_quantities as stepped_quantities,
    sweep_endings as sweep_endings,
    sweep_overlay as sweep_overlay,
    sweep_quantities as sweep_quantities,
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
from ._shaker_fit import (
    FittedShaker as FittedShaker,
    fitted_shaker as fitted_shaker,
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
    recorded_base_motion as recorded_base_motion,
)
