"""Feedback measurements on a bistable oscillator whose folds and resonance are known in closed form."""

import json
from itertools import pairwise

import numpy as np
import pytest

from vibench.acquisition.excitation.plan import BaseLevel, JumpSearch, Settling
from vibench.acquisition.excitation.stepped_sine import FrequencyGrid
from vibench.acquisition.plan import (
    Direction,
    HeldDwell,
    HeldSweep,
    Measurement,
    ResonanceTracking,
    SettledSine,
    duration_s,
)

HARDENING = 3e12
LEVEL = 0.6
SETTLING = Settling(longest_wait_s=6)


def notes_of(bench, kind):
    return [json.loads(text) for _, each, text in bench.notes if each == kind]


def folds_hz(oscillator, acceleration):
    """Return the ends of the range with three steady amplitudes: sweeps down and up must jump there."""
    grid = np.arange(118, 150, 0.005)
    three = [f for f in grid if len(oscillator.steady_amplitudes(f, acceleration)) == 3]
    return three[0], three[-1]


@pytest.fixture(scope="module")
def both_ways(request):
    """Return a dictionary in which the tests share one sweep up and down through the bistable range."""
    return {}


@pytest.fixture
def sweep_bench(new_control_bench, both_ways):
    if not both_ways:
        bench = new_control_bench(hardening=HARDENING)
        plan = SettledSine(
            amplitude_vpp=1.0,
            grid=FrequencyGrid(start_hz=116, stop_hz=132, step_hz=2),
            direction=Direction.UP_THEN_DOWN,
            record_s=0.3,
            settling=SETTLING,
            base_level=BaseLevel(acceleration_m_per_s2=LEVEL),
            jumps=JumpSearch(factor=1.5, resolution_hz=0.25),
        )
        measurement = Measurement(name="swept", excitation=plan, ramp_s=0.2)
        bench.carry_out(measurement)
        both_ways["bench"], both_ways["measurement"] = bench, measurement
    return both_ways["bench"]


@pytest.mark.thorough
def test_jumps_up_and_down_are_bracketed_around_the_folds(sweep_bench):
    jumps = {each["direction"]: each for each in notes_of(sweep_bench, "jump") if each["how"] == "localised"}
    lower, upper = folds_hz(sweep_bench.oscillator, LEVEL)
    assert upper - lower > 1.0
    for direction, fold in (("up", upper), ("down", lower)):
        found = jumps[direction]
        low, high = sorted((found["before_hz"], found["after_hz"]))
        assert high - low <= 0.25
        # The level is held to 0.75 %, which moves the folds; a step can only cause an early jump.
        assert low - 0.3 <= fold <= high + 0.3


@pytest.mark.thorough
def test_every_recorded_step_states_its_pass_its_branch_and_its_direction(sweep_bench):
    steps = [numbers for label, numbers, *_ in sweep_bench.segments if label == "step"]
    assert [each["frequency_hz"] for each in steps] == [*range(116, 133, 2), *range(132, 115, -2)]
    assert [each["pass"] for each in steps] == [1] * 9 + [2] * 9
    assert steps[0]["came_from"] == "rest"
    assert steps[9]["came_from"].startswith("up pass 1")
    for way in (steps[:9], steps[9:]):
        branches = [each["branch"] for each in way]
        assert branches == sorted(branches)
        assert branches[-1] == 2
    assert max(len(json.dumps(each)) for each in steps) < 480


def test_the_recorded_steps_lie_on_the_branches_of_the_closed_form(sweep_bench):
    up = [each for each in notes_of(sweep_bench, "achieved") if each["segment"] == "step"][:9]
    lower, upper = folds_hz(sweep_bench.oscillator, LEVEL)
    for step in up:
        if lower < step["frequency_hz"] < upper:
            highest = sweep_bench.oscillator.highest_seen_m(step["frequency_hz"], step["base_m_per_s2"])
            base_m = step["base_m_per_s2"] / (2 * np.pi * step["frequency_hz"]) ** 2
            assert step["response_ii"] == pytest.approx(highest / base_m, rel=0.01)


