"""Predictions for a plan: base amplitudes from the rig model, collision bands from simulated points."""

from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import load_campaign
from vibench.acquisition.plan import Measurement, SineSweep, base_motion, predicted_loads
from vibench.acquisition.rig import BaseQuantity, load_rig
from vibench.analysis import predict_measurement
from vibench.analysis.overlay.overlay import bands_of

ROOT = Path(__file__).resolve().parents[3]
QUICK = {each.name: each for each in load_campaign(ROOT / "campaigns" / "quick.toml").measurements}
RIG = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")


def test_collision_bands_extend_halfway_to_the_next_point():
    frequency_hz = np.array([10.0, 20.0, 30.0, 40.0, 50.0])
    inside = np.array([True, False, True, True, False])
    assert bands_of(frequency_hz, inside) == ((10.0, 15.0), (25.0, 45.0))


def test_the_predicted_base_amplitude_of_a_dwell_is_the_predicted_stroke_of_its_plan():
    measurement = QUICK["dwell"]
    base = base_motion(measurement.excitation, RIG, np.array([260.0]))
    assert base.amplitude_m[0] == pytest.approx(
        predicted_loads(measurement.excitation, RIG)[BaseQuantity.STROKE].peak
    )


def test_the_prediction_represents_noise_by_a_sine_of_equal_rms():
    base = base_motion(QUICK["noise"].excitation, RIG, np.array([100.0, 200.0]))
    rms_m = predicted_loads(QUICK["noise"].excitation, RIG)[BaseQuantity.STROKE].rms
    assert base.amplitude_m == pytest.approx(np.sqrt(2) * rms_m)
    assert "rms" in base.basis


def lowest_hz(start_hz, stop_hz, amplitude_vpp):
    """Return the lowest frequency [Hz] at which a sweep is predicted to collide."""
    sweep = SineSweep(
        amplitude_vpp=amplitude_vpp, start_hz=start_hz, stop_hz=stop_hz, duration_s=60, hold="displacement"
    )
    return predict_measurement(Measurement(name="sweep", excitation=sweep), RIG).collision_bands_hz[0][0]


@pytest.mark.thorough
def test_a_downward_sweep_keeps_colliding_to_lower_frequencies_than_an_upward_sweep():
    """Upwards collisions begin where the linear motion closes the gap; downwards they last longer,
    down to a frequency that varies with the chaotic motion."""
    levels_vpp = (1.45, 1.5, 1.55)
    rising = [lowest_hz(150.0, 350.0, each) for each in levels_vpp]
    falling = [lowest_hz(350.0, 150.0, each) for each in levels_vpp]
    # Time simulation at 1.45 Vpp: collisions from 230.7 Hz upwards and down to 218.0 Hz.
    assert rising[0] == pytest.approx(230.7, abs=2.0)
    assert all(224.0 < each < 233.0 for each in rising)
    assert all(down < up - 1.0 for down, up in zip(falling, rising, strict=True))
    assert min(falling) < 223.0
