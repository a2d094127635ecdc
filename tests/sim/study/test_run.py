"""Running a study: reproducible results for any executor, stored errors, immediate cancellation."""

import random
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim import Harmonic, Rest, Scene, gong2025, solve_scene
from vibench.sim.scene.scene import FixedDuration, Given
from vibench.sim.study import (
    InvalidStudy,
    MemoryStore,
    PointState,
    Study,
    ThreadExecutor,
    run_study,
    solve_study,
)
from vibench.sim.study._executor import Reply, solve_timed
from vibench.sim.study._grid import CONTINUES, PHASE
from vibench.sim.study._queue import StudyEnd
from vibench.sim.study._results import results_of
from vibench.sim.study._study import GivenStart

from .conftest import SHORT


@cache
def solve_once(scene):
    """Solve a scene at the first request only: the order of the requests is what varies."""
    return solve_scene(scene)


class UnreliableExecutor:
    """Executor in the calling thread with random order, lost bundles and incomplete replies."""

    def __init__(self, seed, slots):
        self.slots = slots
        self.description = "unreliable"
        self._luck = random.Random(seed)
        self._waiting = []

    def submit(self, bundle):
        self._waiting.append(bundle)

    def replies(self, timeout_s):
        bundle = self._waiting.pop(self._luck.randrange(len(self._waiting)))
        solved = tuple(solve_timed(bundle.scenes, solve_once))
        match self._luck.randrange(4):
            case 0:
                return (Reply(bundle, solved[: self._luck.randrange(len(solved))]),)
            case 1 if len(solved) > 1:
                return (Reply(bundle, (), OSError("the worker died")),)
            case _:
                return (Reply(bundle, solved),)

    def cancel(self):
        self._waiting.clear()
        return ()

    def close(self):
        pass


@pytest.fixture(scope="module")
def small():
    return Study(
        frequencies_hz=[200.0, 230.0, 260.0],
        amplitudes_m=[5e-6, 20e-6],
        starts=("rest", "up", "down"),
        **SHORT,
    )


@pytest.fixture(scope="module")
def truth(small):
    return solve_study(small, workers=1)


@pytest.mark.thorough
@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32), st.integers(1, 9))
def test_neither_completion_order_nor_lost_workers_change_a_result(small, truth, require_equal, seed, slots):
    store = MemoryStore(small)
    assert run_study(small, UnreliableExecutor(seed, slots), store) is StudyEnd.COMPLETE
    require_equal(results_of(small, store.arrays), truth)


@pytest.mark.parametrize("workers", [1, 2, 3, 7])
def test_any_number_of_threads_gives_the_same_results_bit_for_bit(small, truth, require_equal, workers):
    require_equal(solve_study(small, workers=workers), truth)


def single_prediction(frequency_hz, amplitude_m, start):
    """Return the prediction of a single scene."""
    return solve_scene(
        Scene(gong2025(), Harmonic(frequency_hz, amplitude_m), duration=FixedDuration(0.2, 0.1), start=start)
    )


def test_a_chained_point_continues_from_the_final_state_of_its_predecessor(small, truth):
    first = single_prediction(200.0, 20e-6, Rest())
    # 0.2 s at 200 Hz are whole periods, so the drive continues at phase zero.
    second = single_prediction(230.0, 20e-6, Given(first.final_state))
    point = {"amplitude": 20e-6, "frequency": 230.0}
    assert truth.values("response_i", start="up", **point).item() == second.response_i
    assert truth.values("response_i", start="rest", **point).item() != second.response_i
    states = [truth.values("final_state", start=start, **point).ravel() for start in ("up", "down")]
    assert not np.array_equal(*states)


def test_base_motion_is_continuous_between_chained_points_of_a_study():
    study = Study(frequencies_hz=[201.3, 233.7, 260.1], amplitudes_m=[5e-6], starts=["down"], **SHORT)
    results = solve_study(study, workers=1)
    phase = results.values(PHASE).ravel()
    frequency = np.array(study.frequencies_hz)
    assert phase[-1] == 0.0
    base_before = np.sin(2.0 * np.pi * frequency[1:] * 0.2 + phase[1:])
    assert np.allclose(np.sin(phase[:-1]), base_before, atol=1e-9)
    assert list(results.values(CONTINUES).ravel()) != list(range(3))


