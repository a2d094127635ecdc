"""The benchmark of accuracy levels: stated accuracies are met, and the independent solution is right."""

import numpy as np
import pytest

from benchmarks.accuracy_motions import (
    MOTIONS,
    Motion,
    Regime,
    Thoroughness,
    measure_motion,
    settled_state,
)
from benchmarks.independent_solution import independent_state, state_error
from vibench.sim import Accuracy, integrate

SHORT = Thoroughness(span_s=0.05)


@pytest.mark.parametrize(
    "motion", [m for m in MOTIONS if m.regime is not Regime.CHAOTIC], ids=lambda m: m.name
)
def test_every_accuracy_level_meets_its_stated_accuracy(motion):
    start = settled_state(motion)
    span_s = round(0.1 * motion.frequency_hz) / motion.frequency_hz
    truth = independent_state(motion.specimen, motion.drive, span_s, start)
    for level in Accuracy:
        found = integrate(motion.specimen, motion.drive, span_s, level, start).final_state
        assert state_error(found, truth) <= level.promise


def test_higher_accuracy_levels_improve_periodic_motions_but_not_chaotic_motions():
    periodic = measure_motion(MOTIONS[1], SHORT)
    quick, _, reference = periodic.levels
    assert reference.state_error < 5e-2 * quick.state_error
    assert quick.response_i_error > reference.response_i_error == 0.0
    assert Accuracy.REFERENCE not in [level.accuracy for level, _ in periodic.without_gain]


def test_chaotic_scatter_exceeds_differences_between_accuracy_levels():
    chaotic = measure_motion(MOTIONS[-1], SHORT)
    for level in chaotic.levels:
        assert level.state_error is None
        assert level.response_i_scatter > 0.005
        assert level.exponent_per_s > 50
    means = [level.response_i for level in chaotic.levels]
    assert np.std(means) / np.mean(means) < 2 * chaotic.levels[0].response_i_scatter
    assert "`quick` is sufficient" in chaotic.advice


def test_a_motion_that_is_not_of_the_declared_kind_is_refused():
    with pytest.raises(ArithmeticError, match="is called periodic"):
        settled_state(Motion(Regime.PERIODIC, "hertz", 260.0, 5e-6))
