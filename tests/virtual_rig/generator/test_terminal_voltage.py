import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.terminal_voltage import (
    Rectangle,
    Sine,
    Spacing,
    SteadyPhase,
    SweptPhase,
    Table,
    Terminal,
    Triangle,
)

INTERVAL_S = 1 / 51_200
OPEN = Terminal(load_ohm=math.inf, noise_v_per_rt_hz=0.0)


class Rig:
    """A generator whose clock is the time rendered so far, as in the virtual rig."""

    def __init__(self, message="", terminal=OPEN):
        self.time_s = 0.0
        self.generator = AFG1022(lambda: self.time_s, terminal=terminal)
        self.send("OUTP1:IMP INF")
        self.send(message)

    def send(self, message):
        self.generator.execute(message.encode())

    def upload(self, codes):
        data = np.asarray(codes, dtype=">u2").tobytes()
        count = str(len(data))
        self.generator.execute(f"DATA:DATA EMEM,#{len(count)}{count}".encode() + data)

    def render(self, count, interval_s=INTERVAL_S):
        volts = self.generator.render(self.time_s, interval_s, count)
        self.time_s += count * interval_s
        return volts


def sine_means(amplitude_v, frequency_hz, start_s, count, interval_s=INTERVAL_S, phase=0.0):
    """Return the mean of a sine over each interval, in closed form."""
    edges = phase + 2 * np.pi * frequency_hz * (start_s + interval_s * np.arange(count + 1))
    return -amplitude_v * np.diff(np.cos(edges)) / (2 * np.pi * frequency_hz * interval_s)


def test_a_rendered_sine_has_the_set_amplitude_and_phase():
    rig = Rig("FREQ 100;:VOLT 3;:VOLT:OFFS 0.5;:PHAS 30DEG;:PHAS:INIT;:OUTP ON")
    expected = 0.5 + sine_means(1.5, 100.0, 0.0, 2000, phase=math.radians(30))
    assert rig.render(2000) == pytest.approx(expected, abs=1e-11)


def test_an_output_that_is_off_is_exactly_silent_for_any_setting():
    rig = Rig("FREQ 100;:VOLT 3;:VOLT:OFFS 2", Terminal(noise_v_per_rt_hz=1e-3))
    assert not rig.render(1000).any()
    rig.send("OUTP ON")
    assert rig.render(1000).any()
    rig.send("OUTP OFF")
    assert not rig.render(1000).any()


@pytest.mark.parametrize(
    ("declared", "load_ohm", "factor"),
    [("50", math.inf, 2.0), ("50", 50.0, 1.0), ("INF", math.inf, 1.0), ("50", 15e3, 2 * 15e3 / 15050)],
)
def test_the_terminal_voltage_doubles_if_50_ohm_are_declared_without_a_50_ohm_load(
    declared, load_ohm, factor
):
    terminal = Terminal(load_ohm=load_ohm, noise_v_per_rt_hz=0.0)
    rig = Rig(f"OUTP:IMP {declared};:FREQ 100;:VOLT 1;:OUTP ON", terminal)
    assert rig.render(512).max() == pytest.approx(0.5 * factor, rel=1e-4)


def test_the_phase_does_not_jump_when_the_frequency_changes():
    rig = Rig("FREQ 100;:VOLT 2;:PHAS:INIT;:OUTP ON")
    first = rig.render(777)
    rig.send("FREQ 133.7")
    second = rig.render(777)
    change_s = 777 * INTERVAL_S
    phase = 2 * np.pi * (100 - 133.7) * change_s
    assert first == pytest.approx(sine_means(1.0, 100.0, 0.0, 777), abs=1e-10)
    assert second == pytest.approx(sine_means(1.0, 133.7, change_s, 777, phase=phase), abs=1e-10)


def flat_rig():
    """Return a rig that plays 1 V."""
    rig = Rig()
    rig.upload([0, 0])
    rig.send("FUNC EMEM;:VOLT 0.002;:VOLT:OFFS 1.001;:OUTP ON")
    return rig


def test_a_command_acts_at_the_time_at_which_it_arrives_even_inside_an_interval():
    rig = flat_rig()
    rig.time_s = 2.25 * INTERVAL_S
    rig.send("VOLT:OFFS 3.001")
    rig.time_s = 0.0
    assert rig.render(4) == pytest.approx([1, 1, 0.25 * 1 + 0.75 * 3, 3])


def test_samples_already_rendered_do_not_change():
    rig = flat_rig()
    rig.render(4)
    rig.time_s = INTERVAL_S  # the clock lags behind the rendered samples
    rig.send("VOLT:OFFS 3.001")
    rig.time_s = 4 * INTERVAL_S
    assert rig.render(3) == pytest.approx([3, 3, 3])


