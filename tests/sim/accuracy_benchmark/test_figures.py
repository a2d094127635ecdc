"""The sentence on each motion agrees with its table on which accuracy levels improve the result."""

import pytest

from benchmarks.accuracy_motions import LevelFigures, Motion, MotionBenchmark, Regime
from vibench.sim import Accuracy


def benchmark(*state_errors, regime=Regime.PERIODIC):
    levels = tuple(
        LevelFigures(accuracy, cost, error, 0.0, 0.0, 1.0, 0.032, -2.0, 0.0)
        for accuracy, cost, error in zip(Accuracy, (1e-3, 1.1e-3, 2e-3), state_errors, strict=True)
    )
    return MotionBenchmark(Motion(regime, "power:3", 150.0, 10e-6), 2.0, levels)


@pytest.mark.parametrize(
    ("state_errors", "said", "without"),
    [
        ((7.8e-7, 5.7e-8, 5.8e-12), "Each level reduces the state error", []),
        ((1.3e-8, 1.8e-8, 2.4e-13), "Only `reference` reduces the state error", ["standard"]),
        ((1.3e-8, 1.3e-8, 2.4e-13), "Only `reference` reduces the state error", ["standard"]),
        ((1.3e-6, 1.3e-11, 1.2e-11), "`standard` reduces the state error, `reference`", ["reference"]),
        ((1.3e-8, 1.0e-8, 0.9e-8), "All levels are about equally accurate", ["standard", "reference"]),
    ],
)
def test_an_accuracy_level_without_improvement_is_reported_as_useless(state_errors, said, without):
    found = benchmark(*state_errors)
    assert found.advice.startswith(said)
    assert found.advice.endswith("`reference` takes 2.0 times as long as `quick`.")
    assert [level.accuracy.value for level, _ in found.without_gain] == without


def test_accuracy_levels_that_cannot_differ_are_not_reported_as_useless():
    assert benchmark(9.9e-14, 9.9e-14, 9.9e-14, regime=Regime.FREE).without_gain == ()
    assert benchmark(None, None, None, regime=Regime.CHAOTIC).without_gain == ()
    assert "conditions (3.2% at `quick`)" in benchmark(None, None, None, regime=Regime.CHAOTIC).advice
