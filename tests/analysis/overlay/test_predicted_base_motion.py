"""Predictions of shipped measurements use the base motion that the measurement holds."""

from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import load_campaign
from vibench.acquisition.excitation.steps import HeldAcceleration
from vibench.acquisition.plan import Approach, base_motion
from vibench.acquisition.rig import load_rig
from vibench.analysis import predict_measurement

ROOT = Path(__file__).resolve().parents[3]
RIG = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")
SHIPPED = {
    f"{path.stem}-{point.name}": point.measurement
    for path in sorted((ROOT / "campaigns").glob("*.toml"))
    for point in load_campaign(path).points()
}
HELD_UM = {
    "smart-mode_1": 0.287,
    "smart-mode_2": 0.221,
    "smart-mode_3": 0.0633,
    "smart-backbone_1": 1.872,
    "smart-steps_there_and_back": 5.0,
    "smart-period_2": 30.0,
    "smart-period_3": 40.0,
    "smart-dwell_260": 5.0,
    "smart-sweep_held": 5.0,
    "branch-branch_3um": 3.0,
    "superharmonic-superharmonic_3": 494.7,
}
"""Highest held level of the base in each plan, as a displacement at the played frequency [um]."""


def played_hz(excitation):
    """Return the frequencies [Hz] of the recorded sines."""
    return np.unique([step.play.frequency_hz for step in excitation.steps()])


@pytest.mark.parametrize("name", SHIPPED)
def test_the_base_motion_is_controlled_only_if_the_plan_holds_a_level(name):
    assert (name in HELD_UM) == bool(list(SHIPPED[name].excitation.held_accelerations()))


@pytest.mark.parametrize(("name", "held_um"), HELD_UM.items())
def test_the_predicted_base_motion_equals_the_held_level(name, held_um):
    excitation = SHIPPED[name].excitation
    base = base_motion(excitation, RIG, played_hz(excitation))
    np.testing.assert_allclose(1e6 * base.amplitude_m, held_um, rtol=2e-3)
    assert base.basis == HeldAcceleration.basis


@pytest.mark.parametrize(
    ("name", "approach", "said"),
    [
        ("smart-mode_1", Approach.REST, "0.275 µm to 0.299 µm"),
        ("smart-steps_there_and_back", Approach.UP, "5 µm"),
        ("smart-dwell_260", Approach.REST, "5 µm"),
        ("smart-sweep_held", Approach.UP, "5 µm"),
    ],
)
def test_the_specimen_is_simulated_at_the_held_motion_over_the_whole_band(name, approach, said):
    excitation = SHIPPED[name].excitation
    seen = predict_measurement(SHIPPED[name], RIG)
    frequency_hz = seen.prediction.frequency_hz
    held = [excitation.level_at(float(each)).amplitude_m_per_s2 for each in frequency_hz]
    np.testing.assert_allclose(seen.prediction.amplitude_m, held / (2 * np.pi * frequency_hz) ** 2)
    assert (seen.approach, seen.base_text) == (approach, said)
