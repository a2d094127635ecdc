"""Points of a map as scenes: initial states, stored results, and the selection of points to compute."""

import math
import os
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..engine.batch import batches_pay
from ..engine.run import Outcome
from ..scene.cost import pilot_cost_s
from ..scene.prediction import MotionKind, ScenePrediction
from ..scene.refinement import LONGEST_S
from ..scene.scene import Scene
from ..scene.solve import InBatches, Question, settle_scene, solve_scene
from ..study import (
    Arrays,
    Cell,
    Grid,
    InvalidStudy,
    Points,
    PointState,
    Solver,
)
from ._map import OF_SPECIMEN, START, Map, contact_energy_j, labels_of, section_cells
from ._refinement import ComparedCells, RefinementPlan, lattice, plan_refinement

JUMP = 0.1
"""Relative difference of two neighbouring responses above which the points between them are computed."""
BASIN_JUMP = 2e-3
"""Replaces `JUMP` if only the start varies; values of the same motion then differ only by transients."""
NOTHING = -1
BUNDLE_S = 0.3
"""Computing time of the scenes that a worker receives at once [s]; long enough to fill SIMD batches."""


def map_solver(plan: Map) -> Solver:
    """Return the solver of a map, which computes points in SIMD batches or one by one.

    Batches need points that do not continue one another, a single specimen, and wide processor registers.
    Points with stops other than Hertz, with accuracy *reference* or with a target are solved one by one.
    """
    if plan.target is not None:
        return solve_scene
    is_one_specimen = not any(each in OF_SPECIMEN for each in plan.varying)
    return (
        InBatches(Question.MOTION) if is_one_specimen and not plan.chain and batches_pay() else settle_scene
    )


class MapPoints(Points):
    """Points of a map, converted to scenes."""

    def __init__(self, plan: Map) -> None:
        # Refuse random starts with given starts here, not in `Map`, because older files may have both.
        of_start = [each.field for each in plan.varying if each in START]
        if plan.random_starts and of_start:
            raise InvalidStudy(
                f"random_starts = {plan.random_starts} was given with a range of {of_start[-1]}, which sets "
                "the start; leave out random_starts, or give ranges of drive or specimen alone."
            )
        super().__init__(plan, plan.chain, map_solver(plan), BUNDLE_S)
        self.plan = plan

    @property
    def first_points(self) -> NDArray[np.int64]:
        """Point numbers of the first lattice, for all initial states of each cell."""
        if not self.plan.is_adaptive:
            return np.arange(self.grid.size)
        rows, _, columns = self.grid.shape
        return points_of(np.flatnonzero(lattice((rows, columns), self.plan.first_step)), self.grid)

    def next_points(self, arrays: Arrays) -> NDArray[np.int64]:
        """Return the points to compute next, for all initial states; all points of a non-adaptive map."""
        if not self.plan.is_adaptive:
            return np.arange(self.grid.size)
        return points_of(refinement_of(self.plan, arrays).missing, self.grid)

    def own_cells(self, scene: Scene, found: ScenePrediction) -> dict[str, Cell]:
        """Return section points, contact energy and the reason for an early end."""
        cells = section_cells(found)
        energy_j = contact_energy_j(scene.specimen, found)
        if energy_j is not None:
            cells["contact_energy"] = energy_j
        if found.outcome is not Outcome.REACHED_END:
            cells["message"] = found.outcome.text.encode()
        return cells


def refinement_of(plan: Map, arrays: Arrays) -> RefinementPlan:
    """Return the cells of an adaptive map to compute next or, if there are none, the cells to fill in."""
    shape = plan.grid.shape
    state = np.asarray(arrays["state"]).reshape(shape)
    is_known = np.all((state != PointState.MISSING) & (state != PointState.FILLED), axis=1)
    motion = np.asarray(arrays["motion"]).reshape(shape)
    is_whole = state == PointState.DONE
    label = np.where(is_whole, labels_of(arrays).reshape(shape), NOTHING)
    size = np.log(np.maximum(np.asarray(arrays["response_i"], dtype=np.float64).reshape(shape)[:, 0], 1e-300))
    is_steady = is_whole[:, 0] & (motion[:, 0] == list(MotionKind).index(MotionKind.PERIODIC))
    seen = ComparedCells(
        is_known,
        cell_codes(label),
        np.where(is_steady, size, math.nan),
        BASIN_JUMP if plan.is_basin else JUMP,
    )
    return plan_refinement(seen, plan.first_step, plan.seed)


