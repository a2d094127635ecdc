"""Bounds in reports hold for short measurements on random rigs; a shard takes about 20 minutes."""

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from scipy.stats import binom

BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "report_coverage.py"
SHARDS = 10
LEAST = 1e-4
"""Probability below which too few bounds hold; a shard has some forty kinds, whose repeats share a rig."""


@pytest.mark.slow
@pytest.mark.timeout(1700)
@pytest.mark.parametrize("shard", range(1, SHARDS + 1))
def test_bounds_of_a_report_hold_on_random_rigs(shard, tmp_path):
    kept = tmp_path / "held.json"
    how = ["--rigs", "125", "--seed", "1", "--shard", f"{shard}/{SHARDS}", "--save", str(kept)]
    subprocess.run([sys.executable, str(BENCHMARK), *how], check=True)
    rows = defaultdict(list)
    for line in kept.read_text("utf-8").splitlines():
        each = json.loads(line)
        if "line by line" not in each["quantity"]:
            rows[each["kind"], each["quantity"], each["is_linear"]].append(abs(each["off"]) <= 1)
    assert rows
    few = {row: sum(held) for row, held in rows.items() if binom.cdf(sum(held), len(held), 0.95) < LEAST}
    assert not few, few
