"""The course of a sine or a sweep so far: responses and extremes against the frequency really played."""

from dataclasses import dataclass, fields

import numpy as np

from ..signals import Reals
from ._sine_response import SinePoint

MOST_POINTS = 36_000
"""An hour at ten points a second; the oldest go first."""
_COLUMNS = tuple(each.name for each in fields(SinePoint))


@dataclass(frozen=True, eq=False)
class SweepCourse:
    """All points so far, in the order of time; arrays of shape (points,)."""

    time_s: Reals
    frequency_hz: Reals
    drive_amplitude_m: Reals
    lower: Reals
    upper: Reals
    response_i: Reals
    response_ii: Reals


class SweepTrace:
    """Keeps points as they come, in memory that was claimed at the beginning."""

    def __init__(self, most: int = MOST_POINTS) -> None:
        self._most = most
        self._rows = np.empty((len(_COLUMNS), 2 * most))
        self._begin = self._end = 0

    @property
    def points(self) -> int:
        """How many are kept."""
        return self._end - self._begin

    def add(self, point: SinePoint) -> None:
        """Keep one more."""
        if self._end == self._rows.shape[1]:
            self._rows[:, : self.points] = self._rows[:, self._begin : self._end].copy()
            self._begin, self._end = 0, self.points
        self._rows[:, self._end] = [getattr(point, name) for name in _COLUMNS]
        self._end += 1
        self._begin = max(self._begin, self._end - self._most)

    def course(self) -> SweepCourse:
        """Give all points."""
        return SweepCourse(*self._rows[:, self._begin : self._end].copy())
