"""A map survives ``kill -9`` at any time and is completed with the same points."""

import random
from pathlib import Path

import numpy as np
import pytest

from tests.sim.maps import map_child as child
from tests.sim.study.test_kill import run_and_kill
from vibench.sim.maps import open_map, solve_map
from vibench.sim.study import ExistingStudy, PointState

HERE = Path(__file__).parent
OF_THE_OCCASION = ("taken", "session")


@pytest.fixture(scope="module")
def truth():
    return solve_map(child.PLAN)


@pytest.mark.thorough
@pytest.mark.parametrize("kills", [1, pytest.param(5, marks=pytest.mark.slow)])
def test_a_killed_and_resumed_map_equals_an_uninterrupted_map(tmp_path, truth, kills):
    path, luck = tmp_path / "map.h5", random.Random(kills)
    sessions = np.full(child.PLAN.grid.size, -1)
    for session in range(kills):
        promised = run_and_kill(
            path,
            tmp_path / f"words-{session}",
            luck.randint(1, 60),
            luck.uniform(0.0, 0.3),
            HERE / "map_child.py",
        )
        kept = open_map(path)
        is_kept = kept.state.reshape(-1) == PointState.DONE
        assert np.count_nonzero(is_kept) >= promised
        for name in ("response_i", "motion", "final_state"):
            np.testing.assert_array_equal(kept.arrays[name][is_kept], truth.arrays[name][is_kept])
        # Points of earlier sessions are not computed again.
        was_kept = sessions >= 0
        np.testing.assert_array_equal(kept.arrays["session"][was_kept], sessions[was_kept])
        sessions[is_kept] = kept.arrays["session"][is_kept]
    results = solve_map(child.PLAN, path, ExistingStudy.RESUME, workers=2)
    np.testing.assert_array_equal(results.arrays["session"][is_kept], sessions[is_kept])
    for name in results.arrays.keys() - set(OF_THE_OCCASION):
        is_float = results.arrays[name].dtype.kind == "f"
        assert np.array_equal(results.arrays[name], truth.arrays[name], equal_nan=is_float), name
    assert results.is_complete
    assert results.audit == truth.audit