def test_a_requested_number_selects_one_value_of_an_axis_or_is_refused():
    levels = [5e-6, 5.000000004e-6]
    study = Study(frequencies_hz=[260.0], amplitudes_m=levels, **SHORT)
    results = results_of(study, MemoryStore(study).arrays)
    results.arrays["response_i"][:] = [1.0, 2.0]
    found = [
        results.values("response_i", amplitude=level).item() for level in (*levels, 5e-6 * (1.0 - 4e-10))
    ]
    assert found == [1.0, 2.0, 1.0]
    with pytest.raises(InvalidStudy, match=r"matches several values of amplitude; give one of 5e-06, 5.0000"):
        results.values("response_i", amplitude=5.000000002e-6)
    with pytest.raises(InvalidStudy, match=r"6e-06 matches no value of amplitude; give one of 5e-06"):
        results.values("response_i", amplitude=6e-6)


def test_predictions_name_the_initial_state_of_their_run(truth):
    starts = {(each.start, each.frequency_hz) for each in truth.predictions()}
    assert {("rest", 200.0), ("end at 200 Hz", 230.0), ("end at 260 Hz", 230.0)} <= starts


def test_every_study_point_begins_at_the_requested_initial_state():
    state = (0.0, 2e-5, 0.0, 0.0, 0.05, 0.0)
    study = Study(
        frequencies_hz=[100.0, 130.0],
        amplitudes_m=[5e-6],
        starts=[GivenStart(label="kick", state=state)],
        **SHORT,
    )
    found = list(solve_study(study, workers=2).predictions())
    assert found[1].response_i == single_prediction(130.0, 5e-6, Given(state)).response_i
    assert found[1].start == "kick"


class SolverThatFailsAt:
    """Solver that fails at one frequency."""

    def __init__(self, frequency_hz):
        self._frequency_hz = frequency_hz

    def __call__(self, scene):
        if scene.drive.frequency_hz == self._frequency_hz:
            raise ArithmeticError("a matrix is singular")
        return solve_scene(scene)


def run_with(solver, study, *how):
    """Run a study with a solver; return how the run ended and its results."""
    store, executor = MemoryStore(study), ThreadExecutor(2, solver)
    end = run_study(study, executor, store, *how)
    executor.close()
    return end, results_of(study, store.arrays)


def test_an_error_in_one_scene_affects_only_its_point(small, truth):
    end, results = run_with(SolverThatFailsAt(200.0), small)
    assert end is StudyEnd.COMPLETE
    state = results.state[0, 0, 0]
    assert np.all(state[..., 0] == PointState.FAILED)
    assert np.all(state[..., 1:] == PointState.DONE)
    assert np.isnan(results.values("response_i", frequency=200.0)).all()
    assert np.isfinite(results.values("response_i", frequency=260.0)).all()
    failures = list(results.failures())
    assert len(failures) == 6
    assert all(where["frequency"] == 200.0 and "a matrix is singular" in why for where, why in failures)
    # The successor of the failed point begins at rest and states this.
    restarted = {"start": "up", "frequency": 230.0}
    assert np.isnan(results.values(CONTINUES, **restarted)).all()
    rested = truth.values("response_i", start="rest", frequency=230.0)
    np.testing.assert_array_equal(results.values("response_i", **restarted), rested)


def test_a_cancelled_study_stops_at_once_and_keeps_its_finished_points(study, require_equal):
    seen = []
    begun = []

    def solver(scene):
        begun.append(scene)
        return solve_scene(scene)

    end, results = run_with(solver, study, seen.append, lambda: seen[-1].done >= 10 if seen else False)
    assert end is StudyEnd.CANCELLED
    kept = int(np.count_nonzero(results.state))
    assert 10 <= kept < study.grid.size
    # Every point that had begun was finished and stored; no point began afterwards.
    assert len(begun) == kept
    whole = solve_study(study).values("response_i")
    is_done = results.state == PointState.DONE
    np.testing.assert_array_equal(results.values("response_i")[is_done], whole[is_done])


def test_the_progress_of_a_study_counts_every_point_once_and_ends_with_no_time_left(study):
    seen = []
    solve_study(study, workers=2, observer=seen.append)
    counts = [each.done for each in seen]
    assert counts == sorted(set(counts))
    assert counts[-1] == seen[-1].of == study.grid.size
    assert seen[-1].remaining_s == 0.0
    assert seen[-1].note == ""
