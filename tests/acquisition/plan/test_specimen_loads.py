"""The specimen's motion foretold by a plan: exact while nothing collides, near the truth when it does."""

import numpy as np
import pytest

from vibench.acquisition import LimitExceeded
from vibench.acquisition.plan import (
    Dwell,
    Measurement,
    MultisineNoise,
    SineSweep,
    StreamedNoise,
    require_within_limits,
)
from vibench.acquisition.plan._limits import limit_checks
from vibench.acquisition.plan._specimen_loads import predicted_specimen_loads
from vibench.acquisition.rig import BaseQuantity, RigModel, specimen_of
from vibench.sim import Harmonic, base_response, base_transmissibility, steady_response


def base_m(rig, amplitude_vpp, frequency_hz):
    """Amplitude of the base at a sine's setting [m]."""
    terminal_v = 0.5 * amplitude_vpp * rig.generator.terminal_factor()
    return terminal_v * abs(complex(RigModel(rig).transfer(BaseQuantity.STROKE, frequency_hz)))


def test_a_sine_that_touches_no_stop_is_foretold_exactly(rig):
    loads = predicted_specimen_loads(Dwell(amplitude_vpp=0.02, frequency_hz=266, duration_s=1), rig)
    moved = base_transmissibility(specimen_of(rig), 266.0)[0, 0]
    base = base_m(rig, 0.02, 266.0)
    assert loads.amplitude.peak == pytest.approx(base * abs(moved - 1), rel=1e-9)
    assert loads.velocity.peak == pytest.approx(2 * np.pi * 266 * base * abs(moved), rel=1e-9)
    assert loads.amplitude.cause == "at 266 Hz"


@pytest.mark.parametrize("frequency_hz", [180.0, 201.0, 440.0])
def test_a_sine_that_drives_the_stops_is_foretold_within_a_half(rig, frequency_hz):
    loads = predicted_specimen_loads(Dwell(amplitude_vpp=8, frequency_hz=frequency_hz, duration_s=1), rig)
    drive = Harmonic(frequency_hz, base_m(rig, 8.0, frequency_hz))
    settled = steady_response(specimen_of(rig), drive, duration_s=12.0, window_s=2.0)
    # Absolute displacement against relative to the base: far more than the base moves in these resonances.
    assert loads.amplitude.peak == pytest.approx(settled.largest_x_m, rel=0.5)


@pytest.mark.parametrize("kind", [MultisineNoise, StreamedNoise])
def test_noise_is_foretold_by_its_lines_free_while_weak_and_stuck_when_strong(rig, kind):
    band = {"band_start_hz": 50.0, "band_stop_hz": 600.0}
    more = {"duration_s": 1.0} if kind is StreamedNoise else {"repetition_hz": 1.0, "realisations": 1}
    weak, strong = (kind(amplitude_vpp=level, **band, **more) for level in (0.02, 10.0))
    hz = np.arange(50.0, 600.0, 0.25)
    answer = base_response(specimen_of(rig), hz)
    base = RigModel(rig).transfer(BaseQuantity.STROKE, hz)

    def rms_m(noise, x_over_base):
        """Of noise that is as strong at every frequency of its band, through a linear specimen."""
        volts = noise.preview(2048.0).rms_v * rig.generator.terminal_factor()
        return volts * np.sqrt(np.mean(np.abs(base * (x_over_base - 1)) ** 2))

    assert predicted_specimen_loads(weak, rig).amplitude.rms == pytest.approx(
        rms_m(weak, answer.free_x), rel=0.1
    )
    against = predicted_specimen_loads(strong, rig).amplitude.rms
    assert 0.95 < against / rms_m(strong, answer.stuck_x) < 1.25


def test_a_specimen_without_stops_swings_with_the_drive(rig):
    free = rig.model_copy(update={"specimen": rig.specimen.model_copy(update={"contact": "linear"})})
    low, high = (
        predicted_specimen_loads(Dwell(amplitude_vpp=level, frequency_hz=266, duration_s=1), free)
        for level in (0.1, 10.0)
    )
    assert high.amplitude.peak == pytest.approx(100 * low.amplitude.peak)


def test_a_plan_that_would_overstretch_the_specimen_is_refused_before_anything_moves(rig):
    sweep = SineSweep(amplitude_vpp=9.9, start_hz=180, stop_hz=220, duration_s=60)
    with pytest.raises(LimitExceeded, match=r"the specimen's amplitude \(about, at 201.*keep away from"):
        require_within_limits(Measurement(name="plan", excitation=sweep), rig)


def test_the_vibrometer_s_range_stands_in_the_table(rig):
    dwell = Measurement(name="plan", excitation=Dwell(amplitude_vpp=1, frequency_hz=266, duration_s=1))
    told = {check.what: check for check in limit_checks(dwell, rig)}
    velocity = told["the velocity of m0 (about, at 266 Hz)"]
    vibrometer = next(each for each in rig.daq.channels if each.role == "m0_velocity")
    assert vibrometer.physical in velocity.source
    assert 0 < velocity.use < 1
