"""Transient chaos is distinguished from lasting chaos, on synthetic runs and on the specimen."""

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, lyapunov_exponent
from vibench.sim.exponents.lyapunov import ExponentVerdict, Source
from vibench.sim.exponents.tangent_run import FinalMotion, Interval, TangentRun, settling

COUNT = 400
CHAOTIC_SECTION = np.random.default_rng(5).standard_normal((COUNT, 6))


def a_run(growth, section=CHAOTIC_SECTION, impacts=None, is_quiet=False, periods=5):
    struck = np.ones(COUNT, np.int64) if impacts is None else impacts
    return TangentRun(
        interval=Interval(0.02, periods),
        growth=np.asarray(growth, dtype=float)[:, None],
        impacts=struck,
        section=section,
        total_impacts=int(struck.sum()),
        is_quiet=is_quiet,
        final_state=section[-1],
        end_time_s=0.02 * COUNT,
        outcome=Outcome.REACHED_END,
    )


def noise(mean, seed=1):
    return mean + np.random.default_rng(seed).standard_normal(COUNT)


def test_a_final_motion_without_contact_begins_after_the_last_impact():
    impacts = np.where(np.arange(COUNT) < 250, 3, 0)
    found = settling(a_run(noise(2.0), impacts=impacts, is_quiet=True), np.ones(6))
    assert found.motion is FinalMotion.QUIET
    assert found.since == 250


@pytest.mark.parametrize("cycle", [1, 2, 3, 7])
def test_a_periodic_final_motion_begins_where_its_poincare_section_starts_to_repeat(cycle):
    repeated = np.random.default_rng(8).standard_normal((cycle, 6))
    section = CHAOTIC_SECTION.copy()
    section[300:] = repeated[np.arange(100) % cycle]
    found = settling(a_run(noise(2.0), section), np.ones(6))
    assert found.motion is FinalMotion.PERIODIC
    assert found.cycle == cycle
    assert 300 <= found.since + cycle <= 300 + 2 * cycle


def test_a_poincare_section_sampled_within_a_period_is_not_classified_as_periodic():
    found = settling(a_run(noise(2.0), np.ones((COUNT, 6)), periods=0), np.ones(6))
    assert found.motion is FinalMotion.THROUGHOUT


def test_the_time_at_which_the_exponent_drops_to_zero_is_found():
    growth = noise(0.0)
    growth[:260] += 2.0
    found = settling(a_run(growth), np.ones(6))
    assert found.motion is FinalMotion.SETTLED
    assert abs(found.since - 260) < 10


@pytest.mark.parametrize("tail", [1.0, 3.0])
def test_chaos_of_changing_strength_is_not_reported_as_ended(tail):
    growth = noise(2.0)
    growth[200:] += tail - 2.0
    assert settling(a_run(growth), np.ones(6)).motion is FinalMotion.THROUGHOUT


def test_a_periodic_motion_that_turns_chaotic_is_not_reported_as_settled():
    growth = noise(2.0)
    growth[:200] -= 3.0
    assert settling(a_run(growth), np.ones(6)).motion is FinalMotion.THROUGHOUT


def test_no_end_of_chaos_is_found_in_an_exponent_that_scatters_around_zero():
    found = [settling(a_run(noise(0.0, seed)), np.ones(6)).motion for seed in range(40)]
    assert found.count(FinalMotion.SETTLED) == 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("drive", "source"), [(Harmonic(234.0, 5e-6), Source.MODES), (Harmonic(510.0, 50e-6), Source.MULTIPLIERS)]
)
def test_transient_chaos_is_reported_with_its_duration_and_exponent(drive, source):
    # The chaotic lifetime depends on the initial state; the final motion does not.
    spread = np.repeat([2e-5, 2e-2], 3)
    starts = [np.random.default_rng(seed).uniform(-1.0, 1.0, 6) * spread for seed in range(14)]
    found = [lyapunov_exponent(gong2025(), drive, Accuracy.QUICK, initial_state=start) for start in starts]
    settled = [each for each in found if each.source is source]
    assert len(settled) >= 10
    assert all(each.verdict is ExponentVerdict.REGULAR for each in settled)
    exponents = np.array([each.exponent_per_s for each in settled])
    assert exponents == pytest.approx(exponents[0], rel=1e-3)
    chaotic = [each for each in settled if each.transient is not None]
    assert chaotic
    for each in chaotic:
        assert each.transient.exponent_per_s > 50.0
        assert each.transient.exponent_per_s > 3.0 * each.transient.standard_error_per_s
        assert each.transient.impacts > 100
        assert each.transient.until_s == pytest.approx(each.since_s)
        after = each.local_exponents_per_s[each.local_time_s > each.since_s + 1.0]
        assert len(after) < 100 or after.mean() == pytest.approx(each.exponent_per_s, abs=1.0)
