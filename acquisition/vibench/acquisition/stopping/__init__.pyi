from ._stop import (
    LEVELS as LEVELS,
    Cause as Cause,
    StopLevel as StopLevel,
    StopRequest as StopRequest,
    StopSwitch as StopSwitch,
)
from ._stop_on_signal import (
    stop_on_signal as stop_on_signal,
)
