"""A specimen that differs from the bench description is identified from its recordings."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition.plan import Dwell
from vibench.analysis import CampaignResults, NotEnoughData, Simulation, analyse_files, update_model
from vibench.analysis.fit.collision_numbers import brackets, onset_gap, onsets, swept_response
from vibench.analysis.fit.lines import LINEAR, Parameter, parameter_value, with_values
from vibench.analysis.report import findings
from vibench.sim import Sampled, base_transmissibility, gong2025, integrate

TRUE = with_values(
    gong2025(),
    {
        Parameter.DAMPING_TIME: 3.1e-5,
        Parameter.F0: 326.0,
        Parameter.F1: 98.5,
        Parameter.F2: 386.0,
        Parameter.GAP: 52e-6,
    },
)
LASER_NOISE = 2e-7
"""Noise of the velocity channel [m/s rms]; the response is some tens of micrometres per second."""
SWEEP = {"start_hz": 225.0, "stop_hz": 305.0, "duration_s": 16.0}
SWEEP_M = 6e-6


def noise_file(folder):
    plan, base, velocity, parts = synthetic.noise_from_rest(1e-9, 2.0, 4, TRUE)
    velocity += LASER_NOISE * np.random.default_rng(12).standard_normal(velocity.size)
    return synthetic.write_recording(folder, plan, base, velocity, parts, name="noise")


def sweep_file(folder):
    path, impacts_s = synthetic.write_sweep(folder, SWEEP_M, SWEEP, TRUE, 100 * LASER_NOISE, seed=11)
    rate = (SWEEP["stop_hz"] - SWEEP["start_hz"]) / SWEEP["duration_s"]
    return path, SWEEP["start_hz"] + rate * impacts_s[0]


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Record weak noise and a colliding sweep of the true specimen; the bench states the paper's values."""
    folder = tmp_path_factory.mktemp("shaken")
    return noise_file(folder), *sweep_file(folder)


@pytest.fixture(scope="module")
def campaign(recordings):
    return analyse_files(recordings[:2], "shaken", Simulation.LEFT_OUT)


@pytest.fixture(scope="module")
def fitted_model(campaign):
    return update_model(campaign)


@pytest.mark.thorough
def test_fitted_intervals_contain_true_values_and_exclude_described_values(fitted_model):
    assert [each.parameter for each in fitted_model.values] == [*LINEAR, Parameter.GAP]
    for each in fitted_model.values:
        truth = parameter_value(TRUE, each.parameter)
        # Each interval covers 95 %: one of five values may lie slightly outside.
        slack = 0.7 * (each.high - each.low) / 2
        assert each.low - slack <= truth <= each.high + slack, each
        assert not each.low <= each.nominal <= each.high, each
    assert len(fitted_model.not_determined) == 1
    assert "Both gaps, m1, c1 and the contact law are not determined" in fitted_model.not_determined[0]
    assert fitted_model.fits
    assert 0.3 < fitted_model.reduced_chi_square < 3


@pytest.mark.thorough
def test_the_report_shows_fitted_and_described_values(campaign, fitted_model):
    said = list(findings(replace(campaign, model_sentences=fitted_model.sentences)))
    assert said[: len(fitted_model.sentences)] == list(fitted_model.sentences)
    assert [
        each
        for each in said
        if each.startswith("Fitted gap of the nearer side = 5") and "described: 45" in each
    ]


def test_fitted_intervals_are_narrow_enough_to_be_useful(fitted_model):
    relative = {each.parameter: (each.high - each.low) / each.value for each in fitted_model.values}
    assert relative[Parameter.DAMPING_TIME] < 0.1
    assert max(relative[each] for each in LINEAR[1:]) < 0.01
    assert relative[Parameter.GAP] < 0.15


def test_the_onset_frequency_of_collisions_is_the_frequency_of_the_first_impact(recordings, campaign):
    (onset,) = onsets(campaign.sweeps[0].analysis, TRUE)
    assert onset.frequency_hz == pytest.approx(recordings[2], abs=0.6)
    assert onset.low_m <= TRUE.gap_m <= onset.high_m


