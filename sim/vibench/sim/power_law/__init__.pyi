from ._flow import (
    PowerSystem as PowerSystem,
    power_force as power_force,
    short_of_the_wall as short_of_the_wall,
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
from ._tables import (
    PowerTables as PowerTables,
    power_tables as power_tables,
)
