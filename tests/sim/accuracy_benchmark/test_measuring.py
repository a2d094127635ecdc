"""The trade of speed for accuracy: what is promised is kept, and the second opinion is right."""

import numpy as np
import pytest

from vibench.sim import Accuracy, integrate
from vibench.sim.accuracy_benchmark.figures import MOTIONS, Motion, Regime
from vibench.sim.accuracy_benchmark.independent_solution import independent_state, state_error
from vibench.sim.accuracy_benchmark.measuring import SOLVERS, Thoroughness, measure_motion, settled_state
from vibench.sim.specimen.modes import modal_form

SHORT = Thoroughness(span_s=0.05, solver_span_s=0.01)


def test_the_second_opinion_decays_as_the_slowest_mode_does():
    motion = Motion(Regime.FREE, "linear", 260.0, 0.0)
    start = np.array([1e-5, 0.0, -1e-5, 0.01, 0.0, 0.0])
    rates = np.linalg.eigvals(_matrix(motion.specimen))
    exact = _propagated(motion.specimen, start, 0.02)
    assert state_error(independent_state(motion.specimen, motion.drive, 0.02, start), exact) < 1e-11
    assert rates.real.max() < 0


def _matrix(specimen):
    inverse = np.linalg.inv(specimen.mass_matrix)
    top = np.hstack((np.zeros((3, 3)), np.eye(3)))
    low = np.hstack((-inverse @ specimen.stiffness_matrix, -inverse @ specimen.damping_matrix))
    return np.vstack((top, low))


def _propagated(specimen, start, time_s):
    values, vectors = np.linalg.eig(_matrix(specimen))
    return np.real(vectors @ (np.exp(values * time_s) * np.linalg.solve(vectors, start)))


def test_the_second_opinion_tightened_changes_by_less_than_the_reference_level_promises():
    motion = MOTIONS[1]
    start = settled_state(motion)
    span_s = 5 / motion.frequency_hz
    loose = independent_state(motion.specimen, motion.drive, span_s, start, 1e-11)
    tight = independent_state(motion.specimen, motion.drive, span_s, start)
    assert state_error(loose, tight) < Accuracy.REFERENCE.promise


@pytest.mark.parametrize(
    "motion", [m for m in MOTIONS if m.regime is not Regime.CHAOTIC], ids=lambda m: m.name
)
def test_every_level_keeps_its_promise(motion):
    start = settled_state(motion)
    span_s = round(0.1 * motion.frequency_hz) / motion.frequency_hz
    truth = independent_state(motion.specimen, motion.drive, span_s, start)
    for level in Accuracy:
        found = integrate(motion.specimen, motion.drive, span_s, level, start).final_state
        assert state_error(found, truth) <= level.promise


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("motion", [m for m in MOTIONS if m.regime is Regime.PERIODIC], ids=lambda m: m.name)
def test_every_level_keeps_its_promise_over_two_seconds(motion):
    start = settled_state(motion)
    span_s = round(2 * motion.frequency_hz) / motion.frequency_hz
    truth = independent_state(motion.specimen, motion.drive, span_s, start)
    for level in Accuracy:
        found = integrate(motion.specimen, motion.drive, span_s, level, start).final_state
        assert state_error(found, truth) <= level.promise


def test_a_periodic_motion_buys_digits_and_chaos_buys_none():
    periodic = measure_motion(MOTIONS[1], SHORT)
    quick, _, reference = periodic.levels
    assert reference.state_error < 5e-2 * quick.state_error
    assert quick.response_i_error > reference.response_i_error == 0.0
    assert [each.name for each in periodic.solvers] == list(SOLVERS)
    assert all(each.cost > 20 * reference.cost for each in periodic.solvers)
    assert Accuracy.REFERENCE not in [level.accuracy for level, _ in periodic.without_gain]


def test_in_chaos_the_start_matters_more_than_the_level():
    chaotic = measure_motion(MOTIONS[-1], SHORT)
    for level in chaotic.levels:
        assert level.state_error is None
        assert level.response_i_scatter > 0.005
        assert level.exponent_per_s > 50
    means = [level.response_i for level in chaotic.levels]
    assert np.std(means) / np.mean(means) < 2 * chaotic.levels[0].response_i_scatter
    assert "as good as any" in chaotic.advice


def test_a_motion_that_is_not_what_it_is_called_is_refused():
    with pytest.raises(ArithmeticError, match="is called periodic"):
        settled_state(Motion(Regime.PERIODIC, "hertz", 260.0, 5e-6))


def test_the_modes_of_the_engine_are_those_of_the_plain_equations():
    ours = np.sort_complex(np.asarray(modal_form(MOTIONS[0].specimen).rates))
    theirs = np.linalg.eigvals(_matrix(MOTIONS[0].specimen))
    upper = np.sort_complex(theirs[theirs.imag > 0])
    assert ours == pytest.approx(upper, rel=1e-9)
