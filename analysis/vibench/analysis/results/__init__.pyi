from ._campaign_results import (
    AnalysisFailure as AnalysisFailure,
    CampaignResults as CampaignResults,
    FailedStep as FailedStep,
    analyse_files as analyse_files,
    merged_results as merged_results,
    overlay as overlay,
    recordings_in as recordings_in,
    result_of as result_of,
)
from ._compared_recording import (
    ComparedRecording as ComparedRecording,
    compare_recording as compare_recording,
    drive_level as drive_level,
    kept_result as kept_result,
    level_of_drive as level_of_drive,
    recorded_response as recorded_response,
)
from ._measurement_analysis import (
    UNOBSERVED as UNOBSERVED,
    analyse as analyse,
)
from ._spectral_functions import (
    spectral_functions as spectral_functions,
)
from ._summary import (
    budget_sentences as budget_sentences,
    budgets_of as budgets_of,
    campaign_summary as campaign_summary,
    result_summary as result_summary,
)
