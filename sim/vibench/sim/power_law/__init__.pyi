from ._flow import (
    PowerSystem as PowerSystem,
    power_force as power_force,
    whole_power as whole_power,
)
from ._numbers import (
    FEED as FEED,
    FREE as FREE,
    GAIN as GAIN,
    MOVE as MOVE,
    POINTS as POINTS,
)
from ._run import (
    advance_under_power as advance_under_power,
)
from ._smooth import (
    MOST_SHORTENINGS as MOST_SHORTENINGS,
    SHORTENING as SHORTENING,
    WALL_TURN as WALL_TURN,
    advance_smooth as advance_smooth,
    begin_smooth as begin_smooth,
)
from ._step import (
    PowerStepState as PowerStepState,
)
from ._tables import (
    PowerTables as PowerTables,
    power_tables as power_tables,
)
