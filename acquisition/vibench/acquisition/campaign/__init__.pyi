from ._catalogue import (
    UNREADABLE as UNREADABLE,
    CatalogueEntry as CatalogueEntry,
    Refresh as Refresh,
    VerifiedRecording as VerifiedRecording,
    list_recordings as list_recordings,
    verify_recordings as verify_recordings,
)
from ._journal import (
    AfterFailure as AfterFailure,
    CampaignProgress as CampaignProgress,
    ChangedBench as ChangedBench,
    ExistingRecordings as ExistingRecordings,
    JournalPointState as JournalPointState,
    PointOutcome as PointOutcome,
    PointResult as PointResult,
    ReasonCode as ReasonCode,
    ignore_result as ignore_result,
    read_journal as read_journal,
)
from ._log import (
    CampaignEvent as CampaignEvent,
    CampaignEventKind as CampaignEventKind,
    CampaignListener as CampaignListener,
    CommandMessenger as CommandMessenger,
    MailMessenger as MailMessenger,
    MailSettings as MailSettings,
    Messenger as Messenger,
    ignore_event as ignore_event,
)
from ._opening import (
    make_folder as make_folder,
    planned_recordings as planned_recordings,
    require_all_within_limits as require_all_within_limits,
)
from ._run_campaign import (
    CampaignEstimate as CampaignEstimate,
    ReconnectingBench as ReconnectingBench,
    estimate_campaign as estimate_campaign,
    run_campaign as run_campaign,
)
