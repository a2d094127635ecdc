from ._outline import (
    THUMBNAIL_COLUMNS as THUMBNAIL_COLUMNS,
    OverviewLevel as OverviewLevel,
    RecordingOverview as RecordingOverview,
    Thumbnail as Thumbnail,
    column_starts as column_starts,
    envelope as envelope,
    has_overview as has_overview,
    kept_levels as kept_levels,
    outline as outline,
    overview_levels as overview_levels,
    thumbnail as thumbnail,
    zigzag as zigzag,
)
from ._ring import OVER_SHARE as OVER_SHARE, Level as Level, LevelVerdict as LevelVerdict
from ._sine_response import Portrait as Portrait
from ._spectra import (
    DensityPicture as DensityPicture,
    RowSpacing as RowSpacing,
    SpectrogramRequest as SpectrogramRequest,
    recording_spectrogram as recording_spectrogram,
)
from ._view import LiveChannel as LiveChannel, LiveView as LiveView
