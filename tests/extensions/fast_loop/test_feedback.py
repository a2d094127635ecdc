"""The sampled plant against the compiled simulation, loop multipliers, and the purpose of the law."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.sim.shaker.table_and_specimen import SHAKER
from vibench.sim import gong2025
from vibench.sim.periodic.balance_branch import balance, balance_branch_within
from vibench.sim.periodic.branch_following import FrequencyPath
from vibench.sim.periodic.harmonic_balance import structure_of
from vibench.sim.periodic.restoring_force import spring_of
from vibench.sim.shaker.loaded_shaker import Amplifier, LoadedShaker
from vibench.sim.specimen.contact_laws import PowerLaw
from vibench_fast_loop.fast_loop import branch_hold, branch_multipliers, impact_branch, motion_slopes
from vibench_fast_loop.law import (
    NOISE,
    PUSH_N,
    RELATIVE_M,
    VOLT,
    LinearLaw,
    LoopTiming,
    SampledPlant,
    design_law,
    loop_multiplier,
    loop_transfer,
    pd_law,
)

RATE_HZ = 10_240.0
K1 = 2.1e-3 * (2 * np.pi * 100) ** 2
HARDENING = replace(gong2025(), contact=PowerLaw(1e-4, ((3, 0.1 * K1 * 1e-4),)))
LINEAR = gong2025(contact="linear")
NO_LAW = LinearLaw(np.zeros((1, 1)), np.zeros((1, 2)), np.zeros((1, 1)), np.zeros((1, 2)))


def plant(latency_s=3e-4, specimen=HARDENING, mass_kg=0.127, gain=3.16):
    shaker = replace(SHAKER, moving_mass_kg=mass_kg)
    return SampledPlant(Amplifier(gain=gain), shaker, specimen, LoopTiming(RATE_HZ, latency_s))


@cache
def branch():
    structure, spring = structure_of(HARDENING), spring_of(HARDENING)
    start = balance(structure, spring, 90.0, 3e-6)
    return balance_branch_within(structure, spring, start, FrequencyPath((3e-6,)), 89.0, 120.0)


@pytest.mark.parametrize("latency_s", [0.0, 0.7 / RATE_HZ, 3.1 / RATE_HZ, 10 / RATE_HZ])
def test_the_sampled_plant_model_matches_the_compiled_simulation(latency_s):
    model = plant(latency_s, LINEAR)
    fine = 40
    volts = np.random.default_rng(3).normal(0, 0.05, 300)
    late = round(latency_s * RATE_HZ * fine)
    held = np.concatenate([np.zeros(late), np.repeat(volts, fine)])[: volts.size * fine]
    compiled = LoadedShaker(model.amplifier, model.shaker, LINEAR, 1 / (RATE_HZ * fine))
    motion = compiled.move(held)
    seen = np.stack([motion.base_acceleration, motion.m0_velocity]).reshape(2, -1, fine).mean(axis=2)
    step, volt = model.step
    state, shown = np.zeros(model.size), []
    for each in volts:
        shown.append(model.sensing @ state)
        state = step @ state + volt * each
    for row, expected in zip(np.transpose(shown)[:, 1:], seen[:, :-1], strict=True):
        assert np.abs(row - expected).max() < 4e-3 * np.abs(expected).max()


@pytest.mark.thorough
def test_multipliers_on_a_very_heavy_table_match_the_multipliers_of_the_branch():
    found = branch()
    points = np.random.default_rng(7).integers(0, len(found.frequencies_hz), 30)
    # The free table adds a multiplier of one.
    exact = np.maximum(np.abs(found.multipliers[points, 0]), 1.0)
    assert exact.max() > 1.15
    seen = branch_multipliers(plant(mass_kg=1e7), NO_LAW, found, points)
    assert seen == pytest.approx(exact, rel=0.01)


@pytest.mark.thorough
def test_multipliers_match_those_of_the_branch_if_contacts_are_shorter_than_a_sample():
    stops = gong2025()
    found = impact_branch(stops, 1e-6, 97.5, (97.2, 98.7), "above")
    points = np.argsort(np.abs(found.multipliers[:, 0]))[[-1, -10]]
    exact = np.abs(found.multipliers[points, 0])
    assert exact.min() > 1.2
    seen = branch_multipliers(plant(mass_kg=1e7, specimen=stops), NO_LAW, found, points)
    assert seen == pytest.approx(exact, rel=0.02)


@pytest.mark.thorough
def test_the_feedback_law_stabilises_all_motions_of_a_branch_even_with_a_wrong_model():
    found = branch()
    unstable = np.flatnonzero(~found.is_stable)
    assert unstable.size > 100
    law = design_law(plant())
    softer = replace(HARDENING, stiffnesses=tuple(0.9 * each for each in HARDENING.stiffnesses))
    wrong = (plant(), plant(gain=3.48), plant(gain=2.84), plant(specimen=softer))
    for index in (*unstable[[0, -1]], 10):
        slopes = motion_slopes(HARDENING, found, index, RATE_HZ)
        for each in wrong:
            assert loop_multiplier(each, law, *slopes) < 0.99


@pytest.mark.thorough
def test_pd_gains_on_m0_hold_the_branch_but_pd_gains_on_the_base_do_not():
    unstable = np.flatnonzero(~branch().is_stable)[[0, 70, -1]]
    of_m0, of_base = pd_law(plant(), 1), pd_law(plant(), 0)
    assert of_m0.direct[0, 0] == of_base.direct[0, 1] == 0.0
    assert branch_multipliers(plant(), of_m0, branch(), unstable).max() < 0.96
    assert branch_multipliers(plant(gain=3.48), of_m0, branch(), unstable).max() < 0.99
    assert branch_multipliers(plant(), of_base, branch(), unstable[:1] + 100).max() > 1.0


@pytest.mark.thorough
def test_the_designed_gains_have_a_lower_cost_than_zero_or_doubled_gains():
    """The cost is simulated with the noises that the design assumes."""
    model, rng = plant(specimen=LINEAR), np.random.default_rng(5)
    step, volt = model.step
    into, relative = model.spring
    count = 20_000
    pushes, unknown = rng.normal(0, PUSH_N, count), rng.normal(0, VOLT, count)
    heard = rng.normal(0, 1, (count, 2)) * NOISE

    def cost(law):
        state, memory, total = np.zeros(model.size), np.zeros(2), 0.0
        omega = 2 * np.pi * LINEAR.natural_frequencies_hz[0]
        for push, more, noise in zip(pushes, unknown, heard, strict=True):
            seen = model.sensing @ state + noise
            answer = (law.output @ memory + law.direct @ seen)[0]
            motion = (relative @ state) ** 2 + ((state[7] - state[8]) / omega) ** 2
            total += motion * (0.1 / RELATIVE_M) ** 2 + answer**2
            memory = law.step @ memory + law.inlet @ seen
            state = step @ (state + into * push * model.timing.step_s) + volt * (answer + more)
        return total

    best = pd_law(model, 1)
    least = cost(best)
    for factor in (0.0, 2.0):
        assert cost(replace(best, output=factor * best.output, direct=factor * best.direct)) > least


@pytest.mark.thorough
def test_a_feedback_law_whose_delay_makes_motions_unstable_is_reported():
    late = plant(2e-3)
    hold = branch_hold(late, design_law(late), 3e-6, 94.0, (90.0, 112.0))
    found = branch()
    stable = np.flatnonzero(found.frequencies_hz > 112.0)[0]
    assert found.is_stable[stable]
    assert hold.multiplier > 1.02
    assert hold.at_hz == pytest.approx(112.0, abs=0.5)


@pytest.mark.thorough
def test_no_law_holds_the_branch_with_a_latency_above_a_millisecond():
    unstable = np.flatnonzero(~branch().is_stable)[[0, 70, -1]]
    largest = [
        branch_multipliers(each, design_law(each), branch(), unstable).max()
        for each in map(plant, (1e-4, 5e-4, 1.5e-3))
    ]
    assert largest[0] < 0.95
    assert largest[1] < 0.95
    assert largest[2] > 1.1


def test_the_played_signal_moves_the_base_as_the_transfer_function_states():
    model = plant(specimen=LINEAR)
    law = design_law(model)
    step, volt = model.step
    state, memory, shown, turns = np.zeros(model.size), np.zeros(len(law.step)), [], []
    for k in range(20_000):
        seen = model.sensing @ state
        played = np.cos(2 * np.pi * 130.0 * k / RATE_HZ)
        answer = (law.output @ memory + law.direct @ seen)[0] + played
        memory = law.step @ memory + law.inlet @ seen
        shown.append(state[0])
        turns.append(np.exp(-2j * np.pi * 130.0 * k / RATE_HZ))
        state = step @ state + volt * answer
    tail = slice(-10_240, None)
    found = 2 * np.mean(np.array(shown[tail]) * np.array(turns[tail]))
    assert found == pytest.approx(loop_transfer(model, law, 130.0), rel=1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize(("begin", "ratio"), [("rest", 0.42), ("above", 2.79)])
def test_a_branch_with_stops_depends_on_the_side_from_which_it_starts(begin, ratio):
    branch = impact_branch(gong2025(), 1e-6, 97.5, (97.4, 97.6), begin)
    at = np.argmin(np.abs(branch.frequencies_hz - 97.5))
    assert branch.response_ii[at, 0] == pytest.approx(ratio, rel=0.02)
    assert np.abs(branch.multipliers[at, 0]) < 1