def test_a_feedback_measurement_ends_within_the_planned_time(sweep_bench, both_ways):
    assert sweep_bench.sample / 5120 <= duration_s(both_ways["measurement"])


def test_the_base_level_is_reached_despite_a_wrong_shaker_model(new_control_bench):
    bench = new_control_bench(shaker_factor=lambda frequency_hz: 0.6 + 0.3 * (frequency_hz > 125))
    plan = SettledSine(
        amplitude_vpp=1.0,
        grid=FrequencyGrid(start_hz=140, stop_hz=160, step_hz=5),
        record_s=0.3,
        settling=SETTLING,
        base_level=BaseLevel(displacement_m=1e-6),
    )
    bench.carry_out(Measurement(name="held", excitation=plan, ramp_s=0.2))
    steps = [each for each in notes_of(bench, "achieved") if each["segment"] == "step"]
    assert len(steps) == 5
    for step in steps:
        target = 1e-6 * (2 * np.pi * step["frequency_hz"]) ** 2
        assert abs(step["base_m_per_s2"] / target - 1) < 0.01
        assert step["level"] == "within tolerance"
        assert step["motion"] == "periodic"
    loudest = [setting for _, _, setting in bench.settings]
    assert max(b / a for a, b in pairwise(loudest[2:-1])) <= 1.25 * (1 + 1e-9)


def test_an_unreachable_base_level_is_flagged_and_the_voltage_stays_within_the_plan(new_control_bench):
    bench = new_control_bench(shaker_factor=lambda frequency_hz: 0.2)
    plan = HeldDwell(
        amplitude_vpp=0.05,
        frequency_hz=150,
        base_level=BaseLevel(acceleration_m_per_s2=3.0),
        settling=Settling(longest_wait_s=6),
        duration_s=2,
        update_s=0.5,
    )
    bench.carry_out(Measurement(name="out", excitation=plan, ramp_s=0.2))
    looks = notes_of(bench, "level")
    assert len(looks) == 4
    assert {each["level"] for each in looks} == {"outside tolerance"}
    assert max(setting for *_, setting in bench.settings) == pytest.approx(0.05)


def test_a_sweep_holds_its_level_across_a_resonance_of_the_shaker(new_control_bench):
    bench = new_control_bench(
        shaker_factor=lambda frequency_hz: 1 + 0.5 / (1 + ((frequency_hz - 150) / 4) ** 2)
    )
    plan = HeldSweep(
        amplitude_vpp=1.0,
        start_hz=130,
        stop_hz=170,
        duration_s=20,
        base_level=BaseLevel(acceleration_m_per_s2=1.0),
        settling=SETTLING,
    )
    bench.carry_out(Measurement(name="sweep", excitation=plan, ramp_s=0.2))
    achieved = notes_of(bench, "achieved")[-1]
    assert achieved["steps"] == 200
    # With steps of 0.2 Hz on a flank of 9 % per Hz, each step predicts the next to within 2 %.
    assert achieved["steps_outside"] <= 20
    for outside in notes_of(bench, "level"):
        assert 140 < outside["from_hz"] <= outside["to_hz"] < 160
        assert abs(outside["worst"]) < 0.1


def test_a_phase_resonance_is_tracked_along_the_backbone(new_control_bench):
    bench = new_control_bench(hardening=HARDENING / 5)
    plan = ResonanceTracking(
        amplitude_vpp=1.0,
        start_hz=119,
        low_hz=110,
        high_hz=140,
        accelerations_m_per_s2=(0.1, 0.13, 0.16, 0.19, 0.22, 0.26, 0.3),
        phase_tolerance_deg=1,
        settling=SETTLING,
    )
    bench.carry_out(Measurement(name="backbone", excitation=plan, ramp_s=0.2))
    found = notes_of(bench, "resonance")
    assert [each["lock"] for each in found] == ["locked"] * 7
    assert max(each["periods"] for each in found[1:]) <= 150
    assert max(abs(each["phase_deg"] + 90) for each in found[1:]) < 1
    oscillator = bench.oscillator
    for each in found:
        # Phase resonance of x over the base: hardening detunes it, and x lags by a quarter of a period.
        omega = 2 * np.pi * each["frequency_hz"]
        # At this lag base and x are at right angles in the measured motion.
        x = np.sqrt(each["response_ii"] ** 2 - 1.0) * each["base_m_per_s2"] / omega**2
        expected = np.sqrt((2 * np.pi * 120) ** 2 + 0.75 * oscillator.hardening * x**2) / (2 * np.pi)
        assert abs(each["frequency_hz"] - expected) < 3 * each["frequency_u_hz"] + 0.02
        assert each["frequency_u_hz"] < 0.02
    assert found[-1]["frequency_hz"] > found[0]["frequency_hz"] + 0.05


