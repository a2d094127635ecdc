"""m1 held by a rigid stop: exact motion of two bodies until the stop would have to pull, and lift-off.

Release is found like a touch, by the proof of `flight`, from the acceleration that presses m1 on the stop.
After lift-off the gap grows from nothing, so that the first moment of the flight is bounded instead of
searched.
"""

from ._lift_off import (
    closed_for,
    lift_off,
    time_to_lift_off,
)
from ._sticking import (
    HeldTables,
    held_tables,
    hold,
    hold_on_series,
    observe_held,
    place_held,
)

__all__ = [
    "HeldTables",
    "closed_for",
    "held_tables",
    "hold",
    "hold_on_series",
    "lift_off",
    "observe_held",
    "place_held",
    "time_to_lift_off",
]
