"""Verdicts on steadiness for motions of known kind: periodic, aperiodic, unsettled."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.acquisition.control.steadiness import in_drives, judgement_of
from vibench.acquisition.excitation.plan import Settling
from vibench.acquisition.recording import Steadiness

RULE = Settling()


def points(count, *columns):
    """Return coefficients of ``count`` periods: a unit fundamental, plus the given values for each order."""
    table = np.zeros((count, 5), np.complex128)
    table[:, 1] = 1.0
    for order, values in columns:
        table[:, order] += values
    return table


def noise(count, share, seed=0):
    random = np.random.default_rng(seed)
    return (
        share * (random.standard_normal((count, 5)) + 1j * random.standard_normal((count, 5))) / np.sqrt(10)
    )


@settings(max_examples=30, deadline=None)
@given(period=st.integers(1, 8), depth=st.floats(0.05, 0.5), seed=st.integers(0, 99))
def test_a_motion_that_repeats_after_k_periods_has_period_k(period, depth, seed):
    pattern = np.random.default_rng(seed).standard_normal(period)
    pattern[0] = np.abs(pattern).sum() + 3.0  # no shorter period, not even approximately by chance
    signal = points(300, (0, depth * np.resize(pattern, 300))) + noise(300, 1e-3)
    found = judgement_of(signal, RULE)
    assert (found.steadiness, found.period) == (Steadiness.PERIODIC, period)
    assert found.scatter < 0.003


@pytest.mark.parametrize("periods_of_decay", [20, 70, 200])
def test_settling_lasts_until_a_transient_has_decayed(periods_of_decay):
    decay = 0.5 * np.exp(-np.arange(3000) / periods_of_decay)
    turning = np.exp(0.3j * np.arange(3000))
    for transient in (decay, decay * turning):
        first = next(
            n for n in range(80, 3000, 10) if judgement_of(points(n, (1, transient[:n])), RULE).period == 1
        )
        assert abs(decay[first]) < 3 * RULE.tolerance


def test_a_transient_is_never_called_aperiodic():
    count = np.arange(1200)
    for turn in (0.0, 0.3, 1.9):
        transient = 2.0 * np.exp(-count / 250 + 1j * turn * count)
        signal = points(1200, (1, transient))
        verdicts = {judgement_of(signal[:n], RULE).steadiness for n in range(400, 1200, 40)}
        assert Steadiness.APERIODIC not in verdicts


def chaos(count, seed):
    """Return a sequence of the logistic map at 3.9 with random initial value and zero mean."""
    value = np.empty(count)
    value[0] = np.random.default_rng(seed).uniform(0.2, 0.8)
    for place in range(1, count):
        value[place] = 3.9 * value[place - 1] * (1 - value[place - 1])
    return value - value.mean()


def test_stationary_chaos_is_called_aperiodic_in_95_percent_of_runs():
    verdicts = [
        judgement_of(points(400, (1, 0.4 * chaos(400, seed))), RULE).steadiness for seed in range(100)
    ]
    assert verdicts.count(Steadiness.APERIODIC) >= 95
    assert Steadiness.PERIODIC not in verdicts


def test_chaos_that_still_grows_or_drifts_is_unsettled():
    growing = np.linspace(0.5, 1.5, 400)
    for seed in range(10):
        for motion in (0.4 * growing * chaos(400, seed), 0.4 * chaos(400, seed) + 0.6 * growing):
            assert judgement_of(points(400, (1, motion)), RULE).steadiness is Steadiness.UNSETTLED


def test_a_quasi_periodic_motion_is_aperiodic():
    golden = 2 * np.pi * (np.sqrt(5) - 1) / 2
    found = judgement_of(points(600, (1, 0.2 * np.exp(1j * golden * np.arange(600)))), RULE)
    assert found.steadiness is Steadiness.APERIODIC


def test_channel_noise_is_not_reported_as_chaos():
    loud = points(600) + noise(600, 0.05)
    assert judgement_of(loud, RULE).steadiness is Steadiness.APERIODIC
    found = judgement_of(loud, RULE, noise=0.05)
    assert (found.steadiness, found.period) == (Steadiness.PERIODIC, 1)
    assert found.noise == pytest.approx(0.05, rel=0.01)


def test_the_stated_uncertainty_of_scatter_covers_how_the_scatter_varies_between_measurements():
    found = [judgement_of(points(81) + noise(81, 0.004, seed), Settling(periods=81)) for seed in range(300)]
    scatter = np.array([each.scatter for each in found])
    assert scatter.mean() == pytest.approx(0.004, rel=0.03)
    # The stated value assumes one degree of freedom per period; white noise has ten, and less scatter.
    assert scatter.std() <= np.mean([each.scatter_u for each in found])


def test_a_motion_with_too_few_periods_is_unsettled():
    assert judgement_of(points(40), RULE).steadiness is Steadiness.UNSETTLED


@pytest.mark.parametrize(
    ("drives", "share", "period"), [(2, 0.1, 2), (3, 0.002, 3), (2, 0.0, 1), (3, 0.0, 1)]
)
def test_the_period_of_a_motion_is_counted_in_drive_periods(drives, share, period):
    """Orders between those of the drive show whether the motion really has the longer period."""
    seen = noise(300, 1e-3)
    seen[:, drives] += 1.0
    seen[:, 1] += share
    assert in_drives(judgement_of(seen, RULE), seen, drives, 0.0).period == period


@pytest.mark.parametrize("kept", [0.5, 0.0])
def test_a_motion_whose_component_at_one_order_does_not_repeat_is_aperiodic(kept):
    """The order keeps its statistics but does not repeat, with and without a constant part."""
    random = np.random.default_rng(3)
    moved = 1.0 + 0.2 * (random.standard_normal((500, 1)) + 1j * random.standard_normal((500, 1)))
    assert judgement_of(moved + kept, RULE).steadiness is Steadiness.APERIODIC
