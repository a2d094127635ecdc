"""Predicted loads match closed forms, and plans beyond a limit are refused."""

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from scipy.signal import lsim

from vibench.acquisition import LimitExceeded
from vibench.acquisition.excitation.steps import Waveform
from vibench.acquisition.plan import (
    Dwell,
    Measurement,
    SineSweep,
    StreamedNoise,
    WhiteNoise,
    predicted_loads,
    require_within_limits,
    shortest_ramp_s,
)
from vibench.acquisition.plan._limits import limit_checks
from vibench.acquisition.rig import BaseQuantity, RigModel, shaker_of


@pytest.fixture
def linear_rig(rig):
    """Return a rig whose specimen has no contact."""
    return rig.model_copy(update={"specimen": rig.specimen.model_copy(update={"contact": "linear"})})


def plan(excitation, **fields):
    return Measurement(name="plan", excitation=excitation, **fields)


def test_the_predicted_loads_of_a_sine_are_its_amplitude_times_the_transfer_functions(rig):
    loads = predicted_loads(Dwell(amplitude_vpp=0.1, frequency_hz=260, duration_s=1), rig)
    for quantity in BaseQuantity:
        expected = 0.05 * rig.generator.terminal_factor() * abs(RigModel(rig).transfer(quantity, 260.0))
        assert loads[quantity].peak == pytest.approx(float(expected), rel=1e-12)
        assert loads[quantity].rms == pytest.approx(float(expected) / np.sqrt(2), rel=1e-12)


def test_the_acceleration_far_above_the_suspension_resonance_is_force_over_mass(rig):
    loads = predicted_loads(Dwell(amplitude_vpp=1.0, frequency_hz=1500, duration_s=1), rig)
    mass = rig.shaker.moving_mass_kg + rig.shaker.fixture_mass_kg
    assert loads[BaseQuantity.ACCELERATION].peak == pytest.approx(
        loads[BaseQuantity.FORCE].peak / mass, rel=5e-3
    )


def test_a_sweep_is_checked_at_the_largest_response_of_the_rig(rig):
    sweep = SineSweep(amplitude_vpp=1, start_hz=10, stop_hz=100, duration_s=100)
    loads = predicted_loads(sweep, rig)
    grid_hz = np.linspace(10, 100, 20_000)
    highest = np.max(np.abs(RigModel(rig).transfer(BaseQuantity.STROKE, grid_hz)))
    expected = 0.5 * rig.generator.terminal_factor() * highest
    assert loads[BaseQuantity.STROKE].peak == pytest.approx(expected, rel=1e-3)


