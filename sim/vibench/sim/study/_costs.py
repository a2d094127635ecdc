"""How long each point of a study will take: first as planned, then as its neighbours took."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..kernels import Floats
from ._grid import Grid

SHORTEST_S = 1e-6
"""No point is thought to take less: it keeps ratios finite."""


class Costs:
    """Estimates that get better as points are done.

    A run costs about 4 us an impact, and neighbours strike about as often: once a neighbour's time is
    known, it says more than any plan.
    """

    def __init__(self, grid: Grid, planned_s: Floats) -> None:
        self._grid = grid
        self._planned_s = np.maximum(planned_s, SHORTEST_S)
        self._taken_s = np.full(grid.size, np.nan)
        self._estimate_s = self._planned_s.copy()
        self._is_informed = np.zeros(grid.size, dtype=np.bool_)

    def estimate_s(self, number: int) -> float:
        """Time that a point is expected to take on one worker."""
        return float(self._estimate_s[number])

    def learn(self, number: int, taken_s: float) -> Iterator[int]:
        """Note what a point took; the neighbours whose estimates change come back."""
        self._taken_s[number] = max(taken_s, SHORTEST_S)
        for each in self._grid.neighbours(number):
            if np.isnan(self._taken_s[each]):
                known = [self._taken_s[other] for other in self._grid.neighbours(each)]
                self._estimate_s[each] = np.nanmean(known)
                self._is_informed[each] = True
                yield each

    def left_s(self, is_missing: NDArray[np.bool_]) -> float:
        """Worker time of the points that are missing, shape (points,).

        Plans that no neighbour has corrected are scaled by how far plans have been off so far.
        """
        known = ~np.isnan(self._taken_s)
        off = self._taken_s[known].sum() / self._planned_s[known].sum() if known.any() else 1.0
        informed = is_missing & self._is_informed
        planned = is_missing & ~self._is_informed
        return float(self._estimate_s[informed].sum() + off * self._planned_s[planned].sum())
