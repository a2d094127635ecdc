"""Compute the necessary points of a map, then fill in all other points."""

from pathlib import Path
from typing import Literal

import numpy as np

from ..background import Cancelled, Observer
from ..specimen.specimen import Floats
from ..study import (
    Arrays,
    Executor,
    ExistingStudy,
    PointState,
    Store,
    StudyEnd,
    executor_of,
    run_points,
    store_of,
)
from ._expansion import MapPoints, map_solver, points_of, refinement_of
from ._map import Map
from ._refinement import Filling
from ._results import MapResults, open_map

WHOLE = ("motion", "period", "outcome")
"""Columns of a filled-in cell that are copied from one computed cell."""
BETWEEN = (
    "response_i",
    "response_ii",
    "relative_i",
    "relative_ii",
    "impact_rate",
    "contact_energy",
    "lyapunov",
    "duration",
)
"""Columns of a filled-in cell that are interpolated between the corners around the cell."""


def solve_map(
    plan: Map,
    out: Path | None = None,
    existing: ExistingStudy | Literal["refuse", "resume"] = ExistingStudy.REFUSE,
    workers: int | None = None,
    cluster: str | None = None,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> MapResults:
    """Compute a map, or the missing points of its file, and return the results.

    Raises StudyError, for example for a file of another map, a full disk or an unresponsive cluster.

    Parameters
    ----------
    plan
        Requested map.
    out, existing, workers, cluster, observer, cancelled
        As in `vibench.sim.study.solve_study`. The total in progress reports grows with every lattice level.

    Returns
    -------
    MapResults
        Results; partial if cancelled.
    """
    with executor_of(workers, cluster, map_solver(plan)) as executor, store_of(plan, out, existing) as store:
        compute_map(plan, executor, store, observer, cancelled)
        arrays = store.arrays
    return MapResults(plan, arrays) if out is None else open_map(out)


def compute_map(
    plan: Map,
    executor: Executor,
    store: Store,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> StudyEnd:
    """Compute the missing points of a map unless ``cancelled``; when all are done, fill in the other points.

    The solver of the executor must be `map_solver`.
    """
    end = run_points(MapPoints(plan), executor, store, observer, cancelled)
    if end is StudyEnd.COMPLETE:
        fill_in(plan, store)
    return end


def fill_in(plan: Map, store: Store) -> None:
    """Fill in the points of an adaptive map that were not computed."""
    if not plan.is_adaptive or np.all(store.arrays["state"] != PointState.MISSING):
        return
    found = refinement_of(plan, store.arrays)
    columns: Arrays = {name: store.arrays[name].copy() for name in (*WHOLE, *BETWEEN)}
    for filling in found.fillings:
        _fill_level(plan, filling, columns)
    filled = points_of(np.concatenate([each.cells for each in found.fillings]), plan.grid)
    filled = np.setdiff1d(filled, points_of(found.audited, plan.grid))
    store.fill(filled, {name: values[filled] for name, values in columns.items()})


def _fill_level(plan: Map, filling: Filling, columns: Arrays) -> None:
    """Interpolate the filled-in cells of one level between the cells' corners, for each initial state."""
    cells = points_of(filling.cells, plan.grid)
    starts = plan.grid.shape[-2]
    of_cells = points_of(filling.corners.reshape(-1), plan.grid).reshape(-1, 4, starts)
    corners = of_cells.transpose(0, 2, 1).reshape(-1, 4)
    weights = np.repeat(filling.weights, starts, axis=0)
    donors = points_of(filling.donors, plan.grid)
    for name in WHOLE:
        columns[name][cells] = columns[name][donors]
    for name in BETWEEN:
        columns[name][cells] = _mean(columns[name][corners].astype(np.float64), weights)


def _mean(values: Floats, weights: Floats) -> Floats:
    """Return the weighted mean of each cell's finite corner values, (n, 4) to (n,); NaN if none is finite."""
    is_known = np.isfinite(values)
    counted = np.where(is_known, weights, 0.0)
    with np.errstate(invalid="ignore"):
        return np.asarray((np.where(is_known, values, 0.0) * counted).sum(axis=1) / counted.sum(axis=1))