def test_predicted_peaks_of_a_waveform_match_time_integration(rig):
    """Compare the Fourier prediction with time integration, with a specimen of almost no mass."""
    light = {"masses_kg": tuple(1e-6 * each for each in rig.specimen.masses_kg), "contact": "linear"}
    rig = rig.model_copy(update={"specimen": rig.specimen.model_copy(update=light)})
    noise = WhiteNoise(amplitude_vpp=2.0, band_start_hz=20, band_stop_hz=200, repetition_hz=2, realisations=1)
    loads = predicted_loads(noise, rig)
    (step,) = noise.steps()
    assert isinstance(step.play, Waveform)
    fine = 8
    held = np.tile(np.repeat(step.play.values, fine), 3)
    time_s = np.arange(len(held)) / (8192 * fine * 2)
    space = shaker_of(rig).equations()
    terminal_v = held * 0.5 * 2.0 * rig.generator.terminal_factor()
    # The band edges of the amplifier are far outside 20 to 200 Hz: its gain is sufficient here.
    voltage = terminal_v * rig.amplifier.gain
    _, _, states = lsim((space.A, space.B[:, :1], np.eye(3), np.zeros((3, 1))), voltage, time_s, interp=False)
    last = states[-len(held) // 3 :]
    assert loads[BaseQuantity.STROKE].peak == pytest.approx(np.max(np.abs(last[:, 0])), rel=0.02)
    assert loads[BaseQuantity.VELOCITY].peak == pytest.approx(np.max(np.abs(last[:, 1])), rel=0.02)
    assert loads[BaseQuantity.CURRENT].peak == pytest.approx(np.max(np.abs(last[:, 2])), rel=0.02)


def test_the_predicted_peak_of_streamed_noise_is_half_its_peak_to_peak_voltage(rig):
    noise = StreamedNoise(amplitude_vpp=2.0, band_start_hz=50, band_stop_hz=800, duration_s=1)
    volts = predicted_loads(noise, rig)[BaseQuantity.AMPLIFIER_VOLTAGE]
    assert volts.peak == pytest.approx(rig.generator.terminal_factor() * rig.amplifier.gain, rel=2e-3)
    assert volts.rms == pytest.approx(volts.peak / 4.5)


@pytest.mark.thorough
@given(factor=st.floats(0.01, 5))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_predicted_loads_are_proportional_to_the_generator_setting(linear_rig, factor):
    one = predicted_loads(Dwell(amplitude_vpp=1.0, frequency_hz=50, duration_s=1), linear_rig)
    more = predicted_loads(Dwell(amplitude_vpp=factor, frequency_hz=50, duration_s=1), linear_rig)
    for quantity in BaseQuantity:
        assert more[quantity].peak == pytest.approx(factor * one[quantity].peak, rel=1e-12)


def test_a_wrong_load_setting_doubles_every_load(linear_rig):
    generator = linear_rig.generator.model_copy(update={"load_ohm": 50.0})
    at_50_ohm = linear_rig.model_copy(update={"generator": generator})
    sine = Dwell(amplitude_vpp=1.0, frequency_hz=260, duration_s=1)
    open_load = predicted_loads(sine, linear_rig)[BaseQuantity.FORCE].peak
    assert predicted_loads(sine, at_50_ohm)[BaseQuantity.FORCE].peak == pytest.approx(
        2 * open_load, rel=1e-12
    )


def test_a_limit_violation_names_the_quantity_the_value_the_limit_the_source_and_the_remedy(rig):
    with pytest.raises(LimitExceeded) as refused:
        require_within_limits(plan(Dwell(amplitude_vpp=10, frequency_hz=20, duration_s=1)), rig)
    text = str(refused.value)
    assert text.startswith("plan: the stroke (at 20 Hz, peak) would be 0.00")
    assert "but must be at most 0.004 m (4809 manual: 8 mm peak to peak between the rubber stops)" in text
    assert "lower amplitude_vpp or raise the lowest frequency" in text
    assert text.endswith("Nothing was played.")


def test_an_error_describes_the_three_largest_violations_and_counts_the_other_violations(rig):
    loud = plan(Dwell(amplitude_vpp=18, frequency_hz=5000, duration_s=1), ramp_s=0.05, ramp_step_s=0.01)
    violations = [check for check in limit_checks(loud, rig) if check.forbids]
    with pytest.raises(LimitExceeded) as refused:
        require_within_limits(loud, rig)
    text = str(refused.value)
    named = [check.what for check in sorted(violations, key=lambda each: -each.use) if check.what in text]
    assert named == [check.what for check in sorted(violations, key=lambda each: -each.use)[:3]]
    assert text.endswith(f"; and {len(violations) - 3} more. Nothing was played.")


def test_a_value_equal_to_its_limit_is_allowed(rig):
    setting = rig.generator.amplitude_limit_vpp
    checks = limit_checks(plan(Dwell(amplitude_vpp=setting, frequency_hz=400, duration_s=1)), rig)
    assert checks[0].use == 1.0
    assert checks[0].is_kept


def test_the_shortest_ramp_is_three_periods_of_the_loaded_suspension(rig):
    shaker = rig.shaker
    mass = shaker.moving_mass_kg + shaker.fixture_mass_kg
    period_s = 2 * np.pi * np.sqrt(mass / shaker.suspension_stiffness_n_per_m)
    assert shortest_ramp_s(rig) == pytest.approx(3 * period_s)


@pytest.mark.parametrize(
    ("excitation", "said"),
    [
        (
            SineSweep(amplitude_vpp=1.5, start_hz=10, stop_hz=350, duration_s=20, hold="displacement"),
            r"the lowest setting would be 0\.00122449 Vpp, but must be at least 0\.002 Vpp",
        ),
        (Dwell(amplitude_vpp=0.0019, frequency_hz=160, duration_s=1), "smallest setting of the function"),
        (Dwell(amplitude_vpp=25, frequency_hz=160, duration_s=1), r"at most 20 Vpp \(range of the AFG1022"),
        (
            WhiteNoise(amplitude_vpp=1, band_start_hz=20, band_stop_hz=200, points=16384),
            r"points of a period would be 16384 points, but must be at most 8192 points",
        ),
    ],
)
def test_signals_beyond_the_described_generator_limits_are_refused(rig, excitation, said):
    violations = [check.complaint() for check in limit_checks(plan(excitation), rig) if check.forbids]
    assert re.search(said, "; ".join(violations))
