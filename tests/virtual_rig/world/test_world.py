"""The analogue world at its inputs and outputs: independent of block size, right in amplitude and time."""

import threading

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.changed import changed
from vibench.acquisition import AcquisitionError, ConfigurationError
from vibench.acquisition.rig import BaseQuantity, RigModel, load_rig, specimen_of
from vibench.sim import base_transmissibility
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS
from vibench.virtual_rig.world.conversion import GROUP_DELAY_SAMPLES, Coupling, Input, volts_per_count
from vibench.virtual_rig.world.time_grid import USUAL_GRID, relative_clock_ppm
from vibench.virtual_rig.world.world import World

GRID_RATE_HZ, STEP_S = USUAL_GRID.rate_hz, USUAL_GRID.step_s
RIG = load_rig("virtual_rig")
QUIET = changed(
    RIG,
    virtual={
        "amplifier_noise_v": 0.0,
        "accelerometer_noise_m_per_s2": 0.0,
        "vibrometer_noise_m_per_s_per_rthz": 0.0,
        "converter_noise_v": 0.0,
        "converter_clock_ppm": 0.0,
    },
)
INPUTS = tuple(
    Input(
        f"cDAQ1Mod1/{channel.physical}", channel.range_v, Coupling(channel.coupling), channel.iepe_current_a
    )
    for channel in RIG.daq.channels
)
DRIVE, AMPLIFIER, BASE, LASER = range(4)


class Tone:
    """A terminal that plays a sine, exact in the mean over every interval for any block size."""

    def __init__(self, frequency_hz, amplitude_v):
        self.omega, self.amplitude_v = 2 * np.pi * frequency_hz, amplitude_v

    def render(self, start_s, interval_s, count):
        first = round(start_s / interval_s)
        cosines = np.cos(self.omega * interval_s * np.arange(first, first + count + 1))
        return -self.amplitude_v * np.diff(cosines) / (self.omega * interval_s)


class Silence:
    """A terminal without a voltage."""

    def render(self, start_s, interval_s, count):
        return np.zeros(count)


def phasor(volts, frequency_hz, sample_rate_hz, first_sample=0):
    """Return the complex amplitude of a sine by least squares; time begins with the conversion."""
    time_s = (first_sample + np.arange(len(volts)) + 1 - GROUP_DELAY_SAMPLES) / sample_rate_hz
    angle = 2 * np.pi * frequency_hz * time_s
    matrix = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    sine, cosine, _ = np.linalg.lstsq(matrix, volts)[0]
    return complex(sine, cosine)


@pytest.mark.parametrize("frequency_hz", [60.0, 201.0, 266.0, 480.0])
def test_every_channel_matches_the_model_of_the_rig_and_the_specimen(frequency_hz):
    world, amplitude_v = World(QUIET, Tone(frequency_hz, 5e-3)), 5e-3
    sampler = world.sample(INPUTS, 51_200.0)
    settle = 150_000
    sampler.read(settle)
    volts = sampler.read(25_600)
    drive, amplifier, base, laser = (phasor(row, frequency_hz, 51_200.0, settle) for row in volts)
    model = RigModel(QUIET)
    voltage = complex(model.transfer(BaseQuantity.AMPLIFIER_VOLTAGE, frequency_hz))
    assert drive * RIG.daq.channels[DRIVE].attenuation == pytest.approx(amplitude_v, rel=2e-4)
    assert amplifier * RIG.daq.channels[AMPLIFIER].attenuation == pytest.approx(
        voltage * amplitude_v, rel=1e-3
    )
    moved_table = complex(model.transfer(BaseQuantity.ACCELERATION, frequency_hz)) * amplitude_v
    s = 2j * np.pi * frequency_hz
    acceleration = base / RIG.accelerometer.sensitivity_v_per_m_per_s2
    delay = np.exp(-s * RIG.vibrometer.delay_s)
    velocity = laser / delay * RIG.vibrometer.units_per_volt("m s-1")
    moved = base_transmissibility(specimen_of(QUIET), frequency_hz)[0, 0]
    # The coupling capacitor of the accelerometer's channel causes a phase lead of cut-off over frequency.
    coupling = s / (s + 2 * np.pi * 0.5)
    resonance = 1 / (1 - (frequency_hz / RIG.accelerometer.resonance_hz) ** 2)
    assert acceleration / coupling / resonance == pytest.approx(moved_table, rel=2e-3)
    assert velocity * s == pytest.approx(acceleration / coupling / resonance * moved, rel=1e-3)


