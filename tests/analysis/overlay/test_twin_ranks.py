"""Measurements are draws of their twins: ranks over twenty seeds, and other rigs and levels; in shards."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

RANKS = [("--ranks", "4", "--first-seed", str(first)) for first in range(1000, 1020, 4)]
RIGS = [("--rigs", "2", "--seed", str(seed)) for seed in range(3, 8)]
"""A shard takes some four minutes on an idle computer."""
BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "twin_agreement.py"


@pytest.mark.slow
@pytest.mark.timeout(1700)
@pytest.mark.parametrize("scenes", [*RANKS, *RIGS], ids=" ".join)
def test_ranks_of_measured_values_are_uniform(scenes):
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), *scenes, "--json"], capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)["summary"]
    assert found["quantities"] >= 4
    assert found["chance_of_as_many_outside"] > 1e-3
    # The quantities of one measurement are not quite independent.
    assert found["p_of_even_ranks"] > 1e-3
