from .chaos.verdict import MotionVerdict as MotionVerdict, Points as Points, motion_verdict as motion_verdict
from .comparison import (
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
from .fit.lines import Parameter as Parameter
from .fit.updated_specimen import UpdatedSpecimen as UpdatedSpecimen, update_model as update_model
from .frequency_response.modal_fit import Resonance as Resonance
from .frequency_response.resonance import resonances as resonances
from .frequency_response.results import (
    Estimator as Estimator,
    FrequencyResponse as FrequencyResponse,
    FrequencyResponseRequest as FrequencyResponseRequest,
    MagnitudeScale as MagnitudeScale,
    parse_view as parse_view,
)
from .frequency_response.transmissibility import transmissibility as transmissibility
from .overlay.draws import DRAWS as DRAWS, MOST_DRAWS as MOST_DRAWS
from .overlay.ensemble import FEWEST_DRAWS as FEWEST_DRAWS, CurveDifference as CurveDifference
from .overlay.overlay import (
    PAPER_RESONANCES_HZ as PAPER_RESONANCES_HZ,
    PAPER_TERMINAL_RESONANCES_HZ as PAPER_TERMINAL_RESONANCES_HZ,
    MeasurementPrediction as MeasurementPrediction,
    Simulation as Simulation,
    predict_measurement as predict_measurement,
)
from .overlay.similarity import (
    SIMILARITY_THRESHOLD as SIMILARITY_THRESHOLD,
    LogarithmOf as LogarithmOf,
    Similarity as Similarity,
    SimilarityCurve as SimilarityCurve,
    similarity as similarity,
)
from .results.campaign_results import (
    AnalysisFailure as AnalysisFailure,
    AnalysisOptions as AnalysisOptions,
    CampaignResults as CampaignResults,
    FailedStep as FailedStep,
    analyse as analyse,
    analyse_files as analyse_files,
    budget_sentences as budget_sentences,
    budgets_of as budgets_of,
    campaign_summary as campaign_summary,
    merge_results as merge_results,
    other_responses as other_responses,
    recordings_in as recordings_in,
    result_summary as result_summary,
)
from .results.compared_recording import (
    ComparedRecording as ComparedRecording,
    compare_recording as compare_recording,
    level_of_drive as level_of_drive,
    recorded_response as recorded_response,
    recorded_specimen as recorded_specimen,
)
from .results.spectral_functions import scan_files as scan_files, spectral_functions as spectral_functions
from .signals import Window as Window
from .uncertainty.expected import (
    ExpectedResult as ExpectedResult,
    TimeShare as TimeShare,
    expected_recorded_s as expected_recorded_s,
    expected_uncertainty as expected_uncertainty,
    fit_to as fit_to,
    recorded_s as recorded_s,
)
