"""Requirements of every function generator: play as set, refuse what it cannot do, and end in silence."""

import numpy as np
import pytest

from vibench.acquisition.bench import Bench
from vibench.acquisition.contract.conftest import LEVEL, line_v, measured_v, refusal
from vibench.acquisition.errors import LimitExceeded
from vibench.acquisition.instruments import Knob, PlugInKind, Sweep
from vibench.acquisition.rig import Rig, generator_driver

KIND = PlugInKind.GENERATOR
TONE_HZ = 160.0
SAME = 0.03
QUIET = 0.05
"""Largest level in silence, as a fraction of the played level."""


def level_vpp(bench: Bench) -> float:
    lowest, highest = bench.generator.amplitude_range_vpp
    return float(min(max(LEVEL * bench.rig.generator.amplitude_limit_vpp, 4 * lowest), highest))


def terminal_v(bench: Bench) -> float:
    """Return the terminal amplitude of a sine at the test level [V]."""
    return 0.5 * level_vpp(bench) * bench.rig.generator.terminal_factor()


def is_quiet(bench: Bench) -> bool:
    return float(np.ptp(measured_v(bench, 0.2))) < 2 * QUIET * 2 * terminal_v(bench) + 2e-3


def tone_v(bench: Bench, frequency_hz: float) -> float:
    return line_v(measured_v(bench, 0.5), frequency_hz, bench.digitizer.sample_rate_hz)


def test_the_driver_describes_the_generator_before_opening(rig: Rig) -> None:
    can = generator_driver(rig.generator).describe(rig.generator)
    assert can.name
    assert 0 < can.amplitude_range_vpp[0] < can.amplitude_range_vpp[1]
    assert 2 <= can.memory_points[0] < can.memory_points[1]
    assert can.highest_sine_hz > 0


def test_the_generator_reports_its_identity_and_the_settings_to_confirm(bench: Bench) -> None:
    identity = bench.generator.identity
    assert identity.model
    assert identity.reply
    assert identity == bench.generator.identity
    assert all(isinstance(each, Knob) for each in bench.generator.unconfirmed)
    can = generator_driver(bench.rig.generator).describe(bench.rig.generator)
    lowest, highest = bench.generator.amplitude_range_vpp
    assert can.amplitude_range_vpp[0] <= lowest < highest <= can.amplitude_range_vpp[1]
    assert highest <= bench.rig.generator.amplitude_limit_vpp


def test_the_output_is_silent_after_opening(bench: Bench) -> None:
    bench.digitizer.start()
    assert is_quiet(bench)


def test_a_sine_has_the_requested_amplitude_and_frequency(bench: Bench) -> None:
    bench.generator.load_sine(TONE_HZ, level_vpp(bench))
    bench.digitizer.start()
    assert is_quiet(bench), "load_sine must leave the output as it is"
    bench.generator.start()
    assert tone_v(bench, TONE_HZ) == pytest.approx(terminal_v(bench), rel=SAME)


def test_frequency_and_amplitude_can_change_during_output(bench: Bench) -> None:
    bench.generator.load_sine(TONE_HZ, level_vpp(bench))
    bench.generator.start()
    bench.digitizer.start()
    bench.generator.set_frequency(1.5 * TONE_HZ)
    bench.generator.set_amplitude(0.5 * level_vpp(bench))
    assert tone_v(bench, 1.5 * TONE_HZ) == pytest.approx(0.5 * terminal_v(bench), rel=SAME)


def test_a_waveform_is_played_point_by_point_at_its_repetition_rate(bench: Bench) -> None:
    # The peak is half of full scale: the amplitude setting must refer to full scale, not to the peak.
    fewest, most = generator_driver(bench.rig.generator).describe(bench.rig.generator).memory_points
    points = max(fewest, min(most, 1024))
    turn = 2 * np.pi * np.arange(points) / points
    waveform = 0.35 * np.sin(8 * turn) + 0.15 * np.sin(13 * turn + 1.0)
    bench.generator.load_waveform(waveform, 10.0, level_vpp(bench))
    bench.generator.start()
    bench.digitizer.start()
    volts, rate_hz = measured_v(bench, 1.0), bench.digitizer.sample_rate_hz
    for harmonic, share in ((8, 0.35), (13, 0.15)):
        assert line_v(volts, 10.0 * harmonic, rate_hz) == pytest.approx(share * terminal_v(bench), rel=SAME)


def test_a_sine_plays_correctly_after_a_waveform(bench: Bench) -> None:
    points = 512
    bench.generator.load_waveform(np.sin(2 * np.pi * np.arange(points) / points), 50.0, level_vpp(bench))
    bench.generator.load_sine(TONE_HZ, level_vpp(bench))
    bench.generator.start()
    bench.digitizer.start()
    assert tone_v(bench, TONE_HZ) == pytest.approx(terminal_v(bench), rel=SAME)


