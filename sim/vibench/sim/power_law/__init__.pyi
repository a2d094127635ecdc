from ._flow import (
    PowerSystem as PowerSystem,
    power_force as power_force,
    power_forces as power_forces,
    stiffest_rate as stiffest_rate,
)
from ._numbers import (
    FEED as FEED,
    FREE as FREE,
    GAIN as GAIN,
    MOVE as MOVE,
)
from ._run import (
    advance_under_power as advance_under_power,
)
from ._smooth import (
    advance_smooth as advance_smooth,
    begin_smooth as begin_smooth,
)
from ._step import (
    FIT as FIT,
    MOST_SUBSTITUTIONS as MOST_SUBSTITUTIONS,
    TRY_LONGER as TRY_LONGER,
    WALL_TURN as WALL_TURN,
)
from ._tables import (
    AT_END as AT_END,
    AT_START as AT_START,
    POINTS_AT as POINTS_AT,
    SHARES as SHARES,
    PowerTables as PowerTables,
    power_tables as power_tables,
)
