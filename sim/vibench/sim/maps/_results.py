"""Results of a map over its axes, computed or filled in, and the different motions in the map."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..scene.prediction import MotionKind
from ..scene.shares import UNSURE, Count, Share, shares_of, wilson_share
from ..specimen.specimen import Floats
from ..study import GridResults, PointState, read_arrays, read_plan, read_sessions
from ._expansion import BASIN_JUMP, cell_codes, refinement_of
from ._map import Map, labels_of, without_impacts
from ._refinement import RefinementPlan

UNKNOWN = -1
SOLID = np.array([kind is MotionKind.PERIODIC for kind in MotionKind])
"""Whether the responses of each kind of motion are reproducible, in the order of `MotionKind`."""


@dataclass(frozen=True)
class MapMotion:
    """Motion found in a map or in one cell; a motion and its mirror image count as one motion."""

    motion: MotionKind
    period: int | None
    """Period of a periodic motion, in drive periods."""
    has_impacts: bool
    response_i: float
    """Response I, largest abs(x) / drive amplitude: median over the points with this motion."""
    response_ii: float
    share: Share
    """Share of initial states that reach this motion within the map's run length; chaos may end later. The 95
    % intervals of all motions hold jointly. A random state used in all cells counts as one trial."""


@dataclass(frozen=True)
class Audit:
    """Error rate of the filled-in cells, from a random sample that was computed."""

    filled: int
    """Number of filled-in cells, including the audited cells."""
    audited: int
    wrong: int
    """Number of audited cells whose filled-in motion was wrong."""
    gained: tuple[float, ...]
    """Number of wrong audited cells for each computed motion; fractional with several initial states."""
    lost: tuple[float, ...]
    """Number of wrong audited cells for each filled-in motion."""

    @property
    def wrong_share(self) -> Share:
        """Share of filled-in cells that are wrong, with the 95 % confidence interval of the share."""
        if not self.audited:
            return Share(0.0, 0.0, 1.0 if self.filled else 0.0)
        return wilson_share(self.wrong, self.audited)

    def corrected_shares(self, shares: Sequence[Share], cells: int) -> tuple[Share, ...]:
        """Return the shares of the motions in a map with ``cells`` cells, corrected for filling errors.

        Where motions are finely mixed, the most common motion is filled in too often. The gains and losses
        found by the audit are extrapolated to all filled-in cells.
        """
        if not self.filled:
            return tuple(shares)
        rest = min(1.0, (self.filled - self.audited) / cells)
        unsure = UNSURE / (2 * len(shares))
        found = []
        for share, gained, lost in zip(shares, self.gained, self.lost, strict=True):
            # If no filled-in cell was audited, nothing is known about errors of filled-in cells.
            come, gone = (
                wilson_share(each, self.audited, unsure) if self.audited else Share(0.0, 0.0, 1.0)
                for each in (gained, lost)
            )
            found.append(
                Share(
                    share.share + rest * (come.share - gone.share),
                    max(0.0, share.low + rest * (come.low - gone.high)),
                    min(1.0, share.high + rest * (come.high - gone.low)),
                )
            )
        return tuple(found)


def audit_of(numbers: NDArray[np.int64], found: RefinementPlan) -> Audit:
    """Compare the audited cells with what would have been filled in; return the error rate.

    Parameters
    ----------
    numbers
        Index of the motion of each point, shape (rows, starts, columns).
    found
        Plan of a complete map, with its audited cells.
    """
    codes = cell_codes(numbers).reshape(-1)
    starts = np.moveaxis(numbers, 1, 2).reshape(len(codes), -1)
    here, taken = starts[found.audited], starts[found.audited_donors]
    differs = (here != taken) & (here != UNKNOWN)
    motions = np.arange(numbers.max(initial=UNKNOWN) + 1)[:, None, None]
    gained, lost = (
        tuple(((differs & (each == motions)).sum(axis=(1, 2)) / starts.shape[1]).tolist())
        for each in (here, taken)
    )
    wrong = int(np.count_nonzero(codes[found.audited] != codes[found.audited_donors]))
    filled = sum(len(each.cells) for each in found.fillings)
    return Audit(filled, len(found.audited), wrong, gained, lost)


@dataclass(frozen=True, eq=False)
class MapResults(GridResults[Map]):
    """Results of a map, over axes in the order of ``plan.axes``."""

    @property
    def points(self) -> int:
        """Number of computed points of the map."""
        return int(np.count_nonzero(~np.isin(self.state, (PointState.MISSING, PointState.FILLED))))

    @cached_property
    def audit(self) -> Audit | None:
        """Error rate of filled-in cells; None if all points are computed or the map is incomplete."""
        if not (self.plan.is_adaptive and self.is_complete):
            return None
        return audit_of(self.motion_numbers, refinement_of(self.plan, dict(self.arrays)))

    @cached_property
    def motion_numbers(self) -> NDArray[np.int64]:
        """Index of the motion of each point over all axes; -1 if unknown, 0 for the most common motion.

        Motions of the same kind and period have the same index; motions without impacts have a separate
        index. If only the start varies, periodic motions are also distinguished by their responses, so that
        each index is one attractor.
        """
        is_known = np.flatnonzero(self._labels != UNKNOWN)
        labels, sizes = self._labels[is_known], self._sizes[is_known] if self.plan.is_basin else None
        numbers = np.full(self.plan.grid.size, UNKNOWN)
        numbers[is_known] = _by_frequency(_groups(labels, sizes))
        return numbers.reshape(self.plan.grid.shape)

    @cached_property
    def motion_counts(self) -> Floats:
        """Number of different motions that each cell's initial states reach; NaN if unknown."""
        shape = self.plan.grid.shape
        labels, sizes = self._labels.reshape(shape), self._sizes.reshape(shape)
        order = np.lexsort((sizes, labels), axis=-2)
        labels = np.take_along_axis(labels, order, -2)
        sizes = np.take_along_axis(sizes, order, -2)
        before, after = labels[..., :-1, :], labels[..., 1:, :]
        is_new = (after != before) | (np.diff(sizes, axis=-2) > BASIN_JUMP)
        counts = np.asarray((labels[..., 0, :] >= 0) + (is_new & (after >= 0)).sum(axis=-2), dtype=np.float64)
        return np.where(counts > 0, counts, np.nan)

    @cached_property
    def motions(self) -> tuple[MapMotion, ...]:
        """Motions of the whole map, in the order of `motion_numbers`.

        Shares refer to all known points, and are corrected by the audit if points are filled in.
        """
        return self._describe_motions(self.motion_numbers.reshape(-1), self.audit)

    def motions_at(self, *place: int) -> tuple[MapMotion, ...]:
        """Return the motions of the cell at `place` (second index, first index), the most common first."""
        points = np.arange(self.plan.grid.size).reshape(self.plan.grid.shape)
        cell = np.moveaxis(points, -2, -1)[place]
        known = cell[self._labels[cell] >= 0]
        numbers = np.full(self.plan.grid.size, UNKNOWN)
        numbers[known] = _by_frequency(_groups(self._labels[known], self._sizes[known]))
        return self._describe_motions(numbers, None)

    def map_values(self, name: str, start: int = 0) -> Floats:
        """Return a result over the varying quantities, for one of the initial states; NaN if unknown.

        ``name`` is a column, or ``motions`` for the number of motions that a cell's initial states reach.
        """
        if name == "motions":
            return self.motion_counts
        values = self.values(name)
        return np.asarray(np.take(values, start, axis=len(self.plan.grid.shape) - 2))

    def example(self, number: int) -> int:
        """Return the number of the first computed point with the motion of this index."""
        is_it = (self.motion_numbers.reshape(-1) == number) & (self.state.reshape(-1) == PointState.DONE)
        return int(np.flatnonzero(is_it)[0])

    @cached_property
    def _labels(self) -> NDArray[np.int64]:
        has_result = np.isin(self.state.reshape(-1), (PointState.DONE, PointState.FILLED))
        # A point that was filled in from a failed point has no motion.
        labels = labels_of(self.arrays)
        return np.where(has_result & (labels >= 0), labels, UNKNOWN)

    @cached_property
    def _sizes(self) -> Floats:
        """Natural logarithm of Response I where Response I is reproducible, otherwise 0."""
        response = np.maximum(self.arrays["response_i"].astype(np.float64), 1e-300)
        is_solid = (self._labels >= 0) & SOLID[self.arrays["motion"].astype(np.int64)]
        return np.where(is_solid, np.log(np.where(np.isfinite(response), response, 1.0)), 0.0)

    def _median(self, name: str, points: NDArray[np.int64]) -> float:
        return float(np.nanmedian(self.arrays[name][points].astype(np.float64)))

    def _describe_motions(self, numbers: NDArray[np.int64], audit: Audit | None) -> tuple[MapMotion, ...]:
        total = int(np.count_nonzero(numbers >= 0))
        places = [
            np.flatnonzero(numbers == number) for number in range(int(numbers.max(initial=UNKNOWN)) + 1)
        ]
        kinds = [list(MotionKind)[int(self.arrays["motion"][place[0]])] for place in places]
        is_free = without_impacts(self.arrays)
        trials = min(total, len(self.plan.start_labels)) if self.plan.random_starts else total
        shares = shares_of([Count(trials * len(place) / total, is_final=True) for place in places])
        if audit is not None and total:
            shares = audit.corrected_shares(shares, total // self.plan.grid.shape[-2])
        return tuple(
            MapMotion(
                kind,
                int(self.arrays["period"][place[0]]) if kind is MotionKind.PERIODIC else None,
                not is_free[place[0]],
                self._median("response_i", place),
                self._median("response_ii", place),
                share,
            )
            for place, kind, share in zip(places, kinds, shares, strict=True)
        )


def _groups(labels: NDArray[np.int64], sizes: Floats | None) -> NDArray[np.int64]:
    """Return group numbers of points by label and size; a jump in size starts a new group."""
    if sizes is None:
        return np.asarray(np.unique(labels, return_inverse=True)[1], dtype=np.int64)
    order = np.lexsort((sizes, labels))
    is_new = (np.diff(labels[order]) != 0) | (np.diff(sizes[order]) > BASIN_JUMP)
    numbers = np.zeros(len(labels), dtype=np.int64)
    numbers[order[1:]] = np.cumsum(is_new)
    return numbers


def _by_frequency(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Renumber motions by how common they are: 0 is the most common motion, 1 the next, and so on."""
    if len(numbers) == 0:
        return numbers
    rank = np.argsort(np.argsort(-np.bincount(numbers), kind="stable"), kind="stable")
    return np.asarray(rank[numbers], dtype=np.int64)


def open_map(path: Path | str) -> MapResults:
    """Return the results in the file of a map that is complete or still being computed.

    Raises StudyError if the file does not contain a map, or has another format version.
    """
    path = Path(path)
    plan = read_plan(path, Map)
    return MapResults(plan, read_arrays(path, plan), read_sessions(path, Map))
