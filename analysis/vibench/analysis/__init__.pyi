from .chaos import (
    MotionVerdict as MotionVerdict,
    Points as Points,
    motion_verdict as motion_verdict,
)
from .comparison import (
    AnalysisOptions as AnalysisOptions,
    Curve as Curve,
    CurveKind as CurveKind,
    CurveOrigin as CurveOrigin,
    curve_difference as curve_difference,
    curve_peaks as curve_peaks,
    readings as readings,
)
from .errors import (
    AnalysisError as AnalysisError,
    InvalidRequest as InvalidRequest,
    NotEnoughData as NotEnoughData,
)
from .frequency_response import (
    Estimator as Estimator,
    FrequencyResponse as FrequencyResponse,
    FrequencyResponseRequest as FrequencyResponseRequest,
    MagnitudeScale as MagnitudeScale,
    Resonance as Resonance,
    quantities_named as quantities_named,
    resonances as resonances,
    transmissibility as transmissibility,
)
from .model import (
    DRAWS as DRAWS,
    FEWEST_DRAWS as FEWEST_DRAWS,
    PAPER_RESONANCES_HZ as PAPER_RESONANCES_HZ,
    PAPER_TERMINAL_RESONANCES_HZ as PAPER_TERMINAL_RESONANCES_HZ,
    SIMILARITY_THRESHOLD as SIMILARITY_THRESHOLD,
    CurveDifference as CurveDifference,
    LogarithmOf as LogarithmOf,
    MeasurementPrediction as MeasurementPrediction,
    Similarity as Similarity,
    SimilarityCurve as SimilarityCurve,
    Simulation as Simulation,
    predict_measurement as predict_measurement,
    similarity as similarity,
)
from .model_updating import (
    Parameter as Parameter,
    UpdatedSpecimen as UpdatedSpecimen,
    update_model as update_model,
)
from .recordings import (
    ProgressObserver as ProgressObserver,
)
from .results import (
    AnalysisFailure as AnalysisFailure,
    CampaignResults as CampaignResults,
    ComparedRecording as ComparedRecording,
    FailedStep as FailedStep,
    analyse as analyse,
    analyse_files as analyse_files,
    budget_sentences as budget_sentences,
    budgets_of as budgets_of,
    campaign_summary as campaign_summary,
    compare_recording as compare_recording,
    level_of_drive as level_of_drive,
    merged_results as merged_results,
    recorded_response as recorded_response,
    recordings_in as recordings_in,
    result_summary as result_summary,
    spectral_functions as spectral_functions,
)
from .signals import (
    Window as Window,
)
from .uncertainty import (
    Expected as Expected,
    expected_uncertainty as expected_uncertainty,
)