def test_a_waveform_changed_in_memory_is_played_at_once():
    rig = Rig()
    rig.upload([0, 0])
    rig.send("FUNC EMEM;:FREQ 10;:VOLT 2;:OUTP ON")
    assert rig.render(3) == pytest.approx([-1, -1, -1])
    rig.upload([16383, 16383])
    assert rig.render(3) == pytest.approx([1, 1, 1])


MODES = {
    "sine": "FREQ 123.4",
    "square": "FUNC SQU;:FREQ 123.4",
    "arbitrary": "FUNC EMEM;:FREQ 2",
    "burst": "FREQ 100;:BURS:NCYC 3;:BURS ON;*TRG",
}


@pytest.mark.parametrize("mode", MODES.values(), ids=MODES)
def test_rendered_samples_do_not_depend_on_the_block_size(mode):
    def render_in(sizes):
        rig = Rig(terminal=Terminal(seed=3, clock_error_ppm=20))
        rig.upload(np.random.default_rng(3).integers(0, 16384, 500))
        rig.send(mode)
        rig.send("OUTP ON")
        return np.concatenate([rig.render(size) for size in sizes])

    whole = render_in([9000])
    assert whole.std() > 0
    assert np.array_equal(whole, render_in([1, 999, 4096, 3, 3901]))


@given(seed=st.integers(0, 2**31), density=st.floats(1e-8, 1e-3))
def test_the_rms_of_the_terminal_noise_follows_from_its_density_up_to_nyquist(seed, density):
    terminal = Terminal(load_ohm=math.inf, noise_v_per_rt_hz=density, seed=seed)
    noise = Rig("FUNC DC;:OUTP ON", terminal).render(20_000)
    expected = density * math.sqrt(1 / (2 * INTERVAL_S))
    # The rms of 20,000 normal samples has a standard deviation of 0.5 %; 3 % is six times that.
    assert noise.std() == pytest.approx(expected, rel=0.03)


def test_a_generator_clock_that_runs_fast_raises_every_frequency():
    terminal = Terminal(load_ohm=math.inf, noise_v_per_rt_hz=0, clock_error_ppm=100.0)
    rig = Rig("FREQ 1000;:VOLT 2;:PHAS:INIT;:OUTP ON", terminal)
    assert rig.render(5000) == pytest.approx(sine_means(1.0, 1000.1, 0.0, 5000), abs=1e-9)


def test_the_phase_of_the_output_has_not_drifted_after_ten_hours():
    rig = Rig("FREQ 333.333333;:VOLT 2;:PHAS:INIT;:OUTP ON")
    rig.time_s = 36_000.0
    expected = sine_means(1.0, 333.333333, 0.0, 500, phase=2 * np.pi * ((333.333333 * 36_000) % 1.0))
    assert rig.render(500) == pytest.approx(expected, abs=1e-6)


def test_a_burst_plays_its_cycles_once_per_trigger_and_then_stays_silent():
    rig = Rig("FREQ 100;:VOLT 2;:BURS:NCYC 3;:BURS ON;:OUTP ON")
    assert not rig.render(1000).any()
    start_s = rig.time_s
    rig.send("*TRG")
    volts = rig.render(4000)
    cycles = round(0.03 / INTERVAL_S)
    assert volts[:cycles] == pytest.approx(sine_means(1.0, 100.0, 0.0, cycles), abs=1e-9)
    assert volts[cycles + 1 :] == pytest.approx(np.zeros(4000 - cycles - 1), abs=1e-9)
    assert start_s > 0
    rig.send("*TRG")
    assert rig.render(500).max() > 0.9


def test_a_gated_burst_without_a_gate_signal_stays_silent():
    rig = Rig("FREQ 100;:VOLT 2;:BURS:MODE GAT;:BURS ON;:OUTP ON;*TRG")
    assert rig.render(2000) == pytest.approx(np.zeros(2000), abs=1e-12)


def test_selecting_noise_is_accepted_but_the_previous_shape_keeps_playing():
    rig = Rig("FREQ 100;:VOLT 2;:PHAS:INIT;:OUTP ON;:FUNC PRN")
    assert rig.generator.execute(b"FUNC?").data == b"PRN\n"
    assert rig.render(1000) == pytest.approx(sine_means(1.0, 100.0, 0.0, 1000), abs=1e-10)


def test_the_built_in_dc_shape_ignores_the_offset_but_a_flat_waveform_does_not():
    rig = Rig("FUNC DC;:VOLT:OFFS 1;:OUTP ON")
    assert not rig.render(5).any()
    rig.upload([8191, 8191])
    rig.send("FUNC EMEM;:VOLT 0.002")
    assert rig.render(5) == pytest.approx([1] * 5, abs=1e-6)


def test_a_welded_relay_keeps_the_output_playing_although_it_reports_off():
    rig = Rig("FREQ 100;:VOLT 2;:OUTP ON")
    rig.generator.stick_output_relay(is_stuck=True)
    rig.send("OUTP OFF")
    assert rig.generator.execute(b"OUTP?").data == b"0\n"
    assert rig.render(512).max() == pytest.approx(1.0, rel=1e-3)
    rig.generator.stick_output_relay(is_stuck=False)
    assert not rig.render(512).any()


