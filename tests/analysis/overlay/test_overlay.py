"""A simulation overlaid on a recording of the same simulation: regular motions coincide."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.analysis import analyse
from vibench.analysis.overlay.ensemble import logarithmic_difference
from vibench.analysis.overlay.overlay import (
    DwellOverlay,
    NoiseOverlay,
    SweepOverlay,
    equivalent_amplitude,
    paper_amplitude_m,
    predict,
)
from vibench.analysis.results.campaign_results import overlay
from vibench.sim import base_transmissibility, gong2025


def overlay_of(path, **how):
    with open_recording(path) as recording:
        analysis = analyse(recording)
        return analysis, overlay(recording, analysis, **how)


def test_a_weak_dwell_and_its_simulation_differ_by_less_than_0_01_db(dwell_file):
    analysis, overlay = overlay_of(dwell_file("weak"))
    assert isinstance(overlay, DwellOverlay)
    assert overlay.run.impacts == 0
    assert abs(overlay.difference.decibel[0]) < 0.01
    assert overlay.response.response_i == pytest.approx(analysis.response.response_i, rel=5e-3)
    # The simulated response has no delay, and that of the recorded channel is corrected.
    assert overlay.response.phase_rad == pytest.approx(analysis.response.phase_rad, abs=2e-3)
    assert overlay.prediction.response_ii[0] == pytest.approx(analysis.response.response_ii, rel=1e-3)


@pytest.mark.thorough
def test_the_simulation_of_a_colliding_dwell_agrees_in_impacts_and_statistics(dwell_file, dwell_motions):
    analysis, overlay = overlay_of(dwell_file("strong"))
    true = dwell_motions["strong"][2]
    assert overlay.run.impacts == pytest.approx(np.count_nonzero(true > 2.0), rel=0.15)
    assert overlay.run.impact_rate_hz == pytest.approx(overlay.run.impacts / 3.0)
    for measured, simulated in zip(analysis.terminal, overlay.terminal, strict=True):
        assert simulated.decibel == pytest.approx(measured.decibel, abs=4)


def test_collisions_in_a_sweep_and_its_simulation_begin_within_1_hz(sweep_file):
    analysis, overlay = overlay_of(sweep_file)
    assert isinstance(overlay, SweepOverlay)
    measured, simulated = analysis.collisions.regions[0], overlay.collisions.regions[0]
    assert simulated.low_hz == pytest.approx(measured.low_hz, abs=1.0)
    before = (overlay.difference.frequency_hz < measured.low_hz - 3) & (overlay.difference.frequency_hz > 230)
    assert np.max(np.abs(overlay.difference.decibel[before])) < 0.02


def test_quantities_that_disagree_with_the_twin_are_stated_first(sweep_file):
    _, overlay = overlay_of(sweep_file)
    (curve, *_) = overlay.ensemble
    draws = 1 + 1e-3 * np.random.default_rng(1).standard_normal((9, 1))
    one = np.ones(1)
    fine = [
        replace(curve, name=f"fine {each}", frequency_hz=260 * one, measured=one, draws=draws)
        for each in "abc"
    ]
    odd = replace(fine[0], name="odd", measured=1.01 * one)
    found = replace(overlay, ensemble=(*fine, odd)).agreement
    assert found[0] == "1 of 4 quantities disagree with the twin: odd"
    assert found[1].startswith("odd 1.01 differs from the twin's")
    assert len(found) == 5
    assert replace(overlay, ensemble=tuple(fine)).agreement[0].startswith("fine a")


@pytest.mark.thorough
def test_weak_noise_and_its_simulation_agree_on_every_line(noise_file):
    analysis, overlay = overlay_of(noise_file())
    assert isinstance(overlay, NoiseOverlay)
    assert overlay.run.impacts == 0
    assert overlay.run.played_s == pytest.approx(1.0)
    assert overlay.difference.rms_db < 0.01
    linear = np.abs(base_transmissibility(gong2025(), overlay.prediction.frequency_hz)[:, 0])
    np.testing.assert_allclose(overlay.prediction.linear, linear)
    amplitude_m, basis = equivalent_amplitude(analysis)
    assert amplitude_m == 1e-6
    assert "0.05" in basis


def test_a_simulation_of_another_specimen_can_be_overlaid(dwell_file):
    _, overlay = overlay_of(dwell_file("weak"), specimen=gong2025(damping_time_s=1e-4))
    exact = np.abs(base_transmissibility(gong2025(damping_time_s=1e-4), 260.0)[0, 0])
    assert overlay.response.response_ii == pytest.approx(exact, rel=2e-3)
    assert overlay.difference.decibel[0] > 1


def test_a_prediction_below_the_gap_equals_the_linear_response():
    found = predict(gong2025(), np.array([120.0, 200.0, 330.0]), 1e-7)
    assert not found.is_colliding.any()
    # The tolerance covers the remaining transient from rest.
    np.testing.assert_allclose(found.response_ii, found.linear, rtol=1e-4)
    np.testing.assert_allclose(found.response_i, found.linear, rtol=1e-4)


def test_only_the_three_levels_in_the_paper_have_an_amplitude_from_the_paper():
    assert [paper_amplitude_m(each) for each in (0.05, 1.5, 10.0)] == [1e-6, 5e-6, 50e-6]
    assert paper_amplitude_m(2.0) is None


def test_a_difference_is_given_in_decibels_and_in_standard_errors():
    ones = np.ones(2)
    found = logarithmic_difference(ones, (ones * 10, ones * 0.3), (ones, ones * 0.4))
    assert found.decibel == pytest.approx([20.0, 20.0])
    assert found.standard_errors == pytest.approx(np.log(10) / 0.5 * ones)
    assert found.share_within_two == 0.0
    assert found.rms_db == found.median_abs_db == pytest.approx(20.0)
