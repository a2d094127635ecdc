"""What a map will cost before it is begun: points, work, time with so many workers, and bytes."""

import math
import os
from dataclasses import asdict, dataclass

import numpy as np

from ..scene.solve import Question
from ._expansion import MapPoints, map_solver
from ._map import Map

POINT_S = 2e-4
"""Time that the process that asks spends on each point [s]: its scene, and its answer's way into the file."""


@dataclass(frozen=True)
class MapEstimate:
    """What a map will take; where it is adaptive, between its coarse lattice and all of its points."""

    points: int
    coarse_points: int
    """Of the first lattice: a map has at least so many."""
    work_s: float
    """Of all points on one core, as such points took here lately."""
    longest_work_s: float
    """The same if no motion repeats, so that each is followed for all drive periods of the map."""
    coarse_work_s: float
    """Of the first lattice."""
    workers: int
    file_bytes: int
    followed: str
    """How motions are followed, as `map_solver` chooses."""

    @property
    def all_s(self) -> float:
        """Time until all points are computed."""
        return self._elapsed_s(self.points, self.work_s)

    @property
    def most_s(self) -> float:
        """The same if no motion repeats."""
        return self._elapsed_s(self.points, self.longest_work_s)

    @property
    def first_s(self) -> float:
        """Time until the first picture."""
        return self._elapsed_s(self.coarse_points, self.coarse_work_s)

    @property
    def most_useful_workers(self) -> int:
        """More workers than this wait for the process that asked."""
        return max(1, math.floor(self.work_s / (self.points * POINT_S)))

    def _elapsed_s(self, points: int, work_s: float) -> float:
        """Workers share the work; one process makes scenes and writes; the last point has no company."""
        return max(work_s / self.workers + work_s / points, points * POINT_S)

    @property
    def sentence(self) -> str:
        """Say it to a person."""
        return (
            f"{self.points} points at most, {self.coarse_points} of them in the first picture; all are "
            f"planned as {self.work_s:.2g} s of one core, as such points took here lately. With "
            f"{self.workers} worker(s): the first picture after {self.first_s:.2g} s, everything after "
            f"{self.all_s:.2g} s, or {self.most_s:.2g} s if no motion repeats; "
            f"more than {self.most_useful_workers} workers would wait. The file takes "
            f"{self.file_bytes / 1e6:.1f} MB. Motions are followed {self.followed}."
        )

    def to_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return {
            **asdict(self),
            "all_s": self.all_s,
            "most_s": self.most_s,
            "first_s": self.first_s,
            "most_useful_workers": self.most_useful_workers,
        }


def estimate_map(plan: Map, workers: int | None = None) -> MapEstimate:
    """Say what a map will take of ``workers`` threads, by what such points took here lately; none is run.

    How many points refinement will ask for, and how many motions repeat, is not known before: the estimate
    says the least and the most.
    """
    points = MapPoints(plan)
    row_bytes = sum(np.dtype(column.dtype).itemsize * column.components for column in plan.columns)
    first = points.wanted_first
    return MapEstimate(
        points=plan.grid.size,
        coarse_points=len(first),
        work_s=float(points.planned_s.sum()),
        longest_work_s=float(points.longest_s.sum()),
        coarse_work_s=float(points.planned_s[first].sum()),
        workers=(os.cpu_count() or 1) if workers is None else max(1, workers),
        file_bytes=plan.grid.size * row_bytes,
        followed="eight at a time, in lanes"
        if map_solver(plan) is Question.MOTION
        else "one after the other",
    )
