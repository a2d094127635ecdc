"""How a run is told to end: causes, how hard each of them stops, and the switch between threads.

`StopSwitch` is set without a lock and read after every block. The first Ctrl-C asks for a ramp, the
second insists. Knows neither runs nor instruments.
"""

from ._stop import (
    LEVELS,
    Cause,
    StopLevel,
    StopRequest,
    StopSwitch,
)
from ._stop_on_signal import (
    stop_on_signal,
)

__all__ = [
    "LEVELS",
    "Cause",
    "StopLevel",
    "StopRequest",
    "StopSwitch",
    "stop_on_signal",
]