def cell_codes(label: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return a number per cell, shape (rows, columns); cells that reach the same motions have equal numbers.
    The first initial states of such cells must also reach the same motion. ``label``: shape (rows, initial
    states, columns).
    """
    rows, starts, columns = label.shape
    if starts == 1:
        return label[:, 0]
    found = np.sort(label, axis=1)
    # Count a motion once, even if several initial states reach it.
    found[:, 1:][found[:, 1:] == found[:, :-1]] = NOTHING
    cells = np.concatenate([label[:, :1], np.sort(found, axis=1)], axis=1)
    flat = cells.transpose(0, 2, 1).reshape(rows * columns, starts + 1)
    return np.asarray(np.unique(flat, axis=0, return_inverse=True)[1].reshape(rows, columns), dtype=np.int64)


def points_of(cells: NDArray[np.int64], grid: Grid) -> NDArray[np.int64]:
    """Return the point numbers of the given cells of a map; a cell has one point per initial state."""
    _, starts, columns = grid.shape
    row, column = np.divmod(cells, columns)
    return np.asarray(((row[:, None] * starts + np.arange(starts)) * columns + column[:, None]).reshape(-1))


POINT_S = 2e-4
"""Time that the main process needs per point to build the scene and store the result [s]."""


@dataclass(frozen=True)
class MapEstimate:
    """Estimated computing time of a map; if adaptive, bounds from the first lattice and from all points."""

    points: int
    coarse_points: int
    """Number of points of the first lattice; all of these are computed."""
    work_s: float
    """Computing time of all points on one core [s], from recent run times on this machine."""
    longest_work_s: float
    """Computing time of all points on one core [s] if no motion repeats and all runs have full length."""
    coarse_work_s: float
    """Computing time of the first lattice on one core [s]."""
    workers: int
    file_bytes: int
    followed: str
    """Description of the solver chosen by `map_solver`."""
    known_from: str
    """Source of the run times, as text."""

    @property
    def all_s(self) -> float:
        """Estimated elapsed time for computing all points [s]."""
        return self._elapsed_s(self.points, self.work_s)

    @property
    def most_s(self) -> float:
        """Estimated elapsed time for computing all points if no motion repeats [s]."""
        return self._elapsed_s(self.points, self.longest_work_s)

    @property
    def first_s(self) -> float:
        """Estimated elapsed time for computing the first lattice [s]."""
        return self._elapsed_s(self.coarse_points, self.coarse_work_s)

    @property
    def most_useful_workers(self) -> int:
        """Largest useful number of workers; additional workers would wait for the main process."""
        return max(1, min(self.points, math.floor(self.work_s / (self.points * POINT_S))))

    def _elapsed_s(self, points: int, work_s: float) -> float:
        """Return the elapsed time [s], which either the workers or the main process determines."""
        return max(work_s / self.workers + work_s / points, points * POINT_S)

    @property
    def sentence(self) -> str:
        """Estimated computing time of the map as text."""
        return (
            f"{self.points} points at most, {self.coarse_points} of them in the first picture. Estimated "
            f"work: {self.work_s:.2g} s on one core, based on {self.known_from}. With "
            f"{self.workers} worker(s): the first picture after {self.first_s:.2g} s, all points after "
            f"{self.all_s:.2g} s, or {self.most_s:.2g} s if no motion repeats; "
            f"more than {self.most_useful_workers} workers do not help. The file takes "
            f"{self.file_bytes / 1e6:.1f} MB. Motions are computed {self.followed}."
        )

    def to_dict(self) -> dict[str, object]:
        """Return the estimate as a dict of plain values for JSON."""
        return {
            **asdict(self),
            "all_s": self.all_s,
            "most_s": self.most_s,
            "first_s": self.first_s,
            "most_useful_workers": self.most_useful_workers,
        }


def estimate_map(plan: Map, workers: int | None = None) -> MapEstimate:
    """Return the estimated time of a map on ``workers`` threads, from recent run times on this machine.

    No point is computed, except in pilot runs of about a second if points have a target. How many points are
    refined and how many motions repeat is unknown in advance, so the estimate consists of bounds.
    """
    points = MapPoints(plan)
    row_bytes = sum(np.dtype(column.dtype).itemsize * column.components for column in plan.columns)
    first, count = points.first_points, plan.grid.size
    if plan.target is None:
        work_s, first_s = float(points.planned_s.sum()), float(points.planned_s[first].sum())
        longest_s = float(points.times_s(may_repeat=False).sum())
    else:
        each_s = pilot_cost_s(points.new_scene, count)
        work_s, first_s = count * each_s, len(first) * each_s
        longest_s = count * (LONGEST_S if plan.target.time_s is None else plan.target.time_s)
    return MapEstimate(
        points=count,
        coarse_points=len(first),
        work_s=work_s,
        longest_work_s=longest_s,
        coarse_work_s=first_s,
        workers=(os.cpu_count() or 1) if workers is None else max(1, workers),
        file_bytes=count * row_bytes,
        followed="in SIMD batches of eight"
        if isinstance(map_solver(plan), InBatches)
        else "one after the other",
        known_from="recent points of this kind" if plan.target is None else "a pilot run of a few points",
    )
