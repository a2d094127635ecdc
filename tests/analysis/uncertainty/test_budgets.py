"""Uncertainty budgets match propagation of distributions and list unstated uncertainties."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from vibench.acquisition import open_recording
from vibench.acquisition.rig import StatedUncertainty, VibrometerConfig
from vibench.analysis import Simulation, analyse_files, budgets_of, campaign_summary
from vibench.analysis.overlay.ensemble import EnsembleCurve
from vibench.analysis.overlay.overlay import RESPONSE_I, RESPONSE_II
from vibench.analysis.report._drawings import uncertainty_table
from vibench.analysis.sine.dwell import dwell_response
from vibench.analysis.uncertainty.budget import (
    Budget,
    Cause,
    Contribution,
    dwell_budgets,
    sd_of_largest,
    stated_uncertainties,
    sweep_budgets,
)
from vibench.sim import Harmonic, gong2025, integrate

DRAWS = 150
STATED = {
    "vibrometer": {
        "uncertainty": {"relative": 0.012, "coverage_factor": 2.0, "source": "certificate 17"},
        "alignment_deg": {"value": 6.0, "source": "level"},
        "calibrated": "2026-02-10",
    },
    "accelerometer": {
        "uncertainty": {"relative": 0.0173, "coverage_factor": 1.73, "source": "data sheet"},
        "alignment_deg": {"value": 3.0, "source": "mount"},
    },
    "daq": {
        "clock_ppm": {"value": 4000.0, "source": "made large, to be seen"},
        "channels": [
            {"role": "m0_velocity", "uncertainty": {"relative": 0.004, "source": "certificate 18"}},
            {"role": "base_acceleration", "uncertainty": {"relative": 0.006, "source": "certificate 18"}},
        ],
    },
}
DRAWN = np.array([0.97, 1.01, 1.0, 1.02, 0.98, 1.03])
"""Largest values of the draws, relative to the measured value."""
BASE_NOISE, LASER_NOISE = 0.02, 2e-4
"""Noise of acceleration and of velocity, each relative to the largest value of the quantity."""


@dataclass(frozen=True)
class OneCurveOverlay:
    """Overlay with the draws of one quantity."""

    curve: EnsembleCurve

    def quantity(self, name):
        """Return the curve of this name, or None."""
        return self.curve if name == self.curve.name else None


@pytest.fixture(scope="module")
def weak(dwell_file):
    return analyse_files([dwell_file("weak")], "weak", Simulation.LEFT_OUT).results[0]


@pytest.fixture(scope="module")
def samples(dwell_file):
    with open_recording(dwell_file("weak")) as recording:
        part = next(each for each in recording.segments if each.label == "dwell")
        roles = ("drive_voltage", "base_acceleration", "m0_velocity")
        rate = recording.sample_rate_hz
        return np.stack([recording.read(each, part.start, part.stop) for each in roles]), rate


def response_of(samples, weak, rng, *, base=1.0, response=1.0, clock=0.0):
    """Analyse the dwell with errors of the sensor gains and of the clock."""
    (drive, acceleration, velocity), rate = samples
    noisy = (
        drive,
        base * (acceleration + BASE_NOISE * np.abs(acceleration).max() * rng.standard_normal(drive.size)),
        response * (velocity + LASER_NOISE * np.abs(velocity).max() * rng.standard_normal(drive.size)),
    )
    # A clock error changes the assumed sampling rate.
    return dwell_response(
        *noisy, rate * (1 + clock), near_hz=weak.analysis.excitation.frequency_hz, window_s=2.0
    )


@pytest.mark.thorough
def test_an_uncertainty_budget_matches_the_propagation_of_distributions(samples, weak):
    """Reference: JCGM 101:2008, with all inputs drawn from their distributions."""
    rng = np.random.default_rng(12)

    def calibration_factor(relative, factor=2.0):
        return 1 + relative / factor * rng.standard_normal()

    def tilt_factor(degrees):
        return np.cos(np.radians(degrees) * rng.uniform())

    found = []
    for _ in range(DRAWS):
        base = calibration_factor(0.0173, 1.73) * calibration_factor(0.006) * tilt_factor(3.0)
        response = calibration_factor(0.012) * calibration_factor(0.004) * tilt_factor(6.0)
        one = response_of(samples, weak, rng, base=base, response=response, clock=rng.uniform(-1, 1) * 4e-3)
        found.append((1e6 * one.drive.amplitude_m, one.response_i, one.response_ii))
    facts = replace(weak.analysis.facts, bench={**weak.analysis.facts.bench, **STATED})
    measured = replace(weak.analysis, facts=facts, response=response_of(samples, weak, rng))
    budgets = dwell_budgets(measured, None)
    truth = response_of(samples, weak, np.random.default_rng(0))
    true_values = (1e6 * truth.drive.amplitude_m, truth.response_i, truth.response_ii)
    for budget, values, true in zip(budgets, np.transpose(found), true_values, strict=True):
        # The mean of the cosine error is not corrected, so it is part of the uncertainty.
        rms = np.sqrt(np.mean((values - true) ** 2))
        assert budget.not_stated == ()
        # Tolerance: three standard deviations of the rms.
        assert budget.standard == pytest.approx(rms, rel=3 / np.sqrt(2 * DRAWS)), budget.quantity
        assert budget.share(Cause.CHANCE) == 0.0


def test_uncertainties_that_are_not_stated_are_listed_and_not_taken_as_zero(weak):
    amplitude, _, second = budgets_of(weak)
    assert second.not_stated == (
        Cause.VIBROMETER,
        Cause.CONVERTER,
        Cause.ALIGNMENT,
        Cause.ACCELEROMETER,
        Cause.CLOCK,
    )
    assert second.share(Cause.VIBROMETER) is None
    assert "not stated: vibrometer calibration" in second.sentence
    assert Cause.VIBROMETER not in amplitude.not_stated
    table = uncertainty_table([weak])
    assert table.rows[2][1] == "Response II"
    assert table.rows[2][3] == "not stated"


def test_a_value_without_a_stated_uncertainty_has_no_coverage_factor():
    budget = Budget(
        "A0", 32.68, "µm", (Contribution(Cause.CHANCE, None, ""), Contribution(Cause.NOISE, 0.0, ""))
    )
    assert budget.sentence == "A0 32.68 µm (not stated: chance)"


def test_an_uncertainty_document_states_the_source_and_the_date_of_each_calibration(weak):
    facts = replace(weak.analysis.facts, bench={**weak.analysis.facts.bench, **STATED})
    stated = stated_uncertainties(facts.bench, facts.response)
    assert stated.response[0].source == "vibrometer: certificate 17 (calibrated 2026-02-10)"
    tilts = np.radians([6.0, 3.0]) ** 2 / np.sqrt(20.0)
    assert stated.scale_sd == pytest.approx(np.linalg.norm([0.006, 0.01, 0.002, 0.003, *tilts]))
    document = dwell_budgets(replace(weak.analysis, facts=facts), None)[2].to_dict()
    json.dumps(document)
    parts = {each["cause"]: each["standard"] for each in document["contributions"]}
    assert parts["vibrometer calibration"] == pytest.approx(0.006 * document["value"])


@pytest.mark.thorough
def test_the_response_i_budget_of_an_aperiodic_motion_includes_the_random_error(dwell_file):
    results = analyse_files([dwell_file("strong")], "strong", Simulation.LEFT_OUT)
    (strong,) = results.results
    _, first, second = budgets_of(strong)
    assert first.share(Cause.CHANCE) > 0.005
    # Without a silent part, noise and chaos cannot be separated.
    assert first.share(Cause.NOISE) is None
    assert second.share(Cause.CHANCE) > 0.0
    said = campaign_summary(results)["results"][0]["uncertainty"]
    assert [each["quantity"] for each in said] == ["base amplitude A0", "Response I", "Response II"]


def test_each_resonance_has_a_budget_and_the_budget_of_its_damping_contains_no_calibration(noise_file):
    (noise,) = analyse_files([noise_file()], "noise", Simulation.LEFT_OUT).results
    budgets = budgets_of(noise)
    assert len(budgets) == 3 * len(noise.analysis.response.resonances) > 0
    for frequency, damping, height in zip(budgets[::3], budgets[1::3], budgets[2::3], strict=True):
        assert frequency.not_stated == (Cause.CLOCK,)
        assert damping.not_stated == ()
        assert Cause.VIBROMETER in height.not_stated


def test_a_stated_uncertainty_requires_a_source():
    with pytest.raises(ValueError, match="source"):
        StatedUncertainty(relative=0.01, source="")
    with pytest.raises(ValueError, match="less than 1"):
        StatedUncertainty(relative=1.5, source="per cent, by mistake")
    assert VibrometerConfig.model_fields["uncertainty"].default is None


@pytest.mark.parametrize("bounded", [False, True])
def test_the_scatter_of_a_maximum_is_estimated_from_one_window(bounded):
    """The estimate matches many windows, for unbounded and for bounded values."""
    rng = np.random.default_rng(5)
    values = rng.beta(2, 3, (400, 2000)) if bounded else rng.exponential(size=(400, 2000))
    true = np.std(values.max(axis=1))
    told = [sd_of_largest(each.reshape(50, -1).max(axis=1)) for each in values]
    assert 0.9 * true < np.median(told) < 1.6 * true


@pytest.mark.thorough
def test_the_bound_of_the_largest_value_in_chaos_covers_other_windows():
    """Windows of four chaotic motions at drives [Hz, m], damping times [s] and gaps [m]."""
    held = []
    for drive, damping_time_s, gap_m in (
        (Harmonic(322.8, 33.0e-6), 28.7e-6, 50.0e-6),
        (Harmonic(163.3, 29.3e-6), 9.02e-6, 70.5e-6),
        (Harmonic(241.2, 13.3e-6), 23.2e-6, 71.7e-6),
        (Harmonic(276.8, 11.1e-6), 8.6e-6, 66.7e-6),
    ):
        specimen, parts = gong2025(damping_time_s, gap_m), int(3 * drive.frequency_hz / 20)
        run = integrate(specimen, drive, 160.0, "quick", sample_rate_hz=20 * drive.frequency_hz)
        windows = np.abs(run.states[-40 * parts * 400 :, 0]).reshape(40, parts, 400).max(axis=2)
        largest, sd = windows.max(axis=1), np.array([sd_of_largest(each) for each in windows])
        held += list(np.abs(largest - np.median(largest)) <= 2 * sd)
    assert np.mean(held) >= 0.92


@given(
    sd=st.floats(allow_infinity=True),
    value=st.one_of(st.floats(), st.floats(0.1, 10.0)),
    maxima=arrays(np.float64, 50, elements=st.floats(0.0, 1e3)),
)
@example(sd=5e-324, value=5e-324, maxima=np.array([5e-324, *np.zeros(49)]))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_standard_uncertainty_is_finite_and_not_negative_or_is_not_stated(sd, value, maxima, request):
    """This holds for any values, also without noise and for a constant signal."""
    weak = request.getfixturevalue("weak")
    assert 0.0 <= sd_of_largest(maxima) < np.inf
    found = replace(
        weak.analysis.response,
        response_i=value,
        noise_error_i=abs(sd),
        response_ii=value,
        sd_response_ii=abs(sd),
    )
    for budget in dwell_budgets(replace(weak.analysis, response=found), None):
        for part in budget.contributions:
            assert part.relative is None or 0.0 <= part.relative < np.inf
        assert "nan" not in budget.sentence.partition("(k =")[2]
    if sd < 0:
        with pytest.raises(ValueError, match="not negative"):
            Contribution(Cause.NOISE, sd, "a bias, by mistake")


def test_a_colliding_sweep_reports_the_scatter_of_its_draws(sweep_file):
    (sweep,) = analyse_files([sweep_file], "sweep", Simulation.LEFT_OUT).results
    whole, collides = sweep.analysis.response, sweep.analysis.collisions.is_colliding
    (largest,) = (each for each in budgets_of(sweep) if each.quantity.startswith("largest Response I,"))
    assert collides[np.argmax(whole.response_i)]  # not at the beginning of the sweep
    assert Cause.CHANCE in largest.not_stated
    before = replace(
        sweep.analysis, response=replace(whole, response_i=np.where(collides, 1e-3, whole.response_i))
    )
    calm = sweep_budgets(before, None)[1]
    assert calm.share(Cause.CHANCE) == 0.0
    assert calm.contributions[-1].source == "scatter of A0"
    found = replace(
        whole,
        response_i=np.where(collides, whole.response_i, 1e-3),
        response_ii=np.where(collides, whole.response_ii, 1e-3),
    )
    part = replace(sweep.analysis, response=found)
    amplitude, first, second = sweep_budgets(part, None)
    at = f"{found.frequency_hz[np.argmax(found.response_i)]:.4g} Hz"
    assert amplitude.quantity.startswith("base amplitude A0, at ")
    assert first.quantity.startswith(f"largest Response I, at {at}, swept at ")
    assert first.value == found.response_i.max()
    assert Cause.CHANCE in first.not_stated
    # Parts of 0.1 s do not show the scatter between repeated runs.
    assert Cause.CHANCE in second.not_stated
    assert Cause.CHANCE in amplitude.not_stated
    drawn = EnsembleCurve(RESPONSE_I, found.frequency_hz, found.response_i, np.outer(DRAWN, found.response_i))
    told = sweep_budgets(part, OneCurveOverlay(drawn))[1]
    # To first order a square root has half the relative scatter of its argument.
    assert told.share(Cause.CHANCE) == pytest.approx(np.std(DRAWN, ddof=1), rel=0.01)
    assert told.contributions[-1].source == f"{DRAWN.size} simulated draws"
    second_drawn = EnsembleCurve(
        RESPONSE_II, found.frequency_hz, found.response_ii, np.outer(DRAWN, found.response_ii)
    )
    assert sweep_budgets(part, OneCurveOverlay(second_drawn))[2].share(Cause.CHANCE) > 0.0
    # A sweep with collisions throughout has no quiet part to measure the noise: its amplitude
    # differed between repeats by up to 13 times the bounds.
    seen = replace(sweep.analysis.collisions, is_colliding=np.zeros_like(collides))
    assert seen.is_unexplained[np.argmax(found.response_ii)]
    for budget in sweep_budgets(replace(part, collisions=seen), None):
        assert Cause.CHANCE in budget.not_stated


def test_the_random_error_of_steps_without_collisions_is_negligible_and_noise_is_stated_once(stepped_file):
    (steps,) = analyse_files([stepped_file], "steps", Simulation.LEFT_OUT).results
    first, second = budgets_of(steps)
    assert [each.quantity.partition(",")[0] for each in (first, second)] == [
        "largest Response I",
        "largest Response II",
    ]
    assert first.share(Cause.CHANCE) < 1e-7
    assert second.share(Cause.CHANCE) == 0.0
    assert Cause.CHANCE not in first.not_stated
    # The bias of the maximum and the scatter of A0 have one cause, named once.
    assert sum(each.cause is Cause.NOISE for each in first.contributions) == 2
    assert first.sentence.count("noise ") == 1
    assert f"noise {100 * first.share(Cause.NOISE):.2g} %" in first.sentence
    assert first.value >= second.value * (1 - 1e-3)