@pytest.mark.parametrize("share", [1.01, 100.0, float("nan"), float("inf"), 0.0, -1.0])
def test_an_amplitude_out_of_range_is_refused_and_the_output_stays_silent(bench: Bench, share: float) -> None:
    highest = bench.generator.amplitude_range_vpp[1]
    with pytest.raises(LimitExceeded):
        bench.generator.load_sine(TONE_HZ, share * highest)
    bench.digitizer.start()
    assert is_quiet(bench)


@pytest.mark.parametrize("waveform", [[0.0, 2.0, 0.0, -2.0] * 32, [float("nan"), 0.5] * 64, [0.25] * 128])
def test_a_waveform_that_cannot_be_played_is_refused(bench: Bench, waveform: list[float]) -> None:
    with pytest.raises(LimitExceeded):
        bench.generator.load_waveform(np.array(waveform), 10.0, level_vpp(bench))


def test_a_waveform_with_too_many_points_is_refused(bench: Bench) -> None:
    most = generator_driver(bench.rig.generator).describe(bench.rig.generator).memory_points[1]
    with pytest.raises(LimitExceeded):
        bench.generator.load_waveform(np.sin(np.arange(most + 1)), 10.0, level_vpp(bench))


def test_a_burst_waits_for_its_trigger_and_ends_after_its_cycles(bench: Bench) -> None:
    cycles = 32
    bench.generator.load_sine(TONE_HZ, level_vpp(bench))
    bench.generator.arm_burst(cycles)
    bench.generator.start()
    bench.digitizer.start()
    assert is_quiet(bench), "an armed burst must wait for its trigger"
    bench.generator.trigger()
    volts = measured_v(bench, 1.0)
    played_s = np.count_nonzero(np.abs(volts) > 0.3 * terminal_v(bench)) / bench.digitizer.sample_rate_hz
    assert played_s < cycles / TONE_HZ
    assert is_quiet(bench)
    bench.generator.end_burst()
    assert tone_v(bench, TONE_HZ) == pytest.approx(terminal_v(bench), rel=SAME)


def test_a_built_in_sweep_waits_for_its_trigger_and_ends_at_its_stop_frequency(bench: Bench) -> None:
    sweep = Sweep(TONE_HZ, 1.25 * TONE_HZ, 2.0)
    can = generator_driver(bench.rig.generator).describe(bench.rig.generator)
    if can.longest_sweep_s < sweep.duration_s:
        with pytest.raises(LimitExceeded):
            bench.generator.load_sweep(sweep, level_vpp(bench))
        return
    bench.generator.load_sweep(sweep, level_vpp(bench))
    bench.generator.start()
    bench.digitizer.start()
    assert tone_v(bench, sweep.start_hz) == pytest.approx(terminal_v(bench), rel=SAME)
    bench.generator.trigger()
    row = bench.digitizer.roles.index("drive_voltage")
    rate_hz = bench.digitizer.sample_rate_hz
    volts = bench.digitizer.read(int(2.5 * rate_hz)).volts[row]
    rises = np.count_nonzero((volts[:-1] < 0) & (volts[1:] >= 0))
    # Samples before the trigger have the start frequency; samples after the end have the stop frequency.
    swept = sweep.duration_s * (sweep.start_hz + sweep.stop_hz) / 2
    assert swept + 0.5 * sweep.start_hz - 2 <= rises <= swept + 0.5 * sweep.stop_hz + 2
    assert tone_v(bench, sweep.stop_hz) == pytest.approx(terminal_v(bench), rel=SAME)


def test_the_measured_command_latency_is_between_zero_and_five_seconds(bench: Bench) -> None:
    bench.generator.load_sine(TONE_HZ, level_vpp(bench))
    assert 0 < bench.generator.measured_latency_s() < 5.0


def test_stop_silences_the_output_at_any_time(bench: Bench) -> None:
    bench.generator.stop()
    bench.generator.load_sine(TONE_HZ, level_vpp(bench))
    bench.generator.start()
    bench.generator.stop()
    bench.generator.stop()
    bench.digitizer.start()
    assert is_quiet(bench)


def test_closing_silences_the_output_and_may_be_repeated(bench: Bench) -> None:
    level = level_vpp(bench)
    bench.generator.load_sine(TONE_HZ, level)
    bench.generator.start()
    bench.generator.close()
    bench.generator.close()
    bench.generator.stop()
    bench.digitizer.start()
    assert is_quiet(bench)
    with refusal():
        bench.generator.load_sine(TONE_HZ, level)
