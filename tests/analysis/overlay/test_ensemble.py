"""Agreement limits have their stated rate, bands their coverage, and ranks are uniform."""

import numpy as np
import pytest
from scipy.stats import chisquare

from vibench.analysis.overlay.draws import Draw, DrawSource, SimulatedRun, all_draws
from vibench.analysis.overlay.driven_rig import Driven
from vibench.analysis.overlay.ensemble import (
    Ending,
    EnsembleCurve,
    PhaseCurve,
    Quantity,
    ensemble_curves,
    escape_rate,
    largest_of_chance,
    z_limit,
)
from vibench.sim import Accuracy, gong2025

FREQUENCY_HZ = np.arange(40.0) + 100.0


def curve(rng, draws, points, shift=0.0, scatter=0.1):
    values = np.exp(scatter * rng.standard_normal((draws + 1, points)))
    return EnsembleCurve("q", FREQUENCY_HZ[:points], values[0] * np.exp(shift), values[1:])


@pytest.mark.thorough
@pytest.mark.parametrize(("draws", "points"), [(5, 1), (16, 1), (16, 40), (8, 40)])
def test_an_agreeing_twin_exceeds_the_limit_in_1_percent_of_cases(draws, points):
    rng = np.random.default_rng(1)
    trials = 3000
    outside = sum(not curve(rng, draws, points).agrees for _ in range(trials))
    # Expected for single values: 30, standard deviation 5.5; few draws determine a curve's tails poorly.
    assert (12 if points == 1 else 3) <= outside <= 50


@pytest.mark.thorough
def test_random_magnitudes_exceed_the_limit_in_1_percent_of_cases():
    rng = np.random.default_rng(8)
    outside = 0
    for _ in range(2000):
        values = np.abs(rng.standard_normal((17, 40)) + 1j * rng.standard_normal((17, 40)))
        outside += not EnsembleCurve("q", FREQUENCY_HZ, values[0], values[1:]).agrees
    # Expected: 20, standard deviation 4.4.
    assert 5 <= outside <= 36


@pytest.mark.thorough
@pytest.mark.parametrize(("scatter", "middle"), [(0.01, np.pi), (0.5, 0.3), (1.5, np.pi), (9.0, 0.3)])
def test_correct_phases_exceed_the_limit_in_1_percent_of_cases_on_the_whole_circle(scatter, middle):
    rng, outside = np.random.default_rng(2), 0
    for _ in range(1000):
        phases = np.angle(np.exp(1j * (middle + scatter * rng.standard_normal((9, 8)))))
        outside += not PhaseCurve("phase", FREQUENCY_HZ[:8], phases[0], phases[1:]).agrees
    assert outside <= 22


@pytest.mark.parametrize("middle", [0.0, 3.1, -3.1])
def test_a_phase_shift_is_found_across_180_degrees_and_reported_in_degrees(middle):
    drawn = middle + 0.02 * np.random.default_rng(3).standard_normal((8, 1))
    late = np.angle(np.exp(1j * (middle + np.radians([20.0]))))
    found = PhaseCurve("phase", FREQUENCY_HZ[:1], late, np.angle(np.exp(1j * drawn)))
    assert not found.agrees
    assert found.rank[0] == 8
    assert found.measured - found.median == pytest.approx(np.radians(20.0), abs=0.03)
    assert found.lower < found.median < found.upper < found.measured
    assert f"phase {np.degrees(late[0]):.2f}° differs from" in found.sentence


def rare_dips(rng, size):
    """Return values as in chaos: one in a hundred lies a third lower."""
    return (1 + 0.05 * rng.standard_normal(size)) * np.where(rng.random(size) < 0.01, 0.67, 1.0)


def long_tails(rng, size):
    return np.abs(1 + 0.02 * rng.standard_t(5, size))


@pytest.mark.parametrize(
    ("drawn", "draws", "points"), [(rare_dips, 16, 1000), (long_tails, 8, 200), (long_tails, 16, 1000)]
)
def test_long_tailed_values_exceed_the_limit_in_1_percent_of_cases(drawn, draws, points):
    """With a limit for normally distributed values, 14 to 100 % would lie outside."""
    rng, outside = np.random.default_rng(6), 0
    for _ in range(100):
        values = drawn(rng, (draws + 1, points))
        outside += not EnsembleCurve("q", np.arange(points), values[0], values[1:]).agrees
    assert outside <= 6


@pytest.mark.parametrize("draws", [5, 16, 200])
def test_limits_estimated_from_few_draws_are_exceeded_in_1_percent_of_cases(draws):
    """With the quantile of the fitted distribution 4.8, 3.1, 2.0, 1.3 and 1.1 % would exceed the limit."""
    largest = np.random.default_rng(10).gumbel(3.7, 0.3, (20000, draws + 1))
    beyond = np.mean([each[0] > largest_of_chance(each[1:]) for each in largest])
    # The rate has a standard deviation of 0.0007.
    assert beyond == pytest.approx(0.01, abs=0.0025)


def test_one_spectral_line_far_from_the_draws_is_outside_their_limit():
    rng = np.random.default_rng(7)
    values = rare_dips(rng, (17, 1000))
    values[0, 500] = 3.0
    found = EnsembleCurve("q", np.arange(1000), values[0], values[1:])
    assert found.outside == 1
    assert found.limit < 8


