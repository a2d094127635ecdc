"""Selection of the computed cells of a map: a coarse lattice first, then cells whose neighbours differ.

The selection depends only on the known results. The selection is repeated from the coarse lattice whenever
all requested cells are done. A resumed map therefore computes the same cells as an uninterrupted one.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..specimen.specimen import Floats

Mask = NDArray[np.bool_]
Codes = NDArray[np.int64]
Indices = NDArray[np.int64]

AUDITED, AUDITED_SHARE = 400, 0.1
"""Largest number and largest share of filled-in cells that are computed as a check (audit)."""


@dataclass(frozen=True, eq=False)
class ComparedCells:
    """Results by which the cells of a map are compared; arrays of shape (rows, columns)."""

    is_known: Mask
    """Whether the cell has been computed."""
    codes: Codes
    """Number of the cell's motion or set of motions; equal numbers mean the same motions."""
    sizes: Floats
    """Natural logarithm of a response; NaN for motions whose response is not reproducible."""
    jump: float
    """Difference of ``sizes`` above which two neighbouring cells count as different."""


@dataclass(frozen=True, eq=False)
class Filling:
    """Filled-in cells of one lattice level, with the cells and weights for their interpolation."""

    cells: Indices
    """Flat indices of the filled-in cells, shape (n,)."""
    donors: Indices
    """Computed cell whose motion each filled-in cell copies, shape (n,)."""
    corners: Indices
    """Corners for interpolation: computed or filled-in cells of coarser levels, shape (n, 4)."""
    weights: Floats
    """Interpolation weights of the corners, whose sum is 1, shape (n, 4)."""


@dataclass(frozen=True, eq=False)
class RefinementPlan:
    """Cells to compute next or, if there are none, the cells to fill in."""

    missing: Indices
    """Flat indices of the cells to compute next."""
    step: int
    """Grid steps between the points of the current lattice."""
    fillings: tuple[Filling, ...] = ()
    """Filled-in cells of each level, from coarse to fine."""
    audited: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Filled-in cells that are computed as well, to find how often the filling is wrong (audit)."""
    audited_donors: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Computed cell whose motion each audited cell would have received by filling."""


