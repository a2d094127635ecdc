"""The twin (rig and specimen driven by the recorded voltage) is compared with virtual-rig recordings."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.analysis.virtual_measurements import record, sampled_at, weak_noise
from vibench.acquisition import open_recording
from vibench.acquisition.plan import Dwell, SineSweep
from vibench.analysis import Simulation, analyse, result_summary
from vibench.analysis.kinds import Result
from vibench.analysis.overlay.driven_rig import Driven, fit_shaker
from vibench.analysis.overlay.overlay import PHASE
from vibench.analysis.recordings.channels import ALIGNMENT_ERRORS
from vibench.analysis.report._dwells import dwells_figure
from vibench.analysis.report._sweep import sweep_figure
from vibench.analysis.results.campaign_results import overlay
from vibench.sim import gong2025

NOISE = weak_noise(realisations=3, settle_s=1.0)
DWELL = Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=1.0, duration_s=2.5)

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Folder with recordings of weak noise and a chaotic dwell at 25.6 kS/s."""
    folder = tmp_path_factory.mktemp("twin")
    for name, excitation in (("noise", NOISE), ("dwell", DWELL)):
        record(folder / f"{name}.h5", excitation, sampled_at(25_600.0))
    return folder


def twin_of(path, **how):
    with open_recording(path) as recording:
        analysis = analyse(recording)
        return Result(analysis, overlay(recording, analysis, **how))


@pytest.fixture(scope="module")
def chaotic_dwell(recordings):
    return twin_of(recordings / "dwell.h5")


def test_a_chaotic_dwell_is_consistent_with_its_draws(chaotic_dwell):
    run = chaotic_dwell.overlay.run
    assert run.driven is Driven.AMPLIFIER
    assert run.draws in {8, 12, 16}
    assert run.impact_rate_hz > 300
    assert all(each.compared == 1 and each.agrees for each in chaotic_dwell.overlay.ensemble)


def test_a_simulation_under_the_recorded_base_is_not_compared_with_draws(recordings, chaotic_dwell):
    base = twin_of(recordings / "dwell.h5", simulation=Simulation.UNDER_BASE).overlay
    assert (base.run.driven, base.run.draws) == (Driven.BASE, 1)
    assert all(not each.compared for each in base.ensemble)
    # A prescribed base motion does not react to the specimen: Response II is far too low.
    assert base.response.response_ii < chaotic_dwell.overlay.quantity("Response II").lower[0]


def test_a_twin_with_a_wrong_gap_disagrees_with_the_measurement(recordings):
    found = twin_of(recordings / "dwell.h5", specimen=gong2025(gap_m=60e-6), draws=12).overlay
    assert not found.quantity("Response II").agrees


def test_a_sweep_with_nothing_to_compare_has_a_caption_without_missing_numbers(tmp_path):
    """Within 1 s of the edge of a collision region, nothing is compared."""
    sweep = SineSweep(amplitude_vpp=0.5, start_hz=220, stop_hz=310, duration_s=2, step_s=0.2, settle_s=0.5)
    record(tmp_path / "sweep.h5", sweep, sampled_at(25_600.0))
    found = twin_of(tmp_path / "sweep.h5")
    outside = found.overlay.difference.where(~found.analysis.collisions.is_colliding)
    assert outside.decibel.size
    assert np.isnan(outside.decibel).all()
    assert "nan" not in sweep_figure(found.analysis, found.overlay).caption


def test_the_twin_agrees_with_weak_noise_on_every_line(recordings):
    found = twin_of(recordings / "noise.h5").overlay
    assert found.run.draws == 8
    assert found.quantity("transmission").agrees
    assert found.difference.rms_db < 0.05


@pytest.mark.parametrize(("name", "late_samples"), [("noise", 0.5), ("dwell", 20.0)])
def test_the_phase_shows_that_a_channel_is_delayed(recordings, name, late_samples):
    """20 samples at 260 Hz and 25.6 kS/s are 73 degrees; magnitudes do not change."""
    with open_recording(recordings / f"{name}.h5") as recording:
        analysis = analyse(recording)
        late_s = late_samples / recording.sample_rate_hz
        m0 = recording.channel("m0_velocity")
        others = tuple(each for each in recording.channels if each is not m0)
        late = replace(recording, channels=(*others, replace(m0, delay_s=m0.delay_s - late_s)))
        correct, shifted = overlay(recording, analysis), overlay(late, analyse(late))
    assert all(each.agrees for each in correct.ensemble)
    assert [each.name for each in shifted.ensemble if not each.agrees] == [PHASE]
    assert shifted.agreement[0].endswith(f"disagree with the twin: {PHASE}")


