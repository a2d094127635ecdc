"""Which way a measurement goes through its steps, and how it comes to each frequency."""

from collections.abc import Iterator
from enum import StrEnum


class Direction(StrEnum):
    """Which way through the steps: an impacting specimen may answer differently on the way back."""

    UP = "up"
    DOWN = "down"
    UP_THEN_DOWN = "up_then_down"
    DOWN_THEN_UP = "down_then_up"

    def ways(self, rising: tuple[float, ...]) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Give each way through what rises: ``"up"`` or ``"down"``, and its values in the order played."""
        up = (Direction.UP.value, rising)
        down = (Direction.DOWN.value, rising[::-1])
        match self:
            case Direction.UP:
                yield up
            case Direction.DOWN:
                yield down
            case Direction.UP_THEN_DOWN:
                yield from (up, down)
            case Direction.DOWN_THEN_UP:
                yield from (down, up)


class Approach(StrEnum):
    """Where the motion at each frequency begins; with several motions at one frequency it decides which."""

    REST = "from rest"
    UP = "led upwards"
    """From the state and the phase in which the next lower frequency ended."""
    DOWN = "led downwards"
