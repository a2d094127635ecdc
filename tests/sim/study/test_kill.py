"""A study survives ``kill -9`` at any time and resumes with the missing points."""

import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.sim.study import study_child as child
from vibench.sim import solve_scene
from vibench.sim.study import PointState, ThreadExecutor, open_study, run_study, solve_study
from vibench.sim.study._file_store import FileStore
from vibench.sim.study._grid import SESSION, STATE
from vibench.sim.study._queue import StudyEnd

CHILD = Path(__file__).with_name("study_child.py")

PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def truth():
    return solve_study(child.STUDY)


def run_and_kill(path, words, after_answers, delay_s, program=CHILD):
    """Run the study in another process and kill it; return the number of points reported as stored."""
    with words.open("wb") as out:
        process = subprocess.Popen([sys.executable, str(program), str(path)], stdout=out)
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


def resume(path):
    """Resume the study in this process and return the computed scenes."""
    begun = []

    def solve_and_note(scene):
        begun.append(scene)
        return solve_scene(scene)

    executor = ThreadExecutor(2, solve_and_note)
    with FileStore(path, child.STUDY) as store:
        end = run_study(child.STUDY, executor, store)
    executor.close()
    assert end is StudyEnd.COMPLETE
    return begun


@pytest.mark.thorough
def test_a_killed_and_resumed_study_gives_the_results_of_an_uninterrupted_study(
    tmp_path, truth, require_equal
):
    path, luck = tmp_path / "a.h5", random.Random(0)
    promised = run_and_kill(path, tmp_path / "words", luck.randint(1, 40), luck.uniform(0.0, 0.4))
    kept = open_study(path)
    is_kept = kept.arrays[STATE] == PointState.DONE
    assert np.count_nonzero(is_kept) >= promised
    for name in ("response_i", "final_state", "scene"):
        np.testing.assert_array_equal(kept.arrays[name][is_kept], truth.arrays[name][is_kept])
    begun = resume(path)
    results = open_study(path)
    # Stored points are unchanged, and exactly the missing points are computed.
    assert len(begun) == np.count_nonzero(~is_kept)
    np.testing.assert_array_equal(results.arrays[SESSION][is_kept], kept.arrays[SESSION][is_kept])
    require_equal(results, truth)
