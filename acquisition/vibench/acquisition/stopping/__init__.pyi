from ._driving import (
    DRIVES_ON as DRIVES_ON,
)
from ._kept_stops import (
    engines_folder as engines_folder,
)
from ._memory_reserve import (
    MEMORY_RESERVE as MEMORY_RESERVE,
)
from ._program import (
    AnyProgram as AnyProgram,
    Program as Program,
    announced_programs as announced_programs,
    facts_of_this_process as facts_of_this_process,
    programs_of_other_places as programs_of_other_places,
    reached as reached,
    withdraw as withdraw,
)
from ._stop import (
    LEVELS as LEVELS,
    Cause as Cause,
    StopLevel as StopLevel,
    StopRequest as StopRequest,
    StopSwitch as StopSwitch,
)
from ._stop_on_signal import (
    LEFT_TO_THE_DEAD_MAN as LEFT_TO_THE_DEAD_MAN,
    heeded_signals as heeded_signals,
    signal_name as signal_name,
    stop_on_signal as stop_on_signal,
)
from ._watchdog import (
    INTERVAL_S as INTERVAL_S,
    Watchdog as Watchdog,
)