@settings(deadline=None, max_examples=10)
@given(st.lists(st.integers(1, 1500), min_size=2, max_size=12))
def test_two_simulated_rigs_agree_bit_for_bit_for_any_block_size(sizes):
    rig = changed(RIG, virtual={"vibrometer_dropouts_per_s": 50.0})
    whole = World(rig, Tone(260.0, 2.0)).sample(INPUTS, 25_600.0).read(sum(sizes))
    sampler = World(rig, Tone(260.0, 2.0)).sample(INPUTS, 25_600.0)
    assert np.array_equal(np.concatenate([sampler.read(size) for size in sizes], axis=1), whole)


def test_a_different_seed_of_a_rig_gives_different_noise():
    other = changed(RIG, virtual={"seed": 2})
    one, two = (World(rig, Silence()).sample(INPUTS, 51_200.0).read(2000) for rig in (RIG, other))
    for row in range(4):
        assert abs(np.corrcoef(one[row], two[row])[0, 1]) < 0.1
        assert np.std(one[row]) == pytest.approx(np.std(two[row]), rel=0.1)


def test_an_input_beyond_its_range_clips_and_reports_its_overload_once():
    world = World(QUIET, Tone(100.0, 12.0))
    sampler = world.sample((Input("cDAQ1Mod1/ai0", 5.0, Coupling.DC),), 51_200.0)
    volts = sampler.read(5000)
    assert np.max(volts) == 5.0 - volts_per_count(5.0)
    assert np.min(volts) == -5.0
    assert [sampler.overload_flags().tolist() for _ in range(2)] == [[True], [False]]
    within = World(QUIET, Tone(100.0, 1.0)).sample(INPUTS, 51_200.0)
    within.read(5000)
    assert within.overload_flags().tolist() == [False] * 4


def test_conversions_at_different_rates_agree_at_equal_times():
    world = World(QUIET, Tone(260.0, 1.0))
    world.advance(0.01)
    rates = (51_200.0, 12_800.0, 44_100.0, 102_400.0)
    samplers = [world.sample((Input("Dev1/ai0", 10.0, Coupling.DC),), rate) for rate in rates]
    begin_s = world.time_s
    samplers[0].read(10_240)
    for sampler, rate in zip(samplers[1:], rates[1:], strict=True):
        volts = sampler.read(round(0.2 * rate))[0]
        measured = phasor(volts, 260.0, rate) * np.exp(-2j * np.pi * 260.0 * begin_s)
        assert measured * RIG.daq.channels[DRIVE].attenuation == pytest.approx(1.0, rel=3e-4)


def test_a_conversion_started_later_reads_the_signal_that_already_plays():
    world = World(QUIET, Tone(260.0, 1.0))
    world.advance(0.5)
    volts = world.sample(INPUTS[:1], 51_200.0).read(100)[0]
    assert np.max(np.abs(volts)) > 0.4
    first = phasor(volts[:30], 260.0, 51_200.0) * np.exp(-2j * np.pi * 260.0 * world_begin(0.5))
    assert abs(first) * RIG.daq.channels[DRIVE].attenuation == pytest.approx(1.0, rel=1e-2)


def world_begin(time_s):
    return round(time_s * GRID_RATE_HZ) / GRID_RATE_HZ


def test_the_simulation_advances_only_as_far_as_requested():
    world = World(QUIET, Silence())
    world.advance(0.25)
    assert world.time_s == pytest.approx(0.25, abs=STEP_S)
    world.sample(INPUTS, 51_200.0).read(512)
    assert world.time_s == pytest.approx(0.26, abs=STEP_S)


def test_advances_shorter_than_a_time_step_add_up():
    world = World(QUIET, Silence())
    for _ in range(1000):
        world.advance(0.3 * STEP_S)
    assert world.time_s == pytest.approx(300 * STEP_S, abs=STEP_S)


def test_an_analogue_output_drives_the_amplifier_beside_the_generator():
    world = World(QUIET, Tone(100.0, 0.5))
    time_s = np.arange(20_000) / 50_000.0
    world.play("Dev1/ao0", 0.25 * np.sin(2 * np.pi * 300 * time_s), 50_000.0)
    volts = world.sample(INPUTS[:1], 51_200.0).read(20_480)[0][2000:18_000]
    attenuation = RIG.daq.channels[DRIVE].attenuation
    for frequency_hz, expected_v in ((100.0, 0.5), (300.0, 0.25)):
        assert abs(phasor(volts, frequency_hz, 51_200.0)) * attenuation == pytest.approx(expected_v, rel=2e-2)


