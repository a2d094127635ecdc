from ._interval import (
    advance_interval as advance_interval,
    base_reaction as base_reaction,
    interval_tables as interval_tables,
    new_state as new_state,
    place_on_its_side as place_on_its_side,
)
from ._interval_run import (
    advance_intervals as advance_intervals,
)
from ._substep import (
    FAILED as FAILED,
    IntervalTables as IntervalTables,
)
