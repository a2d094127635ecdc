"""Stability from small perturbations: known multipliers of held motions, with noise."""

import numpy as np
import pytest

from vibench_fast_loop.fast_loop import motion_slopes
from vibench_fast_loop.law import design_law
from vibench_fast_loop.open_loop_multiplier import (
    OpenLoopMultiplier,
    PerturbedMotion,
    envelope_deviation,
    open_loop_multiplier,
)

from .test_feedback import HARDENING, RATE_HZ, branch, plant

HOLD, CHANGES, LEAD = 5, 20, 3
NOISE = 3e-3, 5e-6
"""Noise of a sample of base [m/s2] and m0 [m/s], on the virtual rig including its converter."""
TARGET = 0.02


def modulations(rng, draws, per_period, count):
    """Return a random square modulation, repeated with the opposite sign, with half-cosine transitions."""
    corners = np.exp(1j * np.pi * (0.25 + 0.5 * rng.integers(0, 4, (CHANGES, 2, draws))))
    course = np.concatenate([np.zeros((1, 2, draws)), -corners[-LEAD:], corners, -corners, corners[:2]])
    place = np.arange(count) / per_period / HOLD
    before = np.minimum(place.astype(int), len(course) - 2)
    share = 0.5 - 0.5 * np.cos(np.pi * (place - before))
    wave = course[before] + share[:, None, None] * (course[before + 1] - course[before])
    turn = np.exp(2j * np.pi * np.arange(count) / per_period)[:, None]
    return (wave[:, 0] * turn + wave[:, 1] * turn**3).real


def held_responses(index, draws, rng):
    """Return responses of base and m0 to perturbations of a volt, and to noise: shape (samples, 2, draws)."""
    table, (wave, _, periods, _) = plant(), motion_slopes(HARDENING, branch(), index, RATE_HZ)
    law, per_period = design_law(table), len(wave) / periods
    count = round((LEAD + 2 * CHANGES + 1) * HOLD * per_period)
    volts = np.hstack([modulations(rng, draws, per_period, count), np.zeros((count, draws))])
    noise = np.dstack(
        [np.zeros((count, 2, draws)), rng.standard_normal((count, 2, draws)) * np.reshape(NOISE, (2, 1))]
    )
    ((first, of_first), (second, of_second)), (into, relative) = table.stretches(), table.spring
    state, memory = np.zeros((table.size, 2 * draws)), np.zeros((len(law.step), 2 * draws))
    shown = np.empty((count, 2, 2 * draws))
    for n in range(count):
        shown[n] = table.sensing @ state + noise[n]
        answer = law.output @ memory + law.direct @ shown[n] + volts[n]
        memory = law.step @ memory + law.inlet @ shown[n]
        state = first @ state + of_first[:, None] * answer
        state += np.outer(into, relative @ state) * (wave[n % len(wave)] * table.timing.step_s)
        state = second @ state + of_second[:, None] * answer
    return per_period, shown[:, :, :draws], shown[:, :, draws:]


def fitted_multipliers(index, draws, noise, seed):
    """Return the fitted multipliers, and the multiplier of the model."""
    found, rng = branch(), np.random.default_rng(seed)
    per_period, answer, rest = held_responses(index, draws, rng)
    turn = np.cos(2 * np.pi * np.arange(len(answer)) / per_period)
    omega = 2 * np.pi * found.frequencies_hz[index]
    motion = np.array([3e-6 * omega**2, 3e-6 * found.response_ii[index, 0] * omega])
    waves = turn[:, None, None] * motion[:, None]
    seen = [envelope_deviation((waves + answer)[:, 1, each], per_period) for each in range(draws)]
    whole = waves + answer * (TARGET / np.array(seen)) + noise * rest
    # The clocks differ by 20 ppm.
    fitted = [
        open_loop_multiplier(
            PerturbedMotion(
                whole[:, 0, each],
                whole[:, 1, each],
                per_period * (1 + 2e-5),
                round(LEAD * HOLD * per_period),
                CHANGES * HOLD,
            )
        )
        for each in range(draws)
    ]
    return fitted, float(np.abs(found.multipliers[index, 0]))


def covers(each, size):
    low, high = each.bounds
    return low < size < high


@pytest.mark.thorough
@pytest.mark.parametrize("index", [60, 300])
def test_the_stability_of_a_held_motion_follows_from_the_motion_of_the_base_and_m0(index):
    fitted, size = fitted_multipliers(index, 6, 1.0, 1)
    assert sum(covers(each, size) for each in fitted) >= 5
    for each in fitted:
        low, high = each.bounds
        assert (low > 1.0) if size > 1.0 else (high < 1.0)


def test_channel_noise_alone_gives_no_stability_verdict():
    rng = np.random.default_rng(4)
    motion = np.cos(2 * np.pi * np.arange(24_000) / 100)
    for _ in range(20):
        base, m0 = motion + 1e-3 * rng.standard_normal((2, len(motion)))
        low, high = open_loop_multiplier(PerturbedMotion(base, m0, 100.0, 1500, 100)).bounds
        assert not high < 1.0
        assert not low > 1.0


def test_multiplier_bounds_are_two_sided():
    assert OpenLoopMultiplier(1.0, 0.1).bounds == pytest.approx((0.79, 1.21))


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_multiplier_bounds_have_their_stated_coverage_and_verdicts_are_right():
    """240 simulations of 10 motions with low and high noise: at least 92 % in the 95 % bounds."""
    inside, wrong, draws = 0, 0, 0
    for noise in (1.0, 4.0):
        for index in (20, 60, 120, 198, 222, 260, 300, 330, 343, 400):
            fitted, size = fitted_multipliers(index, 12, noise, 1000 * index)
            draws += len(fitted)
            inside += sum(covers(each, size) for each in fitted)
            low, high = np.array([each.bounds for each in fitted]).T
            wrong += np.count_nonzero(high < 1.0 if size > 1.0 else low > 1.0)
    assert inside >= 0.92 * draws
    assert wrong <= 0.005 * draws
