from ._analyses import (
    ANALYSES as ANALYSES,
)
from ._analysis_kind import (
    AnalysisKind as AnalysisKind,
    AnyResult as AnyResult,
    DwellResult as DwellResult,
    Json as Json,
    NoiseResult as NoiseResult,
    Result as Result,
    SteppedSineResult as SteppedSineResult,
    SweepResult as SweepResult,
)
from ._noise import (
    NOISE_FAMILY as NOISE_FAMILY,
)