def test_base_motion_caused_by_collisions_does_not_bias_the_gap(campaign):
    sweep = campaign.sweeps[0].analysis
    (before,) = onsets(sweep, TRUE)
    pushed = np.where(
        sweep.collisions.is_colliding,
        1.3 * sweep.response.drive_amplitude_m,
        sweep.response.drive_amplitude_m,
    )
    (after,) = onsets(replace(sweep, response=replace(sweep.response, drive_amplitude_m=pushed)), TRUE)
    assert (after.low_m, after.gap_m, after.high_m) == (before.low_m, before.gap_m, before.high_m)


@pytest.mark.parametrize("amplitude_m", [6.5e-5, 8e-5])
def test_a_sweep_with_smooth_collisions_before_its_regions_gives_no_gap(tmp_path, amplitude_m):
    """The gap was given as 150 and 63 um instead of 45."""
    sweep = {"start_hz": 60.0, "stop_hz": 92.0, "duration_s": 20.0}
    path, _ = synthetic.write_sweep(tmp_path, amplitude_m, sweep, noise=2e-5)
    with pytest.raises(NotEnoughData, match="no sweep goes from predicted motion without"):
        update_model(analyse_files([path], "smooth", Simulation.LEFT_OUT))


def test_a_wrong_description_widens_the_bounds_of_the_gap(campaign):
    sweep = campaign.sweeps[0].analysis
    widths = []
    for damping_s in (3.1e-5, 3.3e-5):
        (onset,) = onsets(sweep, with_values(TRUE, {Parameter.DAMPING_TIME: damping_s}))
        assert onset.low_m <= TRUE.gap_m <= onset.high_m
        widths.append(onset.high_m / onset.low_m)
    assert widths[1] > widths[0]
    assert not list(onsets(sweep, gong2025()))


def lowered_dwells(folder, levels_m):
    """Write dwells at 100 Hz, each lowered from all levels before it."""
    for number, level_m in enumerate(levels_m):
        way = [*levels_m[:number], level_m]
        begins_s = 0.5 * np.arange(len(way)) + 0.5
        motion = synthetic.sine(begins_s[-1] + 3.0, 100.0, 1.0)
        time_s = np.arange(motion.displacement_m.size) / synthetic.RATE
        edges_s = np.ravel(np.column_stack((begins_s - 0.1, begins_s)))
        size = np.interp(time_s, edges_s[1:], np.repeat(way, 2)[:-1])
        motion = synthetic.Motion(size * motion.displacement_m, size * motion.acceleration)
        tones = [
            {"frequency_hz": 100.0, "amplitude_vpp": 2 * synthetic.VOLTS_PER_METRE * each} for each in way
        ]
        plan = Dwell(**tones[-1], settle_s=1.0, duration_s=2.0, lead_in=tones[:-1])
        part = synthetic.Part("dwell", begins_s[-1] + 1.0, begins_s[-1] + 3.0, {"frequency_hz": 100.0})
        velocity = synthetic.response_of(motion)[0]
        yield synthetic.write_recording(folder, plan, motion, velocity, [part], name=f"dwell{number}")


@pytest.mark.thorough
def test_collisions_that_persist_when_the_level_is_lowered_give_no_upper_bound_of_the_gap(tmp_path):
    """The gap was given as (5.1 to 15.4) um instead of 45."""
    paths = list(lowered_dwells(tmp_path, [8e-6, 4e-6, 2e-6, 1.5e-6, 0.5e-6]))
    (found,) = update_model(analyse_files(paths, "lowered", Simulation.LEFT_OUT)).values
    assert found.low <= 45e-6 <= found.high


