"""One call that does it all: a study, workers, a place for the answers, and the answers."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Literal

from ..background import Cancelled, Observer
from ..model.stops import chosen
from ..scene.solve import solve_scene
from ._errors import ClusterLost
from ._executor import Executor, Solver
from ._expansion import study_solver
from ._point_scheduler import GridPlan
from ._results import StudyResults, open_study, results_of
from ._run import run_study
from ._store import MemoryStore, Store
from ._study import Study
from ._threads import ThreadExecutor


class ExistingStudy(StrEnum):
    """What to do with a file that is there already."""

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
    """Compute what a study asks for, and what its file does not hold yet.

    Parameters
    ----------
    study
        What is asked for.
    out
        The file that keeps the answers, ``NAME.h5``; in memory alone when None.
    existing
        Whether a file that is there is refused or resumed. Resuming computes what is missing; a file that
        is not there is begun.
    workers
        Threads of this process; one for each processor when None.
    cluster
        Address of a Dask scheduler, whose workers compute instead.
    observer, cancelled
        Told, and asked, in the calling thread.

    Returns
    -------
    StudyResults
        Complete, or what there was when it was cancelled.

    Raises
    ------
    StudyError
        In one sentence: a file of another study, a cluster that does not answer, a full disk, ...

    """
    solver = study_solver(study)
    with executor_of(workers, cluster, solver) as executor, store_of(study, out, existing) as store:
        run_study(study, executor, store, observer, cancelled)
        arrays = store.arrays
    return results_of(study, arrays) if out is None else open_study(out)


@contextmanager
def store_of(plan: GridPlan, out: Path | None, existing: ExistingStudy | ExistingWord) -> Iterator[Store]:
    """Open the place for the answers to a plan: a file that is made or gone on with, or memory alone."""
    existing = chosen(ExistingStudy, existing)
    if out is None:
        yield MemoryStore(plan)
        return
    from ._file_store import FileStore  # noqa: PLC0415 - h5py takes longer than a short answer

    is_there = existing is ExistingStudy.RESUME and out.exists()
    with FileStore(out, plan) if is_there else FileStore.created(out, plan) as store:
        yield store


@contextmanager
def executor_of(workers: int | None, cluster: str | None, solver: Solver = solve_scene) -> Iterator[Executor]:
    """Open what computes: ``workers`` threads, or the workers of the Dask scheduler at ``cluster``."""
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
