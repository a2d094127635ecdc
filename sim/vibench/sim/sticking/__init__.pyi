from ._lift_off import (
    closed_for as closed_for,
    lift_off as lift_off,
    time_to_lift_off as time_to_lift_off,
)
from ._sticking import (
    LETS_GO as LETS_GO,
    HeldTables as HeldTables,
    held_tables as held_tables,
    hold as hold,
    hold_on_series as hold_on_series,
    observe_rest as observe_rest,
    pressed_tables as pressed_tables,
)
