"""Intervals hold as often as they say, right models stay, wrong ones are refused and named: on random rigs.

FIT_DRAWS=N and FIT_SEED=S in the environment ask for more draws, and for others; shards are other seeds.
"""

import importlib.util
import math
import os
import sys
from pathlib import Path

import pytest

DRAWS, SEED = int(os.environ.get("FIT_DRAWS", "60")), int(os.environ.get("FIT_SEED", "7"))


@pytest.fixture(scope="module")
def coverage():
    """Give the benchmark whose table the document has."""
    place = Path(__file__).parents[3] / "benchmarks" / "fit_coverage.py"
    spec = importlib.util.spec_from_file_location("fit_coverage", place)
    module = importlib.util.module_from_spec(spec)
    sys.modules["fit_coverage"] = module
    spec.loader.exec_module(module)
    return module


def below(share, draws):
    """Three standard deviations of a binomial below its mean."""
    return draws * share - 3 * math.sqrt(draws * share * (1 - share))


@pytest.mark.slow
def test_intervals_of_right_models_hold_and_none_is_refused(coverage):
    found = coverage.counted("right model", 5 * DRAWS, SEED)
    assert found.refused <= 1 + 3 * math.sqrt(0.001 * found.draws)
    # Four intervals share a rig and its clock: their number counts as that of the rigs.
    assert found.held / found.intervals > below(0.95, found.draws) / found.draws


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", ["m0 +3 %", "m1 +3 %", "c0 x3", "vibrometer +1 %", "extra mode, 1.2 kHz", "friction"]
)
def test_wrong_models_are_refused_and_the_culprit_is_named_first(coverage, case):
    found = coverage.counted(case, DRAWS // 4, SEED)
    assert found.above_noise > 0
    assert found.refused >= below(0.95, found.above_noise)
    assert found.named_first >= below(0.6, found.refused)
