"""What is predicted of a plan: base amplitudes from the rig's model, collision bands from the points."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.excitation.sine_sweep import SineSweep
from acquisition.plan.campaign import load_campaign
from acquisition.plan.loads import predicted_loads
from acquisition.plan.measurement import Measurement
from acquisition.rig.configuration import load_rig
from acquisition.rig.model import Quantity
from analysis.foresight import bands_of, base_amplitude_m, foresee

ROOT = Path(__file__).resolve().parents[2]
QUICK = {each.name: each for each in load_campaign(ROOT / "campaigns" / "quick.toml").measurements}
RIG = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")


def test_bands_reach_half_way_to_the_next_point():
    frequency_hz = np.array([10.0, 20.0, 30.0, 40.0, 50.0])
    inside = np.array([True, False, True, True, False])
    assert bands_of(frequency_hz, inside) == ((10.0, 15.0), (25.0, 45.0))


def test_no_point_inside_is_no_band():
    assert bands_of(np.array([10.0, 20.0]), np.array([False, False])) == ()


def test_the_amplitude_of_a_dwell_is_the_stroke_of_its_plan():
    measurement = QUICK["dwell"]
    amplitude_m, _ = base_amplitude_m(measurement, RIG, np.array([260.0]))
    assert amplitude_m[0] == pytest.approx(predicted_loads(measurement.excitation, RIG)[Quantity.STROKE].peak)


def test_noise_is_stood_for_by_a_sine_of_the_same_rms():
    amplitude_m, basis = base_amplitude_m(QUICK["noise"], RIG, np.array([100.0, 200.0]))
    rms_m = predicted_loads(QUICK["noise"].excitation, RIG)[Quantity.STROKE].rms
    assert amplitude_m == pytest.approx(np.sqrt(2) * rms_m)
    assert "rms" in basis


@pytest.mark.parametrize(
    ("start_hz", "stop_hz", "begins_hz"), [(150.0, 350.0, (216.0, 225.0)), (350.0, 150.0, (149.0, 214.0))]
)
def test_a_sweep_is_predicted_on_the_branch_that_it_comes_along(start_hz, stop_hz, begins_hz):
    """Upwards the specimen stays clear of the stops until its linear motion reaches them; downwards it
    goes on striking far below."""
    sweep = SineSweep(
        amplitude_vpp=1.5, start_hz=start_hz, stop_hz=stop_hz, duration_s=60, hold="displacement"
    )
    seen = foresee(Measurement(name="sweep", excitation=sweep), RIG)
    low, _ = seen.collision_bands_hz[0]
    assert begins_hz[0] < low < begins_hz[1]


@pytest.mark.slow
def test_a_dwell_inside_the_region_is_predicted_to_collide_there():
    seen = foresee(QUICK["dwell"], RIG)
    assert any(low < 260 < high for low, high in seen.collision_bands_hz)
    assert np.nanmax(seen.prediction.response_i) > 1
