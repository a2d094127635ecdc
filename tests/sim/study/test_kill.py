"""A study or a map survives ``kill -9`` at any time and resumes with the missing points."""

import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.sim.study import study_child as child
from vibench.sim.study import ExistingStudy, PointState
from vibench.sim.study._grid import SESSION, STATE

from .conftest import OF_THE_OCCASION

CHILD = Path(__file__).with_name("study_child.py")
PATIENCE_S = 60.0


def run_and_kill(kind, path, words, after_answers, delay_s):
    """Compute the plan in another process and kill it; return the number of points reported as stored."""
    with words.open("wb") as out:
        process = subprocess.Popen([sys.executable, str(CHILD), kind, str(path)], stdout=out)
        deadline_s = time.monotonic() + PATIENCE_S
        while last_count(words) < after_answers and process.poll() is None:
            assert time.monotonic() < deadline_s
        try:
            process.wait(timeout=delay_s)
        except subprocess.TimeoutExpired:
            process.kill()
        process.wait()
    return last_count(words)


def last_count(words):
    """Return the last complete number in a text file whose last line may be cut."""
    numbers = words.read_text().split("\n")[:-1]
    return int(numbers[-1]) if numbers else 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "kills"), [("study", 1), ("map", 1), pytest.param("map", 5, marks=pytest.mark.slow)]
)
def test_results_after_a_kill_and_a_resume_equal_uninterrupted_results(tmp_path, kind, kills):
    plan, solve, open_results = child.PLANS[kind]
    truth = solve(plan)
    path, luck = tmp_path / "a.h5", random.Random(kills)
    sessions = np.full(plan.grid.size, -1)
    for session in range(kills):
        words = tmp_path / f"words-{session}"
        promised = run_and_kill(kind, path, words, luck.randint(1, 40), luck.uniform(0.0, 0.1))
        kept = open_results(path).arrays
        is_kept = kept[STATE] == PointState.DONE
        assert np.count_nonzero(is_kept) >= promised
        for name in ("response_i", "motion", "final_state"):
            np.testing.assert_array_equal(kept[name][is_kept], truth.arrays[name][is_kept])
        # Points of earlier sessions are not computed again.
        was_kept = sessions >= 0
        np.testing.assert_array_equal(kept[SESSION][was_kept], sessions[was_kept])
        sessions[is_kept] = kept[SESSION][is_kept]
    results = solve(plan, path, ExistingStudy.RESUME, workers=2)
    np.testing.assert_array_equal(results.arrays[SESSION][is_kept], sessions[is_kept])
    for name in results.arrays.keys() - set(OF_THE_OCCASION):
        is_float = results.arrays[name].dtype.kind == "f"
        assert np.array_equal(results.arrays[name], truth.arrays[name], equal_nan=is_float), name
    assert results.is_complete
    assert kind == "study" or results.audit == truth.audit
