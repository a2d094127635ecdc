"""Measurements are draws of their twins: ranks over twenty seeds, and other rigs and levels."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "twin_agreement.py"


@pytest.mark.slow
@pytest.mark.timeout(1700)
@pytest.mark.parametrize("scenes", [("--ranks", "20"), ("--rigs", "10", "--seed", "3")])
def test_measured_values_have_every_rank_and_lie_outside_no_more_often_than_by_chance(scenes):
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), *scenes, "--json"], capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)["summary"]
    assert found["quantities"] >= 20
    assert found["chance_of_as_many_outside"] > 1e-3
    # The quantities of one measurement are not quite independent.
    assert found["p_of_even_ranks"] > 1e-3
