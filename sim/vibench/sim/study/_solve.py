"""Solve a study, with executor and store, in one call."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Literal

from ..background import Cancelled, Observer
from ..scene.cost import pilot_cost_s
from ..scene.solve import solve_scene
from ..specimen.stops import member
from ._errors import ClusterLost
from ._executor import Executor, Solver, ThreadExecutor
from ._grid import GridPlan
from ._queue import Points, StudyEnd, run_points
from ._results import StudyResults, open_study, results_of
from ._store import MemoryStore, Store
from ._study import (
    Study,
    study_solver,
)

BUNDLE_S, LANES_S = 0.05, 6.0
"""Computing time of a bundle, and of a bundle that is solved in SIMD batches [s]. Both are long compared with
the milliseconds of a transfer on a cluster."""


def _points(study: Study) -> Points:
    solver = study_solver(study)
    return Points(study, study.starts, solver, BUNDLE_S if solver is solve_scene else LANES_S)


def planned_work_s(study: Study) -> float:
    """Return the expected computing time of all points of a study on one core [s].

    No point is computed, except in pilot runs of about a second if points have a target.

    >>> from vibench.sim.study import Study
    >>> study = Study(frequencies_hz=(200.0, 260.0), amplitudes_m=(1e-6,))
    >>> 0.0 < planned_work_s(study) < 60.0
    True
    """
    points = _points(study)
    if study.target is not None:
        return points.grid.size * pilot_cost_s(points.new_scene, points.grid.size)
    return float(points.planned_s.sum())


class ExistingStudy(StrEnum):
    """Action if the file for the results already exists."""

    REFUSE = "refuse"
    RESUME = "resume"


ExistingWord = Literal["refuse", "resume"]


def solve_study(
    study: Study,
    out: Path | None = None,
    existing: ExistingStudy | ExistingWord = ExistingStudy.REFUSE,
    workers: int | None = None,
    cluster: str | None = None,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> StudyResults:
    """Compute a study, or the missing points of its file, and return the results.

    Raises StudyError, for example for a file of another study, a full disk or an unresponsive cluster.

    Parameters
    ----------
    study
        Requested study.
    out
        File for the results, ``NAME.h5``; None to keep the results in memory.
    existing
        Whether to refuse an existing file or to resume it. Resuming computes missing points, or creates the
        file if it does not exist.
    workers
        Number of threads; None for one per processor.
    cluster
        Address of a Dask scheduler, whose workers are used instead of threads.
    observer, cancelled
        Functions for progress and cancellation, called in the calling thread.

    Returns
    -------
    StudyResults
        Results; partial if cancelled.
    """
    solver = study_solver(study)
    with executor_of(workers, cluster, solver) as executor, store_of(study, out, existing) as store:
        run_study(study, executor, store, observer, cancelled)
        arrays = store.arrays
    return results_of(study, arrays) if out is None else open_study(out)


@contextmanager
def store_of(plan: GridPlan, out: Path | None, existing: ExistingStudy | ExistingWord) -> Iterator[Store]:
    """Open the store of a plan: a new file, a file to be resumed, or memory."""
    existing = member(ExistingStudy, existing)
    if out is None:
        yield MemoryStore(plan)
        return
    from ._file_store import FileStore  # noqa: PLC0415 - h5py takes longer than a short answer

    is_there = existing is ExistingStudy.RESUME and out.exists()
    with FileStore(out, plan) if is_there else FileStore.create(out, plan) as store:
        yield store


@contextmanager
def executor_of(workers: int | None, cluster: str | None, solver: Solver = solve_scene) -> Iterator[Executor]:
    """Open the executor: ``workers`` threads, or the workers of the Dask scheduler at ``cluster``."""
    executor = ThreadExecutor(workers, solver) if cluster is None else _cluster_executor(cluster, solver)
    with closing(executor):
        yield executor


def _cluster_executor(address: str, solver: Solver) -> Executor:
    try:
        from ._cluster import ClusterExecutor  # noqa: PLC0415 - Dask is optional, and slow to import
    except ModuleNotFoundError as error:
        raise ClusterLost(
            f"A cluster needs Dask, and {error.name} is not installed;"
            " install vibench with its extra 'cluster'."
        ) from error
    return ClusterExecutor(address, solver)


def run_study(
    study: Study,
    executor: Executor,
    store: Store,
    observer: Observer | None = None,
    cancelled: Cancelled | None = None,
) -> StudyEnd:
    """Compute every point that is missing in the store, beginning with the longest.

    Results do not depend on the executor or the order of computation. A point that continues another point
    waits for the result of that point. An error in a scene is stored as the result of its point. Raises
    StudyError when the store or the executor fails; results stored earlier are safe.

    Parameters
    ----------
    study, executor, store
        Study, executor of its scenes, and store of the results.
    observer
        Function that is called after each group of results.
    cancelled
        Function that is called between results and returns True to end the run.
    """
    return run_points(_points(study), executor, store, observer, cancelled)