@pytest.mark.thorough
def test_a_strongly_bent_resonance_is_followed(new_control_bench):
    """The resonance moves from 120 to 127 Hz, by up to four half-widths (0.48 Hz) per level."""
    bench = new_control_bench(hardening=HARDENING)
    plan = ResonanceTracking(
        amplitude_vpp=3.0,
        start_hz=120,
        low_hz=110,
        high_hz=180,
        accelerations_m_per_s2=tuple(0.1 * 1.2**k for k in range(13)),
        settling=SETTLING,
        flank_pairs=1,
    )
    bench.carry_out(Measurement(name="bent", excitation=plan, ramp_s=0.2))
    found = notes_of(bench, "resonance")
    assert all(abs(each["phase_deg"] + 90) < 1 for each in found[1:9])
    assert all(abs(each["phase_deg"] + 90) < 3 for each in found)
    assert found[-1]["at_hz"] > 127


def test_an_unsettled_motion_gives_no_resonance(
    new_control_bench,
):
    """Phase and level are within tolerance, but the motion is observed for less than a thousand periods."""
    bench = new_control_bench()
    plan = ResonanceTracking(
        amplitude_vpp=1.0,
        start_hz=119.5,
        low_hz=110,
        high_hz=140,
        accelerations_m_per_s2=(0.1,),
        phase_tolerance_deg=2,
        settling=Settling(periods=1000, longest_wait_s=6),
        flank_pairs=0,
    )
    bench.carry_out(Measurement(name="growing", excitation=plan, ramp_s=0.2))
    (found,) = notes_of(bench, "resonance")
    assert found["phase_deg"] == pytest.approx(-90, abs=2)
    assert found["held"] == "within tolerance"
    assert (found["motion"], found["lock"], found["frequency_hz"]) == ("unsettled", "not met", None)


def test_a_plan_that_holds_no_base_level_plays_a_constant_generator_voltage(new_control_bench):
    bench = new_control_bench()
    plan = SettledSine(amplitude_vpp=0.3, frequencies_hz=(140, 150), record_s=0.3, settling=SETTLING)
    bench.carry_out(Measurement(name="open", excitation=plan, ramp_s=0.2))
    # The first entry is the silence that is measured first.
    assert {setting for *_, setting in bench.settings[1:]} == {0.3}
    assert {each["level"] for each in notes_of(bench, "achieved")} == {"not controlled"}


def test_an_isolated_branch_is_reached_again_from_rest(new_control_bench):
    """Below 123 Hz the lower branch ends; from there a return to 123 Hz stays on the upper branch."""
    bench = new_control_bench(hardening=HARDENING)
    plan = SettledSine(
        amplitude_vpp=1.0,
        frequencies_hz=(121.3, 123.0),
        direction=Direction.DOWN,
        record_s=0.3,
        settling=SETTLING,
        base_level=BaseLevel(acceleration_m_per_s2=LEVEL),
        jumps=JumpSearch(factor=1.5, resolution_hz=0.25),
    )
    bench.carry_out(Measurement(name="stuck", excitation=plan, ramp_s=0.2))
    lower, upper = folds_hz(bench.oscillator, LEVEL)
    assert lower < 123.0 < upper
    (jump,) = notes_of(bench, "jump")
    assert jump["how"] == "localised"
    assert jump["after_hz"] - 0.3 <= lower <= jump["before_hz"] + 0.3
    # The search passed through silence: the setting fell to a ninth and rose again.
    settings = [setting for *_, setting in bench.settings[3:-1]]
    assert min(settings) < 0.15 * max(settings)
