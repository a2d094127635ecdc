"""Levels at one frequency: their values, durations, amplitudes, and refusals."""

import numpy as np
import pytest
from pydantic import ValidationError

from vibench.acquisition import LimitExceeded
from vibench.acquisition.plan import Dwell, Measurement, RunState, SteppedLevel, phases, require_within_limits
from vibench.acquisition.rig import load_rig


def plan(**changed):
    given = {"frequency_hz": 195, "amplitude_vpp": 0.9, "lowest_vpp": 0.2, "step_vpp": 0.1}
    return SteppedLevel.model_validate({**given, "settle_s": 0.5, "record_s": 0.25, **changed})


def levels(excitation):
    return [
        (step.segment.numbers["direction"], step.segment.numbers["amplitude_vpp"])
        for step in excitation.steps()
    ]


def test_levels_rise_to_the_amplitude_and_then_fall_and_every_level_states_its_direction():
    rising = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]
    told = levels(plan())
    assert [way for way, _ in told] == ["up"] * 8 + ["down"] * 8
    assert [vpp for _, vpp in told] == pytest.approx(rising + rising[::-1])
    assert [vpp for _, vpp in levels(plan(lowest_vpp=0.25, direction="down"))] == pytest.approx(rising[:0:-1])


def test_level_steps_have_no_ramp_and_no_phase_jump():
    laid_out = list(phases(Measurement(name="level", excitation=plan(), ramp_s=0.5)))
    states = [phase.state for phase in laid_out]
    assert states.count(RunState.RAMPING_UP) == states.count(RunState.RAMPING_DOWN) == 1
    assert sum(phase.duration_s for phase in laid_out) == pytest.approx(plan().playing_s + 1.0)
    preview = plan(frequency_hz=20.3).preview(5000)
    envelope = 0.45 * np.repeat([step.play.level for step in plan().steps()], 3750)
    expected = envelope * np.sin(2 * np.pi * 20.3 * preview.time_s)
    assert preview.volts == pytest.approx(expected, abs=1e-9)
    assert preview.duration_s == plan().playing_s == 16 * 0.75


def test_limits_are_checked_at_every_level():
    rig = load_rig("virtual_rig")
    loud = plan(amplitude_vpp=10.0, frequency_hz=20.0)
    with pytest.raises(LimitExceeded):
        require_within_limits(Measurement(name="level", excitation=loud), rig)
    levels_vpp = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]
    dwells = [Dwell(frequency_hz=195, amplitude_vpp=vpp, duration_s=1) for vpp in levels_vpp]
    used, *each = (
        {check.what: check.use for check in require_within_limits(Measurement(name="l", excitation=one), rig)}
        for one in (plan(), *dwells)
    )
    assert used.keys() == each[-1].keys()
    # Near the resonance of m1 bound to m2 the base may move less at a higher level: every level counts.
    for what, use in used.items():
        assert use == pytest.approx(max(level[what] for level in each), rel=1e-6), what


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"lowest_vpp": 0.85}, "give fewer than two levels"),
        ({"lowest_vpp": 1.0}, "give fewer than two levels"),
        ({"step_vpp": 1e-4}, "holds at most 4000"),
        ({"step_vpp": 0}, "greater than 0"),
        ({"lowest_vpp": 0}, "greater than 0"),
    ],
)
def test_invalid_levels_are_refused_with_the_allowed_values(changed, said):
    with pytest.raises(ValidationError, match=said):
        plan(**changed)
