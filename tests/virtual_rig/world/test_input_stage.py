"""The signal at the converter: sensor supply, coupling, clipping."""

import numpy as np
import pytest

from vibench.virtual_rig.world.conversion import (
    AC_CUT_HZ,
    OPEN_INPUT,
    OVER_RANGE,
    Behind,
    Cable,
    Coupling,
    Input,
    InputStage,
    Signal,
)
from vibench.virtual_rig.world.sensors import IEPE_BIAS_V
from vibench.virtual_rig.world.time_grid import USUAL_GRID

SENSOR = Cable(Behind.IEPE_SENSOR, Signal.BASE_ACCELERATION)
SOURCE = Cable(Behind.VOLTAGE_SOURCE, Signal.DRIVE)


def stage(cable, coupling=Coupling.DC, iepe_current_a=0.0, range_v=5.0):
    return InputStage(Input("Dev1/ai0", range_v, coupling, iepe_current_a), {"Dev1/ai0": cable})


def signals(value):
    return np.tile(value, (len(Signal), 1))


STEP_S = USUAL_GRID.step_s
SINE = 0.5 * np.sin(2 * np.pi * 400 * STEP_S * np.arange(20_480))


@pytest.mark.parametrize(
    ("configured", "expected", "overloads"),
    [
        pytest.param((), 0.0, False, id="no signal without excitation"),
        pytest.param((Coupling.AC, 0.002), SINE, False, id="AC: the signal without the bias"),
        pytest.param((Coupling.DC, 0.002), 5.0 * OVER_RANGE, True, id="DC: the bias overloads 5 V"),
        pytest.param((Coupling.DC, 0.002, 12.0), IEPE_BIAS_V + SINE, False, id="12 V: bias and signal"),
    ],
)
def test_an_iepe_sensor_shows_its_signal_and_its_bias_only_with_excitation(configured, expected, overloads):
    volts, clips = stage(SENSOR, *configured).pass_on(signals(SINE))
    assert np.max(np.abs(volts - expected)) < (0.01 if Coupling.AC in configured else 1e-9)
    assert clips is overloads


def test_an_open_input_reads_zero_unless_its_excitation_is_on():
    assert np.all(stage(OPEN_INPUT).pass_on(signals(SINE))[0] == 0)
    assert stage(OPEN_INPUT, iepe_current_a=0.002).pass_on(signals(SINE))[1]


def test_iepe_excitation_shifts_a_voltage_source_by_the_drop_at_its_internal_resistance():
    volts, _ = stage(SOURCE, iepe_current_a=0.002).pass_on(signals(SINE))
    assert volts == pytest.approx(SINE + 0.1)


def test_a_voltage_divider_reduces_the_input_voltage():
    volts, _ = stage(Cable(Behind.VOLTAGE_SOURCE, Signal.DRIVE, attenuation=10.0)).pass_on(signals(SINE))
    assert volts == pytest.approx(SINE / 10)


def test_the_gain_of_ac_coupling_is_3_db_down_at_its_cut_off_frequency():
    time_s = STEP_S * np.arange(819_200)
    volts, _ = stage(SOURCE, Coupling.AC).pass_on(signals(np.sin(2 * np.pi * AC_CUT_HZ * time_s)))
    assert np.max(np.abs(volts[-204_800:])) == pytest.approx(np.sqrt(0.5), rel=1e-3)


def test_an_input_clips_slightly_beyond_its_range():
    within, clips_within = stage(SOURCE).pass_on(signals(np.array([5.0 * OVER_RANGE])))
    beyond, clips_beyond = stage(SOURCE).pass_on(signals(np.array([-5.2])))
    assert (within[0], clips_within) == (5.0 * OVER_RANGE, False)
    assert (beyond[0], clips_beyond) == (-5.0 * OVER_RANGE, True)


def test_a_changed_cable_takes_effect_in_the_next_steps():
    cables = {"Dev1/ai0": SOURCE}
    running = InputStage(Input("Dev1/ai0", 5.0, Coupling.DC), cables)
    before, _ = running.pass_on(signals(SINE))
    del cables["Dev1/ai0"]
    after, _ = running.pass_on(signals(SINE))
    assert np.any(before != 0)
    assert np.all(after == 0)
