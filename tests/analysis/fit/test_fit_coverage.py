"""Intervals hold as often as they say, right models stay, wrong ones are refused and named: on random rigs.

FIT_DRAWS=N and FIT_SEED=S in the environment ask for more draws, and for others; shards are other seeds.
"""

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

DRAWS, SEED = os.environ.get("FIT_DRAWS", "60"), os.environ.get("FIT_SEED", "7")
BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "fit_coverage.py"
"""Whose table the document has."""


def counted(case, draws):
    """Let the benchmark count one case."""
    how = ["--case", case, "--draws", str(draws), "--seed", SEED, "--json"]
    told = subprocess.run(
        [sys.executable, BENCHMARK, *how], capture_output=True, text=True, check=True
    ).stdout
    (found,) = json.loads(told)
    return SimpleNamespace(**found)


def below(share, draws):
    """Three standard deviations of a binomial below its mean."""
    return draws * share - 3 * math.sqrt(draws * share * (1 - share))


@pytest.mark.slow
@pytest.mark.timeout(1700)
def test_right_models_are_accepted_with_valid_intervals():
    found = counted("right model", 5 * int(DRAWS))
    assert found.refused <= 1 + 3 * math.sqrt(0.001 * found.draws)
    # Four intervals share a rig and its clock: their number counts as that of the rigs.
    assert found.held / found.intervals > below(0.95, found.draws) / found.draws


@pytest.mark.slow
@pytest.mark.timeout(1700)
@pytest.mark.parametrize(
    "case",
    [
        "m0 +3 %",
        "m1 +3 %",
        "c0 x3",
        "vibrometer +1 %",
        "extra mode, 1.2 kHz",
        "friction",
        "table +10 %",
        "gaps 35/55 um",
    ],
)
def test_wrong_models_are_refused_and_the_wrong_value_named_first(case):
    found = counted(case, int(DRAWS) // 4)
    assert found.above_noise > 0
    assert found.refused >= below(0.95, found.above_noise)
    assert found.named_first >= below(0.6, found.refused)
