from ._catalogue import (
    UNREADABLE as UNREADABLE,
    CatalogueEntry as CatalogueEntry,
    Refresh as Refresh,
    list_recordings as list_recordings,
)
from ._estimate import (
    CampaignEstimate as CampaignEstimate,
    estimate_campaign as estimate_campaign,
)
from ._journal import (
    JournalPointState as JournalPointState,
    read_journal as read_journal,
)
from ._log import (
    CampaignEvent as CampaignEvent,
    CampaignEventKind as CampaignEventKind,
    CampaignListener as CampaignListener,
    ignore_event as ignore_event,
)
from ._notice import (
    CommandMessenger as CommandMessenger,
    MailMessenger as MailMessenger,
    MailSettings as MailSettings,
    Messenger as Messenger,
)
from ._opening import (
    make_folder as make_folder,
    planned_recordings as planned_recordings,
    require_all_within_limits as require_all_within_limits,
)
from ._point_outcome import (
    AfterFailure as AfterFailure,
    CampaignProgress as CampaignProgress,
    ChangedBench as ChangedBench,
    ExistingRecordings as ExistingRecordings,
    PointOutcome as PointOutcome,
    PointResult as PointResult,
    ReasonCode as ReasonCode,
    ignore_result as ignore_result,
)
from ._reconnecting_bench import (
    ReconnectingBench as ReconnectingBench,
)
from ._run_campaign import (
    run_campaign as run_campaign,
)
from ._verify import (
    VerifiedRecording as VerifiedRecording,
    verify_recordings as verify_recordings,
)
