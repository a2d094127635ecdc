"""Predicted time of measurements with `until`, distribution of campaign time, widened bounds."""

import subprocess
import sys
from pathlib import Path

import pytest

from vibench.acquisition import ConfigurationError
from vibench.acquisition.plan import Campaign, Dwell, Measurement, SteppedSine, Until, WhiteNoise
from vibench.acquisition.rig import load_rig
from vibench.analysis import expected_recorded_s, expected_uncertainty, fit_to, recorded_s
from vibench.analysis.uncertainty.budget import WIDENING, Budget, Cause, Contribution
from vibench.analysis.uncertainty.expected import time_to_wishes_s

ROOT = Path(__file__).parents[3]
RIG = load_rig(ROOT / "hardware_configs" / "virtual_rig.toml")
NOISE = WhiteNoise(amplitude_vpp=0.05, band_start_hz=20, band_stop_hz=800, realisations=20)
QUIET = Dwell(amplitude_vpp=0.1, frequency_hz=200, duration_s=60)


def plan(excitation, until, name="a"):
    return Measurement(name=name, excitation=excitation, until=until)


def reachable_uncertainty(time_s):
    """Return the frequency uncertainty [Hz] that noise is expected to reach after a time."""
    found = expected_uncertainty(plan(NOISE, None), RIG)
    return WIDENING * max(each.after(time_s) for each in found if each.quantity.endswith("frequency"))


@pytest.mark.thorough
def test_the_predicted_time_to_reach_a_target_inverts_the_expected_uncertainty_over_time():
    for time_s in (20.0, 80.0, 320.0):
        found_s = time_to_wishes_s(plan(NOISE, Until(resonance_hz=reachable_uncertainty(time_s))), RIG)
        assert found_s == pytest.approx(time_s, rel=1e-6)


@pytest.mark.thorough
def test_a_recording_is_predicted_to_end_at_one_of_its_analyses_or_at_its_longest_time():
    times_s = [
        expected_recorded_s(plan(NOISE, Until(resonance_hz=reachable_uncertainty(time_s))), RIG)
        for time_s in (1.0, 12.0, 1000.0)
    ]
    assert times_s == pytest.approx([8.0, 16.0, 40.0])


def test_the_recording_time_of_a_stepped_sine_is_the_sum_over_its_steps():
    steps = SteppedSine(amplitude_vpp=0.1, frequencies_hz=(150, 160, 170), record_s=30)
    assert expected_recorded_s(plan(steps, Until(response_ii=0.01)), RIG) == pytest.approx(6.0)


def test_a_plan_without_a_predictable_target_has_no_expected_recording_time():
    assert expected_recorded_s(plan(QUIET, Until(response_i=0.01)), RIG) is None
    assert expected_recorded_s(plan(QUIET, None), RIG) is None


@pytest.mark.thorough
def test_the_time_of_a_campaign_is_distributed_in_proportion_to_the_needed_times():
    first = plan(NOISE, Until(resonance_hz=reachable_uncertainty(50.0)), "first")
    second = plan(NOISE, Until(resonance_hz=reachable_uncertainty(100.0)), "second")
    campaign = Campaign(name="c", measurements=(first, second, plan(QUIET, None, "fixed")))
    changed, shares = fit_to(campaign, RIG, 1800.0)
    assert changed.duration_s == pytest.approx(1800.0, abs=15.0)  # whole realisations of 7 s including ramps
    assert shares[1].allotted_s == pytest.approx(2 * shares[0].allotted_s, abs=4.0)
    assert [each.needed_s for each in shares] == [pytest.approx(50.0), pytest.approx(100.0), None]
    assert recorded_s(changed.measurements[2]) == 60.0


@pytest.mark.parametrize(
    ("until", "time_s", "said"),
    [
        (None, 600.0, "no measurement with 'until' has a predictable duration"),
        (Until(resonance_hz=0.00001), 100.0, "are too short for the targets of c, which need about"),
        (Until(resonance_hz=0.00001), 1.0, "ramps, settling and measurements without targets alone take"),
        (Until(resonance_hz=0.00001), 1e6, "give less time or wider bounds"),
    ],
)
def test_an_impossible_distribution_of_time_is_refused_with_a_readable_message(until, time_s, said):
    with pytest.raises(ConfigurationError, match=said):
        fit_to(Campaign(name="c", measurements=(plan(NOISE, until), plan(QUIET, None, "q"))), RIG, time_s)


def test_early_stopping_widens_noise_and_random_error_but_not_calibration_uncertainty():
    parts = [Contribution(cause, 0.01, "x") for cause in (Cause.NOISE, Cause.CHANCE, Cause.VIBROMETER)]
    budget = Budget("Response I", 2.0, "", (*parts, Contribution(Cause.NOISE, None, "y"))).widen()
    assert [each.relative for each in budget.contributions] == [0.01 * WIDENING, 0.01 * WIDENING, 0.01, None]


@pytest.mark.slow
def test_the_widened_bounds_of_early_stopping_hold_on_gaussian_records():
    command = [sys.executable, str(ROOT / "benchmarks" / "until_coverage.py"), "--rule"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    held = {line.split(":")[0]: float(line.split()[2]) for line in lines}
    assert held["widening 1.00"] < 90
    assert held[f"widening {WIDENING:.2f}"] > 94.5