def test_a_fit_to_recordings_of_different_specimens_states_the_assumed_specimen(dwell_file, monkeypatch):
    paths = [dwell_file("weak")]
    monkeypatch.setitem(synthetic.BENCH, "specimen", {**synthetic.BENCH["specimen"], "gap_m": 40e-6})
    found = update_model(analyse_files([*paths, dwell_file("strong")], "dwells", Simulation.LEFT_OUT))
    assert found.not_determined[0] == (
        "The recordings describe different specimens; the fit takes them as one specimen, "
        "described as in weak."
    )


def test_dwells_below_and_above_the_onset_of_collisions_give_bounds_of_the_gap(dwell_file):
    results = analyse_files([dwell_file("weak"), dwell_file("strong")], "dwells", Simulation.LEFT_OUT)
    dwells = [each.analysis for each in results.dwells]
    (bracket,) = brackets(dwells, gong2025())
    assert bracket.low_m < 45e-6 < bracket.high_m
    assert bracket.high_m / bracket.low_m == pytest.approx(
        15.0, rel=1e-3
    )  # ten times the level, and a transient in the ramp
    found = update_model(results)
    assert [(each.parameter, each.low, each.high) for each in found.values] == [
        (Parameter.GAP, bracket.low_m, bracket.high_m)
    ]
    with pytest.raises(NotEnoughData, match="one dwell below and one above"):
        onset_gap([], dwells[:1], gong2025())


def test_the_lag_of_a_swept_response_is_predicted_from_the_sweep_rate():
    """The predicted lag matches the simulated sweep; the steady response has a larger error."""
    rate, free, at_hz = 10.0, gong2025(contact="linear"), np.array([252.0, 257.0, 262.0, 272.0, 280.0])
    motion = synthetic.chirp(8.0, 225.0, 305.0, 1e-6)
    drive = Sampled(np.append(motion.displacement_m, motion.displacement_m[-1]), synthetic.RATE)
    path = integrate(free, drive, 8.0, sample_rate_hz=synthetic.RATE)
    p = path.states[:, 1] - path.states[:, 2]
    half = round(synthetic.RATE / 250.0)
    middles = np.rint((at_hz - 225.0) / rate * synthetic.RATE).astype(int)
    seen = np.array([np.max(np.abs(p[each - half : each + half])) for each in middles]) / 1e-6
    steady = np.abs(base_transmissibility(free, at_hz)[:, 3])
    lagging = np.abs(swept_response(free, at_hz, rate)[:, 3])
    assert np.max(np.abs(lagging / seen - 1)) < 0.02
    assert np.max(np.abs(lagging / seen - 1)) < 0.5 * np.max(np.abs(steady / seen - 1))


def test_the_gap_is_not_fitted_without_a_sweep_and_a_reason_is_given(campaign):
    only_noise = CampaignResults("noise", campaign.noise, ())
    found = update_model(only_noise)
    assert found.specimen.gap_m == gong2025().gap_m
    assert [each for each in found.not_determined if "gap stays as described" in each]
    with pytest.raises(NotEnoughData, match="from predicted motion"):
        update_model(CampaignResults("sweep", campaign.sweeps, ()))  # of another specimen than the bench says


def test_a_fit_to_missing_data_gives_a_one_sentence_error(campaign):
    with pytest.raises(NotEnoughData, match="no result"):
        update_model(CampaignResults("empty", (), ()))
    with pytest.raises(NotEnoughData, match="no sweep goes from"):
        onset_gap([], [], gong2025())


def test_a_fit_whose_simulation_disagrees_with_the_recording_gives_no_values(campaign, fitted_model):
    def overlaid(*, agrees):
        overlay = SimpleNamespace(ensemble=(SimpleNamespace(agrees=agrees),))
        return replace(campaign, results=tuple(replace(each, overlay=overlay) for each in campaign.results))

    assert fitted_model.confirm(overlaid(agrees=True)) is fitted_model
    refused = fitted_model.confirm(overlaid(agrees=False))
    assert not refused.is_fitted
    assert not refused.fits
    assert refused.specimen == gong2025()
    (said,) = refused.sentences
    assert said.startswith("No value is fitted to noise: a simulation of the fitted specimen disagrees")
