"""Plans with feedback: their length is not known in advance but bounded."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from vibench.acquisition import ConfigurationError, load_campaign
from vibench.acquisition.excitation.plan import AbstractFeedback, BaseLevel, JumpSearch, Settling
from vibench.acquisition.excitation.stepped_sine import FrequencyGrid
from vibench.acquisition.plan import (
    HUSH_S,
    HeldDwell,
    HeldSweep,
    Measurement,
    ResonanceTracking,
    SettledSine,
    SineSweep,
    duration_s,
    needed_vpp,
)
from vibench.acquisition.plan._limits import limit_checks

SMART = load_campaign(Path(__file__).parent.parent.parent.parent / "campaigns" / "smart.toml").measurements
every_plan = pytest.mark.parametrize("plan", SMART, ids=[each.name for each in SMART])


@every_plan
def test_a_feedback_plan_is_unchanged_after_writing_and_reading_json(plan):
    assert Measurement.model_validate_json(plan.model_dump_json()) == plan
    assert isinstance(plan.excitation, AbstractFeedback)


@every_plan
def test_a_preview_shows_the_recorded_steps_at_the_largest_voltage(plan):
    shown = plan.excitation.preview(2048.0)
    assert shown.peak_v == pytest.approx(0.5 * plan.excitation.amplitude_vpp, rel=0.01)
    recorded_s = sum(step.record_s for step in plan.excitation.steps())
    assert len(shown.volts) == pytest.approx(2048 * recorded_s, abs=2)
    assert shown.duration_s == plan.excitation.playing_s > recorded_s


@every_plan
def test_the_duration_of_a_feedback_plan_includes_silence_and_ramps(plan):
    assert duration_s(plan) == HUSH_S + 2 * plan.ramp_s + plan.excitation.playing_s


@pytest.mark.parametrize(
    "plan", [each for each in SMART if any(each.excitation.held_accelerations())], ids=lambda each: each.name
)
def test_the_voltage_needed_to_hold_a_base_level_is_checked_against_the_voltage_limit(plan, rig):
    held = list(plan.excitation.held_accelerations())
    (check,) = [each for each in limit_checks(plan, rig) if "hold the base's level" in each.what]
    assert check.value == max(needed_vpp(rig, acceleration, at_hz) for at_hz, acceleration in held)
    assert check.is_kept


def test_a_sweep_at_a_held_level_has_the_frequencies_of_an_open_loop_sweep():
    shape = {"amplitude_vpp": 1.0, "start_hz": 150, "stop_hz": 350, "duration_s": 20}
    held = HeldSweep(**shape, base_level=BaseLevel(displacement_m=1e-6))
    played = [step.play.frequency_hz for step in held.steps()]
    np.testing.assert_array_equal(played, [step.play.frequency_hz for step in SineSweep(**shape).steps()])
    assert held.segment.numbers["hold"] == "measured displacement"
    assert len({id(step.segment) for step in held.steps()}) == 1, "one segment is recorded, not one a step"


def test_the_acceleration_of_a_held_displacement_grows_with_frequency_squared():
    level = BaseLevel(displacement_m=2e-6)
    assert level.acceleration_at(260) == pytest.approx(2e-6 * (2 * np.pi * 260) ** 2)
    assert level.acceleration_at(520) == pytest.approx(4 * level.acceleration_at(260))


@pytest.mark.parametrize(
    ("broken", "sentence"),
    [
        (BaseLevel, "give either acceleration_m_per_s2 or displacement_m"),
        (lambda: BaseLevel(acceleration_m_per_s2=1, displacement_m=1e-6), "and not both"),
        (lambda: Settling(shortest_wait_s=5, longest_wait_s=4), "shortest_wait_s = 5 is longer"),
        (lambda: JumpSearch(factor=1.0), "greater than 1"),
        (
            lambda: ResonanceTracking(
                amplitude_vpp=1, start_hz=95, low_hz=96, high_hz=99, accelerations_m_per_s2=(1,)
            ),
            "start_hz = 95 is not between",
        ),
        (
            lambda: ResonanceTracking(
                amplitude_vpp=1,
                start_hz=97,
                low_hz=96,
                high_hz=99,
                accelerations_m_per_s2=(1,),
                harmonic=3,
                subharmonic=2,
            ),
            "harmonic = 3 and subharmonic = 2 were given; at least one of them must be 1",
        ),
        (
            lambda: SettledSine(
                amplitude_vpp=1,
                grid=FrequencyGrid(start_hz=100, stop_hz=100 + SettledSine.most_steps, step_hz=1),
            ),
            f"the plan has {SettledSine.most_steps + 1} steps; one recording holds",
        ),
        (lambda: HeldDwell(amplitude_vpp=1, frequency_hz=260, duration_s=1), "base_level"),
    ],
)
def test_a_contradictory_feedback_plan_is_refused(broken, sentence):
    with pytest.raises(ValidationError, match=sentence):
        broken()


HELD = """
name = "held"
[[measurements]]
name = "one"
[measurements.excitation]
amplitude_vpp = 2.0
{}
"""
A_SINE = "frequency_hz = 260\nduration_s = 5\n"
STEPS = "frequencies_hz = [200, 210]\n"
BAND = "band_start_hz = 50\nband_stop_hz = 500\nrepetition_hz = 2\nrealisations = 9\n"
METRES = "base_level = {{ displacement_m = {} }}"
PER_S2 = "base_level = {{ acceleration_m_per_s2 = {} }}"
DENSITY = "spectrum = [{{ frequency_hz = 50, density = {} }}]"
CORNER = "spectrum = [{{ frequency_hz = {}, density = 1 }}]"
LESS, MORE = "less than or equal to", "greater than or equal to"
MODE = "start_hz = 95\nlow_hz = 90\nhigh_hz = 99\n"


@pytest.mark.parametrize(
    ("kind", "rest", "key", "given", "allowed"),
    [
        ("held_dwell", A_SINE, METRES, "40000000.0", f"{LESS} 1"),
        ("held_dwell", A_SINE, METRES, "1e-200", f"{MORE} 0.000000000000001"),
        ("held_dwell", A_SINE, PER_S2, "1000000000.0", f"{LESS} 100000"),
        ("held_dwell", A_SINE, PER_S2, "1e-99", f"{MORE} 0.000000001"),
        ("resonance_tracking", MODE, "accelerations_m_per_s2 = [0.3, {}]", "1000000000.0", f"{LESS} 100000"),
        ("held_response", STEPS, "response_m = {}", "30", f"{LESS} 1"),
        ("held_noise", BAND, DENSITY, "1e+300", f"{LESS} 10000000000"),
        ("held_noise", BAND, CORNER, "1e+300", f"{LESS} 100000"),
    ],
)  # fmt: skip
def test_an_unreachable_level_is_refused_when_the_file_is_read(kind, rest, key, given, allowed, tmp_path):
    path = tmp_path / "held.toml"
    path.write_text(HELD.format(f'kind = "{kind}"\n{rest}{key.format(given)}\n'))
    with pytest.raises(ConfigurationError) as refused:
        load_campaign(path)
    assert str(refused.value).endswith(f" = {given}: input should be {allowed}")


@pytest.mark.parametrize("displacement_m", [1e-15, 2e-6, 1.0])
def test_a_reachable_level_is_accepted(displacement_m):
    assert BaseLevel(displacement_m=displacement_m).acceleration_at(1.0) > 0.0
