from ._catalogue import (
    Refresh as Refresh,
    catalogue as catalogue,
)
from ._catalogue_entry import (
    UNREADABLE as UNREADABLE,
    CatalogueEntry as CatalogueEntry,
)
from ._estimate import (
    Estimate as Estimate,
    estimate as estimate,
)
from ._event import (
    Event as Event,
    Happening as Happening,
    Listener as Listener,
    ignore_happening as ignore_happening,
)
from ._journal import (
    JOURNAL_SUFFIX as JOURNAL_SUFFIX,
)
from ._journal_point import (
    PointState as PointState,
    read_journal as read_journal,
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
)
from ._point_outcome import (
    AfterFailure as AfterFailure,
    CampaignItem as CampaignItem,
    CampaignProgress as CampaignProgress,
    ChangedBench as ChangedBench,
    Existing as Existing,
    Item as Item,
    Why as Why,
    ignore_item as ignore_item,
)
from ._reconnecting_bench import (
    KeptBench as KeptBench,
)
from ._run_campaign import (
    run_campaign as run_campaign,
)