def plan_refinement(seen: ComparedCells, coarse: int, seed: int) -> RefinementPlan:
    """Return the cells to compute next or, if all are known, the filled-in cells.

    Parameters
    ----------
    seen
        Results so far.
    coarse
        Grid steps between the points of the first lattice, a power of 2.
    seed
        Seed of the random choice of audited cells.
    """
    shape = seen.is_known.shape
    sketch = _Sketch(seen)
    first = lattice(shape, coarse)
    missing = first & ~seen.is_known
    if missing.any():
        return RefinementPlan(np.flatnonzero(missing), coarse)
    sketch.compute(first)
    step = coarse
    while step > 1:
        fine = step // 2
        missing = sketch.refine(fine, step)
        if missing.any():
            return RefinementPlan(np.flatnonzero(missing), fine)
        step = fine
    steps = [coarse >> k for k in range(coarse.bit_length() - 1)]
    return _audit_plan(sketch, tuple(sketch.filling(step // 2, step) for step in steps), seed)


def _audit_plan(sketch: "_Sketch", fillings: tuple[Filling, ...], seed: int) -> RefinementPlan:
    nothing = np.zeros(0, dtype=np.int64)
    filled = np.concatenate([nothing, *(each.cells for each in fillings)])
    donors = np.concatenate([nothing, *(each.donors for each in fillings)])
    rng = np.random.default_rng([seed, len(filled)])
    count = min(AUDITED, int(AUDITED_SHARE * len(filled)))
    drawn = rng.choice(len(filled), count, replace=False)
    drawn = drawn[np.argsort(filled[drawn])]
    known = sketch.seen.is_known.reshape(-1)[filled[drawn]]
    return RefinementPlan(filled[drawn][~known], 1, fillings, filled[drawn], donors[drawn])


class _Sketch:
    """Cells that are computed or filled in at the lattice levels processed so far."""

    def __init__(self, seen: ComparedCells) -> None:
        self.seen = seen
        self.is_computed = np.zeros_like(seen.is_known)
        self.codes = np.zeros_like(seen.codes)
        self.sizes = np.full_like(seen.sizes, np.nan)
        self.donors = np.arange(seen.codes.size).reshape(seen.codes.shape)

    def compute(self, cells: Mask) -> None:
        """Mark these cells of the map as computed."""
        self.is_computed |= cells
        self.codes[cells] = self.seen.codes[cells]
        self.sizes[cells] = self.seen.sizes[cells]
        self.donors[cells] = np.flatnonzero(cells)

    def refine(self, fine: int, step: int) -> Mask:
        """Halve the lattice spacing; return the cells to compute before the next halving, if any."""
        cells = np.flatnonzero(lattice(self.codes.shape, fine) & ~lattice(self.codes.shape, step))
        corners, weights = _corners(self.codes.shape, cells, step)
        wanted = np.zeros_like(self.is_computed)
        wanted.reshape(-1)[cells] = self._differ(corners)
        nearest = corners[np.arange(len(cells)), np.argmax(weights, axis=1)]
        self.donors.reshape(-1)[cells] = self.donors.reshape(-1)[nearest]
        self.codes.reshape(-1)[cells] = self.codes.reshape(-1)[nearest]
        self.sizes.reshape(-1)[cells] = (self.sizes.reshape(-1)[corners] * weights).sum(axis=1)
        while True:
            missing = wanted & ~self.seen.is_known
            if missing.any():
                return missing
            self.compute(wanted)
            # Compute filled-in cells beside another motion, because the lattice may be too coarse.
            beside = self._has_other_neighbour(fine) & ~self.is_computed & lattice(self.codes.shape, fine)
            if not beside.any():
                return missing
            wanted = beside

    def filling(self, fine: int, step: int) -> Filling:
        """Return the filled-in cells of one lattice level.

        A corner cell that was later found to have another motion gets no weight.
        """
        is_new = lattice(self.codes.shape, fine) & ~lattice(self.codes.shape, step) & ~self.is_computed
        cells = np.flatnonzero(is_new)
        corners, weights = _corners(self.codes.shape, cells, step)
        codes, donors = self.codes.reshape(-1), self.donors.reshape(-1)[cells]
        weights = np.where(codes[corners] == codes[cells][:, None], weights, 0.0)
        is_alone = weights.sum(axis=1) == 0.0
        corners[is_alone, 0], weights[is_alone, 0] = donors[is_alone], 1.0
        return Filling(cells, donors, corners, weights / weights.sum(axis=1, keepdims=True))

    def _differ(self, corners: Indices) -> Mask:
        """Return whether the four corners of each cell have different motions, shape (n,)."""
        codes, sizes = self.codes.reshape(-1)[corners], self.sizes.reshape(-1)[corners]
        spread = sizes.max(axis=1) - sizes.min(axis=1)
        return np.asarray((codes != codes[:, :1]).any(axis=1) | (spread > self.seen.jump))

    def _has_other_neighbour(self, fine: int) -> Mask:
        """Return whether any of a cell's eight neighbours has another motion, shape (rows, columns)."""
        rows, columns = (_lines(length, fine) for length in self.codes.shape)
        there = np.ix_(rows, columns)
        differs = _differs_from_neighbours(self.codes[there], self.sizes[there], self.seen.jump)
        found = np.zeros_like(self.is_computed)
        found[there] = differs
        return found


def _differs_from_neighbours(codes: Codes, sizes: Floats, jump: float) -> Mask:
    differs = np.zeros(codes.shape, dtype=np.bool_)
    for here, there in _pairs():
        unlike = (codes[here] != codes[there]) | (np.abs(sizes[here] - sizes[there]) > jump)
        differs[here] |= unlike
        differs[there] |= unlike
    return differs


def _pairs() -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Yield pairs of slices of neighbouring cells, along rows, columns and both diagonals."""
    whole, low, high = slice(None), slice(None, -1), slice(1, None)
    yield (low, whole), (high, whole)
    yield (whole, low), (whole, high)
    yield (low, low), (high, high)
    yield (low, high), (high, low)


def _lines(length: int, step: int) -> Indices:
    """Return the indices of lattice lines along one axis; the last line of the map is included."""
    return np.unique([*range(0, length, step), length - 1])


def lattice(shape: tuple[int, ...], step: int) -> Mask:
    """Return whether each cell is in a lattice row and column: every ``step``-th one, and the last one."""
    found = np.zeros(shape, dtype=np.bool_)
    found[np.ix_(*(_lines(length, step) for length in shape))] = True
    return found


def _corners(shape: tuple[int, ...], cells: Indices, step: int) -> tuple[Indices, Floats]:
    """Return the lattice points around each cell and their bilinear weights, shape (n, 4) each."""
    rows, columns = np.divmod(cells, shape[1])
    (low_row, high_row, up), (low_column, high_column, right) = (
        _neighbours(place, _lines(length, step)) for place, length in zip((rows, columns), shape, strict=True)
    )
    corners = np.stack(
        [row * shape[1] + column for row in (low_row, high_row) for column in (low_column, high_column)],
        axis=1,
    )
    weights = np.stack(
        [(1.0 - up) * (1.0 - right), (1.0 - up) * right, up * (1.0 - right), up * right], axis=1
    )
    return corners, weights


def _neighbours(place: Indices, lines: Indices) -> tuple[Indices, Indices, Floats]:
    """Return the lattice lines below and above each index, and its position between these lines (0 to 1)."""
    above = np.searchsorted(lines, place, side="left")
    high = lines[above]
    low = np.where(high == place, place, lines[np.maximum(above - 1, 0)])
    return low, high, (place - low) / np.maximum(high - low, 1)
