"""What is to happen at a certain rig time, however the world is advanced there."""

import heapq
from collections.abc import Callable
from itertools import count

from ._time_grid import USUAL_GRID, TimeGrid


class Appointments:
    """Actions by the step at which they are due; those of one step keep the order they were given in."""

    def __init__(self, grid: TimeGrid = USUAL_GRID) -> None:
        self._grid = grid
        self._due: list[tuple[int, int, Callable[[], None]]] = []
        self._number = count()

    def make(self, time_s: float, action: Callable[[], None]) -> None:
        """Let ``action`` happen at a rig time; one that has passed is kept at the next step."""
        heapq.heappush(self._due, (self._grid.step_at(time_s), next(self._number), action))

    def keep(self, step: int) -> None:
        """Do everything that is due at a step."""
        while self._due and self._due[0][0] <= step:
            heapq.heappop(self._due)[2]()

    def stop_before(self, step: int) -> int:
        """Tell how far the world may be computed towards ``step`` without missing one."""
        return min(step, self._due[0][0]) if self._due else step
