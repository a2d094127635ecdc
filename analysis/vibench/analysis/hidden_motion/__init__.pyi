from ._contact_free import (
    Collisions as Collisions,
    FreeGap as FreeGap,
    FreeImpacts as FreeImpacts,
    FreeMotion as FreeMotion,
    measured_gaps as measured_gaps,
)
from ._found_parameters import FoundParameter as FoundParameter, FoundSpecimen as FoundSpecimen
from ._hidden_motion import (
    HiddenMotion as HiddenMotion,
    TrackedMotion as TrackedMotion,
    hidden_motion as hidden_motion,
    hidden_motion_in_samples as hidden_motion_in_samples,
    keep_hidden_motion as keep_hidden_motion,
    parameter_rows as parameter_rows,
)
from ._hidden_view import (
    LONGEST_VIEW_S as LONGEST_VIEW_S,
    HiddenView as HiddenView,
    HiddenViewRequest as HiddenViewRequest,
    hidden_view as hidden_view,
)
from ._live_twin import (
    BLOCK_S as BLOCK_S,
    FALSE_ALARM_S as FALSE_ALARM_S,
    Baseline as Baseline,
    ChangeWatch as ChangeWatch,
    Forecast as Forecast,
    KnownNumber as KnownNumber,
    Level as Level,
    LiveMotion as LiveMotion,
    LiveState as LiveState,
    LiveTwin as LiveTwin,
    baseline_path as baseline_path,
    keep_baseline as keep_baseline,
    kept_baseline as kept_baseline,
)
from ._prepared_motion import ChannelNoise as ChannelNoise
from ._tracking import TrackGap as TrackGap
from ._tracking_model import (
    Hidden as Hidden,
    Numbers as Numbers,
    TrackedSpecimen as TrackedSpecimen,
    tracked_specimen as tracked_specimen,
    value_of as value_of,
    with_values as with_values,
)
