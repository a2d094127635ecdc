"""What a plan will know, said before it is played, against what its recording says afterwards."""

from pathlib import Path

import pytest

from vibench.acquisition import open_bench, run_measurement
from vibench.acquisition.plan import Dwell, Measurement, MultisineNoise, SineSweep
from vibench.acquisition.rig import load_rig
from vibench.analysis import Simulation, analyse_files, budgets_of, expected_uncertainty
from vibench.analysis.uncertainty import Cause
from vibench.analysis.uncertainty._expected import _simulated_scatter
from vibench.sim import gong2025

RIG = load_rig(Path(__file__).parents[3] / "hardware_configs" / "virtual_rig.toml")
NOISE = MultisineNoise(
    amplitude_vpp=0.05,
    band_start_hz=50,
    band_stop_hz=600,
    repetition_hz=2,
    realisations=8,
    periods=2,
    settle_s=1.5,
)


@pytest.mark.thorough
def test_noise_is_known_as_well_as_was_said_before(tmp_path):
    plan = Measurement(name="weak", excitation=NOISE, ramp_s=0.3)
    expected = expected_uncertainty(plan, RIG)
    path = tmp_path / "weak.h5"
    with open_bench(RIG) as bench:
        run_measurement(bench, plan, path)
    budgets = budgets_of(analyse_files([path], "weak", Simulation.LEFT_OUT).results[0])
    assert len(budgets) == len(expected) == 9
    for said, found in zip(expected, budgets, strict=True):
        assert said.quantity == found.quantity
        assert said.not_stated == found.not_stated
        # An estimate: fits lose something to their background, and scatter is of few realisations.
        assert 0.25 < said.scatter / found.share(Cause.NOISE) < 2.5, said.quantity


def test_four_times_the_time_halves_the_scatter_and_no_calibration():
    rig = RIG.model_copy(
        update={
            "vibrometer": RIG.vibrometer.model_validate(
                RIG.vibrometer.model_dump()
                | {"uncertainty": {"relative": 0.01, "source": "certificate"}, "calibrated": "2026-02-10"}
            )
        }
    )
    plan = Measurement(name="weak", excitation=NOISE)
    before, stated = (expected_uncertainty(plan, each) for each in (RIG, rig))
    for each in before:
        assert each.after(4 * each.time_s) == pytest.approx(0.5 * each.after(each.time_s))
    assert stated[2].quantity.startswith("transmissibility")
    assert stated[2].after(1e9) == pytest.approx(0.01)
    assert Cause.VIBROMETER not in stated[2].not_stated


def test_noise_that_collides_promises_nothing():
    plan = Measurement(name="strong", excitation=NOISE.model_copy(update={"amplitude_vpp": 3.0}))
    for each in expected_uncertainty(plan, RIG):
        assert each.after(10.0) is None
        assert "may collide" in each.sentence


def test_a_chaotic_dwell_is_told_to_be_chance_and_a_quiet_one_noise():
    def dwell(level_vpp):
        excitation = Dwell(amplitude_vpp=level_vpp, frequency_hz=260, settle_s=2, duration_s=8)
        return expected_uncertainty(Measurement(name="dwell", excitation=excitation), RIG)

    first, second = dwell(1.5)
    assert first.cause is second.cause is Cause.CHANCE
    assert first.after(5.0) == first.after(500.0) > 0.01
    assert 0.01 < second.after(5.0) < 0.2
    assert {each.cause for each in dwell(0.05)} == {Cause.NOISE}


def test_response_i_of_a_quiet_dwell_is_not_promised_from_the_sensors_noise_alone():
    """A recording of it has 0.7 % where the sensors' noise, averaged over the window, makes 0.002 %."""
    excitation = Dwell(amplitude_vpp=0.05, frequency_hz=260, settle_s=2, duration_s=8)
    first, second = expected_uncertainty(Measurement(name="dwell", excitation=excitation), RIG)
    assert first.after(5.0) is None
    assert "Response I: not known beforehand, for noise in the motion lifts" in first.sentence
    assert 1e-6 < second.after(5.0) < 1e-3


def test_a_rig_that_states_no_noise_is_told_so_and_a_sweep_promises_nothing():
    silent = RIG.model_copy(update={"virtual": None})
    (first, *_) = expected_uncertainty(Measurement(name="weak", excitation=NOISE), silent)
    assert "the sensors' noise is not stated" in first.sentence
    sweep = SineSweep(amplitude_vpp=1.5, start_hz=220, stop_hz=310, duration_s=6)
    assert expected_uncertainty(Measurement(name="up", excitation=sweep), RIG) == ()


def test_a_dwell_of_hours_a_period_promises_nothing():
    slow = Dwell(amplitude_vpp=1.5, frequency_hz=1e-4, settle_s=0.1, duration_s=1)
    assert expected_uncertainty(Measurement(name="slow", excitation=slow), RIG) == ()


def test_a_motion_that_cannot_be_computed_has_no_scatter():
    assert _simulated_scatter(gong2025(), 1e99, 260.0, 5.0) is None


@pytest.mark.parametrize(("duration_s", "window_s"), [(2.0, 2.0), (30.0, 5.0)])
def test_a_dwell_is_looked_at_over_its_window_or_all_of_it(duration_s, window_s):
    """Of four seconds it said "after 5 s as planned"."""
    dwell = Dwell(amplitude_vpp=0.05, frequency_hz=130.0, settle_s=1.0, duration_s=duration_s)
    found = expected_uncertainty(Measurement(name="dwell", excitation=dwell), RIG)
    assert {each.time_s for each in found} == {window_s}
