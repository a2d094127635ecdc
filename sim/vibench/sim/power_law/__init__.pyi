from ._flow import (
    PowerSystem as PowerSystem,
    power_force as power_force,
    power_forces as power_forces,
    stiffest_rate as stiffest_rate,
)
from ._smooth import (
    advance_smooth as advance_smooth,
    begin_smooth as begin_smooth,
)
