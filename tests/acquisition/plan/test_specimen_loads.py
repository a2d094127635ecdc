"""Predicted motion of the specimen: exact without contact, approximate with contact."""

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st

from vibench.acquisition import LimitExceeded
from vibench.acquisition.plan import (
    Dwell,
    Measurement,
    SineSweep,
    StreamedNoise,
    WhiteNoise,
    predicted_loads,
    require_within_limits,
)
from vibench.acquisition.plan._limits import limit_checks
from vibench.acquisition.rig import BaseQuantity, RigModel, amplifier_of, shaker_of, specimen_of
from vibench.sim.shaker.loaded_shaker import LoadedShaker

RATE_HZ = 51_200.0


def peak_m(rig, amplitude_vpp, frequency_hz):
    """Return the largest displacement of m0 relative to the table in the last of six seconds [m]."""
    step_s = 1 / RATE_HZ
    shaken = LoadedShaker(amplifier_of(rig), shaker_of(rig), specimen_of(rig), step_s)
    middle_s = (np.arange(round(6 * RATE_HZ)) + 0.5) * step_s
    volts = 0.5 * amplitude_vpp * rig.generator.terminal_factor()
    motion = shaken.move(volts * np.sin(2 * np.pi * frequency_hz * middle_s), end_rows=middle_s.size)
    relative = motion.ends[-round(RATE_HZ) :, 3] - motion.ends[-round(RATE_HZ) :, 0]
    return np.max(np.abs(relative))


def test_predicted_motion_without_contact_matches_the_linear_response(rig):
    loads = predicted_loads(Dwell(amplitude_vpp=0.02, frequency_hz=266, duration_s=1), rig)
    assert loads[BaseQuantity.P].peak < specimen_of(rig).gap_m
    assert loads[BaseQuantity.AMPLITUDE].peak == pytest.approx(peak_m(rig, 0.02, 266.0), rel=2e-3)
    assert loads[BaseQuantity.AMPLITUDE].cause == "at 266 Hz"


@pytest.mark.parametrize("frequency_hz", [180.0, 201.0, 440.0])
def test_predicted_motion_with_contact_is_within_50_percent_of_the_simulation(rig, frequency_hz):
    loads = predicted_loads(Dwell(amplitude_vpp=8, frequency_hz=frequency_hz, duration_s=1), rig)
    assert loads[BaseQuantity.AMPLITUDE].peak == pytest.approx(peak_m(rig, 8.0, frequency_hz), rel=0.5)


@pytest.mark.thorough
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(frequency_hz=st.floats(150, 300), level=st.floats(0.05, 0.99))
@example(frequency_hz=195.0, level=0.5)
def test_motion_during_ramps_stays_within_the_prediction(rig, frequency_hz, level):
    """At ramp levels the base may move more than at full level, since contact removes the antiresonance."""
    model = RigModel(rig)
    loads = predicted_loads(Dwell(amplitude_vpp=8, frequency_hz=frequency_hz, duration_s=1), rig)
    passed_v = 0.5 * 8 * level * rig.generator.terminal_factor()
    for quantity in BaseQuantity:
        passed = np.abs(model.under_sines(quantity, np.array([frequency_hz]), passed_v))[0]
        assert passed <= 1.05 * loads[quantity].peak, quantity


@pytest.mark.parametrize("kind", [WhiteNoise, StreamedNoise])
def test_predicted_noise_loads_follow_the_linear_response_with_free_or_stuck_masses(rig, kind):
    band = {"band_start_hz": 50.0, "band_stop_hz": 600.0}
    more = {"duration_s": 1.0} if kind is StreamedNoise else {"repetition_hz": 1.0, "realisations": 1}
    weak, strong = (kind(amplitude_vpp=level, **band, **more) for level in (0.02, 10.0))
    hz, model = np.arange(50.0, 600.0, 0.25), RigModel(rig)

    def rms_m(noise, transfer):
        """Return the rms displacement [m] of a linear specimen driven by noise with a flat spectrum."""
        volts = noise.preview(2048.0).rms_v * rig.generator.terminal_factor()
        return volts * np.sqrt(np.mean(np.abs(transfer(BaseQuantity.AMPLITUDE, hz)) ** 2))

    free, against = (predicted_loads(noise, rig)[BaseQuantity.AMPLITUDE].rms for noise in (weak, strong))
    assert free == pytest.approx(rms_m(weak, model.transfer), rel=0.1)
    assert 0.95 < against / rms_m(strong, model.stuck_transfer) < 1.25


def test_the_loads_of_a_specimen_without_stops_are_proportional_to_the_drive(rig):
    free = rig.model_copy(update={"specimen": rig.specimen.model_copy(update={"contact": "linear"})})
    low, high = (
        predicted_loads(Dwell(amplitude_vpp=level, frequency_hz=266, duration_s=1), free)
        for level in (0.1, 10.0)
    )
    for quantity in (BaseQuantity.AMPLITUDE, BaseQuantity.P, BaseQuantity.STROKE):
        assert high[quantity].peak == pytest.approx(100 * low[quantity].peak)


def test_a_plan_that_overstretches_the_specimen_is_refused(rig):
    sweep = SineSweep(amplitude_vpp=9.9, start_hz=180, stop_hz=220, duration_s=60)
    with pytest.raises(LimitExceeded, match=r"specimen's amplitude \(estimated, at 2\d\d.*avoid the"):
        require_within_limits(Measurement(name="plan", excitation=sweep), rig)


def test_the_limit_checks_include_the_vibrometer_range(rig):
    dwell = Measurement(name="plan", excitation=Dwell(amplitude_vpp=1, frequency_hz=266, duration_s=1))
    told = {check.what: check for check in limit_checks(dwell, rig)}
    velocity = told["the velocity of m0 (estimated, at 266 Hz)"]
    vibrometer = next(each for each in rig.daq.channels if each.role == "m0_velocity")
    assert vibrometer.physical in velocity.source
    assert 0 < velocity.use < 1
