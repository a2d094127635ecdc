"""Recordings and campaigns analysed, each by the excitation that its plan names.

A recording becomes a noise, sweep, dwell or stepped-sine result, with the model laid over it or not; one
that cannot be analysed says why and stops no other. A result is also one JSON document, every number
with its unit in its name and its uncertainty beside it, and the curves of a comparison.
"""

from ._campaign_results import (
    AnalysisFailure,
    CampaignResults,
    DwellResult,
    NoiseResult,
    Overlay,
    Result,
    SteppedSineResult,
    SweepResult,
    analyse_files,
    merged_results,
    overlay,
    recordings_in,
    result_of,
)
from ._compared_recording import (
    ComparedRecording,
    compare_recording,
    kept_result,
)
from ._measurement_analysis import (
    UNOBSERVED,
    RecordingAnalysis,
    analyse_recording,
)
from ._summary import (
    campaign_summary,
    result_summary,
)

__all__ = [
    "UNOBSERVED",
    "AnalysisFailure",
    "CampaignResults",
    "ComparedRecording",
    "DwellResult",
    "NoiseResult",
    "Overlay",
    "RecordingAnalysis",
    "Result",
    "SteppedSineResult",
    "SweepResult",
    "analyse_files",
    "analyse_recording",
    "campaign_summary",
    "compare_recording",
    "kept_result",
    "merged_results",
    "overlay",
    "recordings_in",
    "result_of",
    "result_summary",
]