def test_an_unwired_analogue_output_has_no_effect():
    world = World(QUIET, Silence())
    world.play("Dev2/ao0", np.ones(1000), 10_240.0)
    assert np.all(world.sample(INPUTS, 51_200.0).read(1000) == 0)


def test_recording_the_true_motion_is_possible_and_off_by_default():
    world = World(QUIET, Tone(260.0, 3.0))
    world.advance(0.1)
    assert world.truth().shape == (0, len(MOTION_COLUMNS))
    world.keep_truth()
    world.advance(0.1)
    truth = world.truth()
    assert truth.shape == (round(0.1 * GRID_RATE_HZ), len(MOTION_COLUMNS))
    p = truth[:, MOTION_COLUMNS.index("y")] - truth[:, MOTION_COLUMNS.index("z")]
    assert RIG.specimen.gap_m < np.max(np.abs(p)) < 1.2 * RIG.specimen.gap_m
    assert world.plant.impacts > 10
    assert world.truth().shape[0] == 0


def test_a_disconnected_channel_reads_zero_until_reconnected():
    world = World(QUIET, Tone(260.0, 1.0))
    sampler = world.sample(INPUTS[:1], 51_200.0)
    levels = []
    for change in (lambda _: None, world.disconnect, world.connect):
        change("cDAQ1Mod1/ai0")
        levels.append(np.max(np.abs(sampler.read(5120)[0][1000:])))
    assert levels == pytest.approx([0.5, 0.0, 0.5], abs=1e-3)


def test_a_requested_drop_out_affects_only_the_vibrometer():
    world = World(QUIET, Tone(260.0, 1.0))
    sampler = world.sample(INPUTS, 51_200.0)
    world.disturb_response(0.01, 1.0)
    volts = sampler.read(2000)
    assert np.mean(volts[LASER] > 0.99 * RIG.vibrometer.full_scale_v) == pytest.approx(512 / 2000, abs=0.01)
    assert np.max(volts[DRIVE]) < 0.6


def test_a_fast_converter_clock_makes_all_other_clocks_appear_slow():
    assert relative_clock_ppm(12.0, 12.0) == pytest.approx(0.0, abs=1e-9)
    assert relative_clock_ppm(12.0, -5.0) == pytest.approx(17.0, abs=1e-3)
    assert USUAL_GRID.physical_step_s(100.0) == pytest.approx(STEP_S * (1 - 1e-4), rel=1e-7)


def test_an_impossible_rate_is_refused_with_the_possible_rates():
    with pytest.raises(ConfigurationError, match=r"100 Hz is not possible.*500 to 250000 Hz"):
        World(QUIET, Silence()).sample(INPUTS, 100.0)


def test_a_rig_of_real_instruments_is_not_simulated():
    with pytest.raises(ConfigurationError, match=r"no \[virtual\] section"):
        World(RIG.model_copy(update={"virtual": None}), Silence())


def test_threads_that_share_a_simulated_rig_read_the_same_samples():
    alone = World(RIG, Tone(260.0, 1.0)).sample(INPUTS, 51_200.0).read(6000)
    world = World(RIG, Tone(260.0, 1.0))
    samplers = [world.sample(INPUTS, 51_200.0) for _ in range(2)]
    results = [None, None]

    def read(number):
        results[number] = np.concatenate([samplers[number].read(500) for _ in range(12)], axis=1)

    threads = [threading.Thread(target=read, args=(number,)) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(results[0], alone)
    assert np.array_equal(results[1], alone)


class BrokenTerminal:
    """A terminal whose voltage is NaN after half a second."""

    def render(self, start_s, interval_s, count):
        return np.where(start_s + interval_s * np.arange(count) < 0.5, 0.0, np.nan)


def test_a_failed_simulation_is_reported_and_stops_the_rig():
    world = World(RIG, BrokenTerminal())
    conversion = world.sample(INPUTS, 51200.0)
    assert np.all(np.isfinite(conversion.read(20000)))
    for _ in range(2):
        with pytest.raises(
            AcquisitionError, match=r"motion was lost.*The virtual rig has stopped: restart the rig"
        ):
            conversion.read(51200)
    assert world.time_s < 0.6
