"""Solve a study: workers, storage and results in one call."""

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from ..background import Cancelled, Observer
from ..scene.cost import expected_cost_s, pilot_cost_s
from ..scene.scene import Given, Rest, Scene
from ..scene.solve import Solved, solve_scene
from ..specimen.outcome import Outcome
from ..specimen.state import Floats
from ..specimen.stops import chosen
from ._errors import ClusterLost
from ._executor import Executor, Solver, ThreadExecutor
from ._grid import (
    CONTINUES,
    DURATION,
    FINAL_STATE,
    IDENTITY,
    IDENTITY_DIGITS,
    MESSAGE,
    PHASE,
    TAKEN,
    Cell,
    Grid,
    GridPlan,
    PointState,
)
from ._queue import NOBODY, StudyEnd, run_points
from ._results import StudyResults, open_study, results_of
from ._store import Arrays, MemoryStore, PointAnswer, Store, cells_of, cut_text
from ._study import GivenStart, Start, Study, continued_from, study_solver

# Scenes of a study's points: their starts, and the stored part of their results.
#
# The identity of a scene is a digest of its content, the same in every process on every machine.

_scenes = TypeAdapter(Scene)


def scene_identity(scene: Scene, continued: str = "") -> str:
    """Return the digest of a scene's content.

    Parameters
    ----------
    scene
        Scene. Every bit of its numbers affects the digest; the order of fields does not.
    continued
        Identity of the scene that this one continues, if any. It replaces state and phase at the start, which
        follow from it.
    """
    content = _scenes.dump_python(scene, mode="python")
    # A name does not change the motion.
    content["start"].pop("name", None)
    if content["target"] is None:
        # Keep the digests of files that are older than targets.
        del content["target"]
    if continued:
        content["start"] = {"continues": continued}
        del content["drive"]["phase_rad"]
    # Python writes the shortest digits that represent a float exactly, and infinity as a word.
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:IDENTITY_DIGITS]


PLANNED = 2000
"""Most points that are planned individually; in a larger study, every n-th point represents those up to
the next."""


def predecessors(grid: Grid, starts: Sequence[object]) -> NDArray[np.int64]:
    """Return the point that each point of ``starts`` continues, or NOBODY, shape (points,)."""
    blocks = np.full(grid.shape, NOBODY)
    numbers = np.arange(grid.size).reshape(grid.shape)
    for index, start in enumerate(starts):
        match start:
            case Start.UP:
                blocks[..., index, 1:] = numbers[..., index, :-1]
            case Start.DOWN:
                blocks[..., index, :-1] = numbers[..., index, 1:]
            case _:
                pass
    return blocks.reshape(-1)


def planned_times(grid: Grid, planned: Callable[[int], float]) -> Floats:
    """Return the time that each point is ``planned`` to take [s], shape (points,)."""
    every = max(1, math.ceil(grid.size / PLANNED))
    some = [planned(number) for number in range(0, grid.size, every)]
    return np.repeat(some, every)[: grid.size]


def continued_point(before: int, arrays: Arrays) -> int:
    """Return ``before``, or NOBODY if ``arrays`` contain no finite final state of this predecessor."""
    if before == NOBODY or not np.all(np.isfinite(arrays[FINAL_STATE][before].astype(np.float64))):
        return NOBODY
    return before


def end_phase(frequency_hz: float, before: int, arrays: Arrays) -> float:
    """Return the phase [rad] at the end of point ``before`` in ``arrays``; the next point continues there."""
    turns = math.fmod(frequency_hz * float(arrays[DURATION][before]), 1.0)
    return math.fmod(2.0 * math.pi * turns + float(arrays[PHASE][before]), 2.0 * math.pi)


def failed_point(number: int, error: BaseException) -> PointAnswer:
    """Return the stored result of scene ``number`` that ended in ``error``."""
    match error:
        case ValueError():
            message = str(error)
        case _:
            message = f"{type(error).__name__}: {error}"
    return PointAnswer(number, PointState.FAILED, {MESSAGE: cut_text(message)})


BUNDLE_S, LANES_S = 0.05, 0.5
"""Worker time of a bundle [s], long compared with a transfer on a cluster of a few milliseconds; and of a
bundle for SIMD batches."""


