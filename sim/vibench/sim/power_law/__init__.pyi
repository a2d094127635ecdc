from ._flow import (
    power_force as power_force,
    power_forces as power_forces,
    stiffest_rate as stiffest_rate,
)