def test_the_z_score_of_each_draw_is_computed_from_the_other_draws():
    found = curve(np.random.default_rng(9), 9, 40)
    by_hand = [
        EnsembleCurve("q", found.frequency_hz, each, np.delete(found.draws, place, axis=0)).z
        for place, each in enumerate(found.draws)
    ]
    np.testing.assert_allclose(found._z_of_draws, by_hand, rtol=1e-9)


def test_the_95_percent_band_contains_95_percent_of_further_draws():
    rng = np.random.default_rng(2)
    held = np.mean([curve(rng, 16, 40).share_in_band for _ in range(400)])
    assert held == pytest.approx(0.95, abs=0.006)


def test_ranks_of_further_draws_are_uniform():
    rng = np.random.default_rng(3)
    ranks = [int(curve(rng, 9, 1).rank[0]) for _ in range(4000)]
    assert chisquare(np.bincount(ranks, minlength=10)).pvalue > 0.001


def test_a_shifted_measurement_is_outside_the_limit():
    found = curve(np.random.default_rng(4), 16, 40, shift=1.0)
    assert not found.agrees
    assert found.largest_z > z_limit(40) > z_limit(1) == pytest.approx(2.576, abs=1e-3)
    assert "outside" in found.sentence


def test_a_measured_motion_is_compared_only_with_draws_of_the_same_kind_of_motion():
    rng = np.random.default_rng(5)
    kinds = np.array([[1, 0]] * 4 + [[0, 0]] * 12)
    draws = [(Quantity("q", FREQUENCY_HZ[:2], np.exp(0.1 * rng.standard_normal(2)), kind),) for kind in kinds]
    measured = Quantity("q", FREQUENCY_HZ[:2], np.ones(2), np.array([1, 0]))
    (found,) = ensemble_curves([measured], draws)
    assert found.count.tolist() == [4, 16]
    assert found.compared == 1
    assert np.isnan(found.z[0])
    assert np.isfinite(found.z[1])


def test_the_interval_of_the_escape_rate_contains_the_true_rate():
    rng = np.random.default_rng(6)
    per_s, record_s, trials = 0.2, 12.0, 1500
    covered = told = 0
    for _ in range(trials):
        lives = rng.exponential(1 / per_s, 17)
        runs = [Ending("collisions", 0.0, min(life, record_s), life < record_s) for life in lives]
        found = escape_rate(runs[:1], [(each,) for each in runs[1:]])
        if found is None:
            continue
        told += 1
        low, high = found.bounds_per_s
        covered += low <= per_s <= high
    assert told > 0.99 * trials
    # Exact bounds of a small count are conservative.
    assert 0.94 <= covered / told <= 0.99


def test_no_escape_rate_is_given_if_collisions_end_at_the_same_time_in_all_runs():
    runs = [Ending("collisions", 0.0, 60.0 + 0.05 * k, ended=True) for k in range(17)]
    assert escape_rate(runs[:1], [(each,) for each in runs[1:]]) is None
    lasting = [Ending("collisions", 0.0, 90.0, ended=False)] * 17
    assert escape_rate(lasting[:1], [(each,) for each in lasting[1:]]) is None
    # A last plateau without contact is no escape: the collisions lasted as long as the sweep.
    lasting[3] = Ending("collisions", 0.0, 89.8, ended=True)
    assert escape_rate(lasting[:1], [(each,) for each in lasting[1:]]) is None


@pytest.mark.parametrize("shift", [0.0, 0.45])
def test_half_of_the_draws_are_enough_for_a_clear_verdict(shift):
    """Stopping early accepts no wrong twin; `benchmarks/twin_agreement.py --stop` tests this further."""
    rng = np.random.default_rng(12)
    decided = 0
    for _ in range(200):
        whole = curve(rng, 16, 40, shift=shift)
        half = EnsembleCurve(whole.name, whole.frequency_hz, whole.measured, whole.draws[:8])
        decided += half.agrees_clearly
        assert whole.agrees or not half.agrees_clearly
    assert decided > 100 if shift == 0.0 else decided < 20


@pytest.mark.parametrize(
    ("requested", "shift", "alike_each", "made"),
    [
        (16, 0.0, 1, 8),
        (16, 2.0, 1, 16),
        (24, 0.0, 1, 24),
        (5, 0.0, 1, 5),
        # Five of 48 draws are improbable if none of the first 12 shows the measured motion.
        (16, 0.0, 1000, 12),
        (8, 0.0, 1000, 8),
        (8, 0.0, 4, 20),
    ],
)
def test_sampling_stops_at_clear_agreement_or_if_too_few_draws_are_alike(requested, shift, alike_each, made):
    def estimate(number):
        value = np.exp(0.1 * np.random.default_rng(number).standard_normal(3))
        state = np.full(3, (number + 1) % alike_each)
        return Draw(lambda: number, (Quantity("q", FREQUENCY_HZ[:3], value, state),), (), 100.0, 1.0)

    run = SimulatedRun(gong2025(), Driven.GENERATOR, Accuracy.STANDARD, None)
    source = DrawSource(run, requested, 1000, lambda number: number)
    measured = Quantity("q", FREQUENCY_HZ[:3], np.exp(shift * np.ones(3)), np.zeros(3, dtype=np.int64))
    found = all_draws(source, estimate, [measured])
    assert (found.run.draws, len(found.ensemble[0].draws), found.response) == (made, made, 0)
