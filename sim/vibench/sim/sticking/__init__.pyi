from ._lift_off import (
    time_to_lift_off as time_to_lift_off,
)
from ._sticking import (
    hold_on_series as hold_on_series,
)