def test_the_phase_bound_contains_the_error_of_times_with_few_digits(recordings):
    """An imported channel is late by half a sample, because its start was rounded to a whole sample."""
    with open_recording(recordings / "noise.h5") as recording:
        late_s = 0.5 / recording.sample_rate_hz
        m0 = recording.channel("m0_velocity")
        others = tuple(each for each in recording.channels if each is not m0)
        bench = {**recording.bench, "imported": {ALIGNMENT_ERRORS: {"m0_velocity": late_s}}}
        late = replace(recording, channels=(*others, replace(m0, delay_s=m0.delay_s - late_s)), bench=bench)
        found = overlay(late, analyse(late))
    assert all(each.agrees for each in found.ensemble)


def test_the_json_output_and_the_figures_show_the_draws(chaotic_dwell):
    said = json.loads(json.dumps(result_summary(chaotic_dwell)))["simulated"]
    assert said["drive"] == "recorded amplifier voltage"
    assert [each["quantity"] for each in said["ensemble"][:2]] == ["Response I", "Response II"]
    assert all(abs(each["z"][0]) <= each["limit_z"] for each in said["ensemble"])
    drawn = dwells_figure([(chaotic_dwell.analysis, chaotic_dwell.overlay)])
    assert f"{chaotic_dwell.overlay.run.draws} draws" in drawn.caption
    assert "95 % of draws" in [each.get_label() for each in drawn.figure.axes[2].collections]


def test_shaker_parameters_fitted_to_weak_noise_are_within_their_bounds(recordings):
    with open_recording(recordings / "noise.h5") as recording:
        found = fit_shaker(recording, analyse(recording), gong2025())
    assert found.chi2 < 2
    for name, true in (
        ("moving_mass_kg", 0.127),
        ("suspension_stiffness_n_per_m", 9932),
        ("suspension_damping_ns_per_m", 21.51),
        ("force_constant_n_per_a", 6.78),
        ("coil_resistance_ohm", 2.6),
    ):
        ratio = np.log(getattr(found.shaker, name) / true)
        assert abs(ratio) < 4 * found.relative_sd[name]


def without_shaker_description(recording):
    """Return the recording with a bench that does not describe its shaker."""
    bench = {key: value for key, value in recording.bench.items() if key != "shaker"}
    return replace(recording, bench=bench)


@pytest.mark.parametrize("driven", [Driven.AMPLIFIER, Driven.GENERATOR])
def test_noise_on_an_undescribed_shaker_is_simulated_with_a_fitted_shaker(recordings, driven):
    """Without bounds of the inductance, random shakers under the generator's voltage were not finite."""
    with open_recording(recordings / "noise.h5") as whole:
        kept = (e for e in whole.channels if driven is Driven.AMPLIFIER or e.role != "amplifier_voltage")
        recording = without_shaker_description(replace(whole, channels=tuple(kept)))
        found = overlay(recording, analyse(recording), draws=5)
    assert found.run.driven is driven
    assert "fitted to" in found.run.why
    assert found.quantity("transmission").agrees


def test_a_dwell_on_an_undescribed_shaker_is_simulated_with_the_recorded_base(recordings):
    with open_recording(recordings / "dwell.h5") as recording:
        analysis = analyse(without_shaker_description(recording))
        found = overlay(without_shaker_description(recording), analysis)
        with open_recording(recordings / "noise.h5") as noise:
            shaker = fit_shaker(noise, analyse(noise), gong2025())
        driven = overlay(without_shaker_description(recording), analysis, shaker=shaker, draws=6)
    assert found.run.driven is Driven.BASE
    assert "describes no shaker" in found.run.why
    assert driven.run.driven is Driven.AMPLIFIER
    assert driven.quantity("Response II").agrees
