import numpy as np
import pytest

from vibench.sim.scene.prediction import MotionKind
from vibench.sim.scene.repetition import Growth, Repetition, Sharpness, kind_of, longest_section, repetition

OMEGA = 600.0
SHARP = Sharpness(tolerance=1e-6, noise=1e-10)
FORGETTING = 10.0
COUNT = longest_section(FORGETTING)


def section_of(values):
    """Return section states with x proportional to ``values`` and velocities in proportion to x."""
    values = np.asarray(values, dtype=float)
    return np.outer(values, [1.0, 0.5, 0.2, OMEGA, 0.1 * OMEGA, 0.0]) * 1e-6


@pytest.mark.parametrize("period", [1, 2, 3, 7, 12, 32])
def test_a_repeating_poincare_section_has_its_shortest_period(period):
    one = 1.0 + np.random.default_rng(period).uniform(-0.5, 0.5, period)
    found = repetition(section_of(np.resize(one, COUNT)), OMEGA, FORGETTING, SHARP)
    assert found == Repetition(period, 0.0)


def test_a_decaying_motion_counts_as_settled_if_its_remaining_transient_is_small():
    steps = np.arange(COUNT)
    slow = 1.0 + 1e-3 * np.exp(-steps / (3.0 * FORGETTING))
    assert repetition(section_of(slow), OMEGA, FORGETTING, SHARP) is None
    left = 1e-8
    done = 1.0 + left * np.exp((COUNT - 1 - steps) / FORGETTING)
    found = repetition(section_of(done), OMEGA, FORGETTING, SHARP)
    assert found is not None
    assert left < found.distance < 3.0 * left


def test_an_endless_slow_drift_does_not_count_as_repeating():
    drift = 1.0 + 1e-7 * np.arange(COUNT)
    assert repetition(section_of(drift), OMEGA, FORGETTING, SHARP) is None


def test_quasi_periodic_motion_and_noise_do_not_count_as_repeating():
    torus = 1.0 + 0.1 * np.sin(np.sqrt(2.0) * np.arange(COUNT))
    noise = np.random.default_rng(1).uniform(0.5, 1.5, COUNT)
    assert repetition(section_of(torus), OMEGA, FORGETTING, SHARP) is None
    assert repetition(section_of(noise), OMEGA, FORGETTING, SHARP) is None


def test_alternating_values_that_differ_by_5_millionths_give_no_verdict():
    nearly_one = np.resize([1.0, 1.0 + 5e-6], COUNT)
    assert repetition(section_of(nearly_one), OMEGA, FORGETTING, SHARP) is None


def test_a_poincare_section_of_five_points_gives_no_verdict():
    assert repetition(section_of(np.ones(5)), OMEGA, FORGETTING, SHARP) is None


@pytest.mark.parametrize(
    ("logarithms", "kind"),
    [
        ([5.0] * 20, MotionKind.CHAOTIC),
        ([20.0, 20.0, 0.0, 0.0], MotionKind.UNDECIDED),
        ([0.01, -0.02] * 10, MotionKind.QUASI_PERIODIC),
        ([-2.0] * 20, MotionKind.UNDECIDED),
        ([], MotionKind.UNDECIDED),
    ],
    ids=["steady growth", "growth that ended", "neither", "still settling", "not looked at"],
)
def test_the_growth_of_perturbations_identifies_an_aperiodic_motion(logarithms, kind):
    growth = Growth(np.array(logarithms), 0.5 * len(logarithms))
    assert kind_of(None, growth, fading_s=0.25) is kind


def test_a_repeating_poincare_section_is_periodic_for_any_growth_of_perturbations():
    assert kind_of(Repetition(3, 0.0), Growth(np.array([50.0]), 1.0), 0.25) is MotionKind.PERIODIC