TOP_CODE = 16_383
TABLE = Table(np.random.default_rng(5).integers(0, TOP_CODE + 1, 37).astype(np.uint16), TOP_CODE)
SHAPES = {
    "sine": Sine(),
    "square": Rectangle(),
    "narrow pulse": Rectangle(0.07),
    "triangle": Triangle(),
    "table": TABLE,
}
STARTS = st.floats(0, 1, exclude_max=True)
SPANS = st.floats(1e-6, 40)


def mean(shape, start, span):
    return float(shape.mean(np.array([start]), np.array([span]))[0])


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@given(start=STARTS, span=SPANS)
def test_the_mean_of_a_shape_agrees_with_a_midpoint_sum(shape, start, span):
    points = 20_001
    phase = (start + span * (np.arange(points) + 0.5) / points) % 1.0
    brute = shape.mean(phase, np.zeros(points)).mean()
    # A midpoint sum misplaces each of the 37 jumps per cycle by at most half a step of height 2.
    allowed = 2 * 40 * (span + 1) / points
    assert mean(shape, start, span) == pytest.approx(brute, abs=allowed)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@given(start=STARTS, first=SPANS, second=SPANS)
def test_the_means_over_two_adjacent_parts_combine_to_the_mean_over_both_parts(shape, start, first, second):
    middle = (start + first) % 1.0
    parts = first * mean(shape, start, first) + second * mean(shape, middle, second)
    assert (first + second) * mean(shape, start, first + second) == pytest.approx(parts, abs=1e-9)


@given(st.integers(0, 36), st.integers(1, 200))
def test_a_waveform_mean_over_whole_points_is_the_mean_of_its_codes(first, count):
    codes = TABLE.codes[np.arange(first, first + count) % 37].astype(float)
    expected = 2 * codes.mean() / TOP_CODE - 1
    assert mean(TABLE, (first + 1e-12) / 37, count / 37) == pytest.approx(expected, abs=1e-9)


def test_the_lowest_and_the_highest_code_stand_for_minus_one_and_plus_one():
    table = Table(np.array([0, TOP_CODE], dtype=np.uint16), TOP_CODE)
    values = table.mean(np.array([0.1, 0.6]), np.zeros(2))
    assert values.tolist() == [-1.0, 1.0]


def test_a_waveform_mean_over_a_tiny_part_of_a_point_equals_the_value_of_the_point():
    assert mean(TABLE, 0.3, 1e-15) == mean(TABLE, 0.3, 0.0)


DAY_S = 86_400.0
TIMES = st.floats(0, DAY_S)
FREQUENCIES = st.integers(1, 25_000_000_000_000)
"""Frequencies in microhertz."""


def turn(first, second):
    """Return the smallest distance between two phases [cycles]."""
    return abs((first - second + 0.5) % 1.0 - 0.5)


@given(frequency_uhz=FREQUENCIES, time_s=TIMES)
def test_a_day_at_25_mhz_shifts_the_phase_by_less_than_a_millionth_of_a_cycle(frequency_uhz, time_s):
    exact = Fraction(frequency_uhz, 1_000_000) * Fraction(time_s) % 1
    assert turn(SteadyPhase(frequency_uhz, 0.0).phase(time_s), float(exact)) < 1e-7


@given(first=FREQUENCIES, second=FREQUENCIES, time_s=TIMES)
def test_a_change_of_frequency_does_not_change_the_phase(first, second, time_s):
    before = SteadyPhase(first, 0.3)
    after = SteadyPhase.with_phase(second, before.phase(time_s), time_s)
    # 25 million cycles within a second have an error of 4e-9 cycles in double precision.
    assert turn(before.phase(time_s), after.phase(time_s)) < 2e-8


@pytest.mark.parametrize("spacing", Spacing)
def test_a_sweep_begins_at_its_start_frequency_and_ends_at_its_stop_frequency(spacing):
    sweep = SweptPhase(100.0, 900.0, 2.0, 1.0, spacing, begin_s=0.0, anchor_s=0.0, offset=0.0)
    edges = np.array([0.0, 1e-6, 1.0, 1.0 + 1e-6, 2.0 - 1e-6, 2.0])
    _, span = sweep.stretches(edges)
    rates = span[::2] / np.diff(edges)[::2]
    middle = 500.0 if spacing is Spacing.LINEAR else 300.0
    assert rates == pytest.approx([100.0, middle, 900.0], rel=1e-5)


def test_a_sweep_never_jumps_in_phase():
    sweep = SweptPhase(100.0, 900.0, 0.25, 0.5, Spacing.LINEAR, begin_s=0.1, anchor_s=0.0, offset=0.2)
    for turn_s in (0.1, 0.35, 0.85):
        assert turn(sweep.phase(turn_s - 1e-9), sweep.phase(turn_s + 1e-9)) < 5e-6
