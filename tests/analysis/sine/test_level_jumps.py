"""Jumps in a stepped level: found at two levels on the virtual rig, and none in a constant response."""

import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from tests.analysis.virtual_measurements import record, sampled_at, simulated_with
from vibench.acquisition.plan import SteppedLevel
from vibench.analysis import CampaignResults, analyse, result_summary
from vibench.analysis.kinds import Result
from vibench.analysis.report import findings, result_figures
from vibench.analysis.sine.stepped_response import SteppedResponse, hysteresis_vpp, level_jumps


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    """Steps at 195 Hz from 0.1 to 0.8 Vpp and back; collisions at 0.2 Vpp end at a random time."""
    rig = sampled_at(5120.0, simulated_with(grid_rate_hz=25_600.0, seed=2))
    plan = SteppedLevel(
        frequency_hz=195, amplitude_vpp=0.8, lowest_vpp=0.1, step_vpp=0.1, settle_s=1.5, record_s=0.7
    )
    return analyse(record(tmp_path_factory.mktemp("level") / "level.h5", plan, rig))


@pytest.mark.thorough
def test_the_specimen_jumps_up_at_a_higher_level_than_down(analysis):
    rise, fall = level_jumps(analysis.response)
    assert (rise.direction, rise.before_vpp, rise.after_vpp) == ("up", 0.6, 0.7)
    assert rise.factor > 5
    assert (fall.direction, fall.before_vpp) == ("down", 0.3)
    assert fall.after_vpp in (0.1, 0.2)
    assert fall.factor < 0.3
    assert hysteresis_vpp((rise, fall)) == pytest.approx((0.3, 0.7 - fall.after_vpp))


@pytest.mark.thorough
def test_the_motion_between_the_jumps_depends_on_the_direction_of_the_level(analysis):
    found = analysis.response
    up, down = (
        {
            level: response
            for way, level, response in zip(
                found.direction, found.amplitude_vpp, found.response_ii, strict=True
            )
            if way == each
        }
        for each in ("up", "down")
    )
    for level in (0.3, 0.4, 0.5, 0.6):
        assert down[level] > 4 * up[level]
    assert up[0.1] == pytest.approx(down[0.1], rel=0.01)


def test_the_maximum_of_a_step_excludes_neighbouring_steps(analysis):
    """Without contact the motion is a sine, and both responses are equal."""
    found = analysis.response
    rising = [
        way == "up" and 0.15 < level < 0.65
        for way, level in zip(found.direction, found.amplitude_vpp, strict=True)
    ]
    np.testing.assert_allclose(found.response_i[rising], found.response_ii[rising], rtol=5e-3)


def test_the_figure_and_the_summary_show_both_jumps(analysis):
    (figure,) = result_figures(CampaignResults("levels", (Result(analysis, None),), ()))
    _, fall = level_jumps(analysis.response)
    assert "between 0.6 and 0.7 Vpp" in figure.caption
    assert f"between 0.3 and {fall.after_vpp:g} Vpp" in figure.caption
    assert f"0.3 to {0.7 - fall.after_vpp:g} V above the jump down" in figure.caption
    assert figure.figure.axes[-1].get_xlabel() == "level at the generator [Vpp]"
    measured = result_summary(Result(analysis, None))["measured"]
    assert [each["direction"] for each in measured["jumps"]] == ["up", "down"]


def test_the_report_summarises_levels_and_jumps(analysis):
    (said,) = findings(CampaignResults("levels", (Result(analysis, None),), ()))
    assert said.startswith("level: Level stepped at 195 Hz, 16 steps from 0.1 to 0.8 Vpp.")
    _, fall = level_jumps(analysis.response)
    assert "between 0.6 and 0.7 Vpp" in said
    assert f"0.3 to {0.7 - fall.after_vpp:g} V above the jump down" in said


@pytest.mark.parametrize(
    ("share", "factor"),
    [(0.2, 3.5), (0.4, 1 / 3.5), (0.6, 2.2), (0.75, 1 / 3.5)],
)
def test_a_jump_during_the_record_of_one_step_counts_as_one_jump(tmp_path, factor, share):
    levels, settle_s, record_s = (0.2, 0.3, 0.4, 0.5), 0.5, 1.0
    plan = SteppedLevel(
        frequency_hz=195,
        amplitude_vpp=0.5,
        lowest_vpp=0.2,
        step_vpp=0.1,
        settle_s=settle_s,
        record_s=record_s,
    )
    whole_s = settle_s + record_s
    rate = synthetic.RATE
    time_s = np.arange(round(len(levels) * whole_s * rate)) / rate
    omega = 2 * np.pi * 195
    shaken = 1e-6 * np.repeat(levels, round(whole_s * rate))
    base = synthetic.Motion(shaken * np.sin(omega * time_s), -(omega**2) * shaken * np.sin(omega * time_s))
    jumps_at_s = whole_s + settle_s + share * record_s
    ratio = np.where(time_s < jumps_at_s, 1.0, factor)
    noise = 1e-6 * np.random.default_rng(1).standard_normal(time_s.size)
    velocity = ratio * omega * shaken * np.cos(omega * time_s) + noise
    parts = [
        synthetic.Part(
            "step",
            number * whole_s + settle_s,
            (number + 1) * whole_s,
            {"frequency_hz": 195.0, "direction": "up", "amplitude_vpp": level},
        )
        for number, level in enumerate(levels)
    ]
    found = analyse(synthetic.write_recording(tmp_path, plan, base, velocity, parts))
    (jump,) = level_jumps(found.response)
    assert jump.factor == pytest.approx(factor, rel=0.05)
    assert (jump.before_vpp, jump.after_vpp) == (0.2, 0.4)


def test_a_constant_response_has_no_jump_even_where_the_level_turns_back():
    steps = 6
    response = SteppedResponse(
        frequency_hz=np.full(steps, 195.0),
        direction=("up",) * 3 + ("down",) * 3,
        amplitude_vpp=np.array([0.1, 0.2, 0.3, 0.3, 0.2, 0.1]),
        drive_amplitude_m=np.ones(steps),
        sd_drive_amplitude_m=np.zeros(steps),
        response_i=np.ones(steps),
        noise_bias_i=np.zeros(steps),
        noise_error_i=np.zeros(steps),
        response_ii=np.array([1.0, 1.1, 1.2, 5.0, 5.1, 4.9]),
        sd_response_ii=np.zeros(steps),
        slow_change=np.zeros(steps),
        phase_rad=np.zeros(steps),
        left_out=0,
    )
    assert level_jumps(response) == ()
    assert hysteresis_vpp(()) is None
