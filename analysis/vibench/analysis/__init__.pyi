from .chaos import (
    MotionVerdict as MotionVerdict,
    motion_verdict as motion_verdict,
)
from .comparison import (
    AnalysisOptions as AnalysisOptions,
    Origin as Origin,
    Response as Response,
    Trace as Trace,
    readings as readings,
    trace_difference as trace_difference,
    trace_peaks as trace_peaks,
)
from .errors import (
    AnalysisError as AnalysisError,
    InvalidRequest as InvalidRequest,
    NotEnoughData as NotEnoughData,
)
from .frequency_response import (
    Estimator as Estimator,
    MagnitudeScale as MagnitudeScale,
    NoiseRequest as NoiseRequest,
    Resonance as Resonance,
    Transmission as Transmission,
    quantities_named as quantities_named,
    resonances as resonances,
    transmission as transmission,
)
from .model import (
    THRESHOLD as THRESHOLD,
    Difference as Difference,
    Foresight as Foresight,
    Simulation as Simulation,
    foresee as foresee,
    similarity as similarity,
)
from .model_updating import (
    ShakenSpecimen as ShakenSpecimen,
    shaken_specimen as shaken_specimen,
)
from .recordings import (
    Watcher as Watcher,
)
from .results import (
    CampaignResults as CampaignResults,
    ComparedRecording as ComparedRecording,
    Failure as Failure,
    analyse_files as analyse_files,
    analyse_recording as analyse_recording,
    assembled as assembled,
    campaign_summary as campaign_summary,
    compared_recording as compared_recording,
    recordings_in as recordings_in,
    summary as summary,
)
from .signals import (
    Window as Window,
)