class Expansion:
    """Scenes of a study, created on demand."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self.grid = study.grid
        self._solver = study_solver(study)
        self.bundle_s = BUNDLE_S if self._solver is solve_scene else LANES_S

    @cached_property
    def after(self) -> NDArray[np.int64]:
        """Return the point that each point continues, or NOBODY, shape (points,)."""
        return predecessors(self.grid, self._study.starts)

    @cached_property
    def planned_s(self) -> Floats:
        """Return the planned time of each point, shape (points,)."""
        return planned_times(self.grid, self._planned)

    def wanted(self, arrays: Arrays) -> NDArray[np.int64]:
        """Return every point."""
        return np.arange(len(arrays[FINAL_STATE]))

    def scene(self, number: int, arrays: Arrays) -> Scene:
        """Return the scene of a point whose predecessor, if any, is done.

        If the predecessor has no finite final state, the point starts at rest: ``continues`` is NOBODY.
        Raises ValueError when a scene of these numbers is not allowed.
        """
        before = self._predecessor(number, arrays)
        if before == NOBODY:
            return self.unchained(number)
        state = tuple(float(value) for value in arrays[FINAL_STATE][before])
        x, y, z, vx, vy, vz = state
        name = continued_from(self._study.frequencies_hz[self.grid.place(before)[-1]])
        start = Given((x, y, z, vx, vy, vz), name)
        return self._study.scene(self.grid.place(number), start, self._end_phase(before, arrays))

    def answer(self, number: int, scene: Scene, solved: Solved, arrays: Arrays) -> PointAnswer:
        """Return the stored results of a prediction."""
        is_at_end = solved.prediction.outcome == Outcome.REACHED_END
        cells = {**cells_of(solved.prediction), **self._origin(number, scene, arrays), TAKEN: solved.taken_s}
        state = PointState.DONE if is_at_end else PointState.STOPPED
        return PointAnswer(number, state, cells, solved.taken_s)

    def failure(self, number: int, error: BaseException) -> PointAnswer:
        """Return the stored results of a failed scene."""
        return failed_point(number, error)

    def _origin(self, number: int, scene: Scene, arrays: Arrays) -> dict[str, Cell]:
        """Return the start and the identity of a point's scene."""
        before = self._predecessor(number, arrays)
        known = "" if before == NOBODY else bytes(arrays[IDENTITY][before]).decode()
        return {
            CONTINUES: before,
            PHASE: scene.drive.phase_rad,
            IDENTITY: scene_identity(scene, known).encode(),
        }

    def _predecessor(self, number: int, arrays: Arrays) -> int:
        return continued_point(int(self.after[number]), arrays)

    def _end_phase(self, before: int, arrays: Arrays) -> float:
        """Return the phase at which the predecessor's drive stopped, to continue without a jump."""
        return end_phase(self._study.frequencies_hz[self.grid.place(before)[-1]], before, arrays)

    def unchained(self, number: int) -> Scene:
        """Return the scene of a point that does not continue another."""
        place = self.grid.place(number)
        start = self._study.starts[place[-2]]
        match start:
            case GivenStart():
                return self._study.scene(place, Given(start.state, start.label))
            case _:
                return self._study.scene(place, Rest())

    def _planned(self, number: int) -> float:
        """Return the planned time of a point; 0 if its scene is not allowed."""
        try:
            return expected_cost_s(self.unchained(number), self._solver)
        except ValueError:
            return 0.0


def planned_work_s(study: Study) -> float:
    """Return the planned time of all points of a study on one core [s].

    No point is run, except in a pilot of about a second where points have a target.

    >>> from vibench.sim.study import Study
    >>> study = Study(frequencies_hz=(200.0, 260.0), amplitudes_m=(1e-6,))
    >>> 0.0 < planned_work_s(study) < 60.0
    True
    """
    points = Expansion(study)
    if study.target is not None:
        return points.grid.size * pilot_cost_s(points.unchained, points.grid.size)
    return float(points.planned_s.sum())


class ExistingStudy(StrEnum):
    """Treatment of an existing file."""

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
    """Compute a study, or the missing part of its file.

    Raises StudyError, for example for a file of another study, a full disk or a cluster that does not answer.

    Parameters
    ----------
    study
        Requested study.
    out
        File for the results, ``NAME.h5``; in memory only when None.
    existing
        Whether an existing file is refused or resumed. Resuming computes the missing points; a missing file
        is created.
    workers
        Number of threads; one per processor when None.
    cluster
        Address of a Dask scheduler, whose workers compute instead.
    observer, cancelled
        Called in the calling thread.

    Returns
    -------
    StudyResults
        Complete, or partial if cancelled.
    """
    solver = study_solver(study)
    with executor_of(workers, cluster, solver) as executor, store_of(study, out, existing) as store:
        run_study(study, executor, store, observer, cancelled)
        arrays = store.arrays
    return results_of(study, arrays) if out is None else open_study(out)


@contextmanager
def store_of(plan: GridPlan, out: Path | None, existing: ExistingStudy | ExistingWord) -> Iterator[Store]:
    """Open the store of a plan: a new or continued file, or memory."""
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
    """Return the executor: ``workers`` threads, or the workers of the Dask scheduler at ``cluster``."""
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
    """Compute every point that is missing in the store, longest first.

    Results do not depend on the executor or the order: scenes are independent, and a point that continues
    another waits for it. An error in a scene becomes the result of that point. Raises StudyError when the
    store or the executor fails; results stored before are kept.

    Parameters
    ----------
    study, executor, store
        Study, executor of its scenes, and store of the results.
    observer
        Called after every batch of results.
    cancelled
        Called between results; True ends the run.
    """
    return run_points(Expansion(study), executor, store, observer, cancelled)
