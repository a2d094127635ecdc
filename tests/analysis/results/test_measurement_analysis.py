"""Analyses of a known specimen match the closed form and report missing or faulty data."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from tests.analysis.conftest import A0_WEAK, DWELL_PART, dwell_plan
from vibench.acquisition.plan import StreamedNoise
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import load_rig
from vibench.analysis import NotEnoughData, analyse
from vibench.analysis.errors import UnusableData
from vibench.analysis.frequency_response.noise_response import NoiseAnalysis
from vibench.analysis.recordings.checks import Verdict, measurement_checks
from vibench.analysis.sine.dwell_analysis import DwellAnalysis
from vibench.analysis.sine.stepped_response import SteppedSineAnalysis
from vibench.analysis.sine.sweep_analysis import SweepAnalysis, frequency_check
from vibench.sim import base_transmissibility, gong2025

RATE = 6400.0


def truth(frequency_hz):
    return base_transmissibility(gong2025(), frequency_hz)[:, 0]


def verdict(analysis, what):
    return next(each.verdict for each in analysis.checks if each.what == what)


@pytest.fixture(scope="module")
def weak(dwell_file):
    """Analysis of a weak dwell, without collisions and without faults."""
    return analyse(dwell_file("weak"))


def test_the_function_analyse_accepts_a_recording_as_a_path_or_as_text(dwell_file):
    path = dwell_file("weak")
    assert analyse(str(path)).response.response_ii == analyse(path).response.response_ii


def test_a_weak_dwell_matches_the_closed_form_in_amplitude_and_phase(weak):
    assert isinstance(weak, DwellAnalysis)
    assert weak.response.drive.frequency_hz == pytest.approx(260.0, rel=1e-8)
    assert weak.response.drive.amplitude_m == pytest.approx(0.5e-6, rel=1e-4)
    exact = truth(260.0)[0]
    assert weak.response.response_ii == pytest.approx(abs(exact), rel=1e-3)
    # Without collisions both responses are equal, except for the sampling of the maximum.
    assert weak.response.response_i == pytest.approx(weak.response.response_ii, rel=1e-2)
    # Without correction, the channel's delay of one sample would add 14.6 degrees.
    assert weak.response.phase_rad == pytest.approx(np.angle(exact), abs=2e-3)


@pytest.mark.thorough
def test_a_colliding_dwell_has_a_lower_response_ii_and_more_response_in_terminal_bands(weak, dwell_file):
    strong = analyse(dwell_file("strong"))
    assert strong.response.response_ii < 0.3 * weak.response.response_ii
    assert strong.response.response_i > 2 * strong.response.response_ii
    for quiet, loud in zip(weak.terminal, strong.terminal, strict=True):
        assert loud.decibel > quiet.decibel + 30


@pytest.mark.thorough
def test_all_three_estimators_give_the_closed_form_on_every_line_of_noise(noise_file):
    found = analyse(noise_file())
    assert isinstance(found, NoiseAnalysis)
    estimate = found.response
    lines = estimate.frequency_response.frequency_hz
    assert lines.size == 126
    # The remaining transient of the first mode, exp(-11), affects the flanks of its resonance.
    for each in (estimate.frequency_response, estimate.h1, estimate.h2):
        np.testing.assert_allclose(each.value, truth(lines), rtol=2e-3)
    assert estimate.left_out == 0
    assert estimate.used_s == pytest.approx(1.0)
    middle = [each for each in estimate.resonances if 250 < each.frequency_hz < 280]
    assert middle[0].frequency_hz == pytest.approx(gong2025().natural_frequencies_hz[1], rel=1e-3)


def test_a_sweep_matches_the_closed_form_below_its_collision_region(sweep_file):
    found = analyse(sweep_file)
    assert isinstance(found, SweepAnalysis)
    region = found.collisions.regions[0]
    before = found.response.frequency_hz < region.low_hz - 5
    quiet = found.response.response_ii[before][5:]
    # A sweep at 5 Hz/s lags slightly behind the steady curve.
    exact = np.abs(truth(found.response.frequency_hz[before][5:]))
    np.testing.assert_allclose(quiet, exact, rtol=0.03)
    assert found.response.drive_amplitude_m[20:-5] == pytest.approx(5e-6, rel=1e-3)


def test_every_step_of_a_stepped_sine_is_analysed_like_a_dwell(stepped_file):
    found = analyse(stepped_file)
    assert isinstance(found, SteppedSineAnalysis)
    assert found.response.frequency_hz == pytest.approx([150.0, 180.0], rel=1e-7)
    assert found.response.response_ii == pytest.approx(np.abs(truth([150.0, 180.0])), rel=1e-3)
    assert found.response.direction == ("up", "up")


def test_an_aborted_dwell_is_analysed_with_a_warning(dwell_file):
    path = dwell_file("weak", state=RecordingState.STOPPED, reason="cancelled", samples=round(4 * RATE))
    found = analyse(path)
    assert found.response.window_s < 2.0
    assert found.response.response_ii == pytest.approx(abs(truth(260.0)[0]), rel=2e-3)
    assert verdict(found, "How it ended") is Verdict.WARNING
    assert verdict(found, "Parts") is Verdict.WARNING


def test_a_recording_that_ended_before_its_dwell_is_refused_with_the_reason(dwell_file):
    path = dwell_file("weak", state=RecordingState.FAILED, reason="cable out", samples=round(1 * RATE))
    with pytest.raises(NotEnoughData, match=r"weak\.h5 \(failed: cable out\).*before its dwell began"):
        analyse(path)


def test_a_dwell_with_lost_samples_is_refused_with_the_number_of_lost_samples(dwell_file):
    path = dwell_file("weak", hole=(round(3 * RATE), round(3 * RATE) + 40))
    with pytest.raises(UnusableData, match="40 of 19200 samples were lost"):
        analyse(path)


def test_a_realisation_with_lost_samples_is_excluded(noise_file):
    first = round(3.1 * RATE)
    found = analyse(noise_file(hole=(first, first + 10)))
    assert found.response.left_out == 1
    assert found.response.periodic.realisations == 1
    assert found.facts.lost_samples == 10
    assert verdict(found, "Lost samples") is Verdict.WARNING
    np.testing.assert_allclose(
        found.response.frequency_response.value,
        truth(found.response.frequency_response.frequency_hz),
        rtol=2e-3,
    )


def test_a_faultless_recording_passes_its_checks(weak):
    assert {each.verdict for each in weak.checks} <= {Verdict.PASSED, Verdict.NOTE}
    assert verdict(weak, "Calibration") is Verdict.PASSED
    assert verdict(weak, "Drive frequency") is Verdict.PASSED


def test_a_gain_that_changes_during_a_dwell_is_reported(dwell_motions, tmp_path):
    """The report stated "periodic" and the mean of two gains, without a warning."""
    base, velocity, _ = dwell_motions["weak"]
    gain = np.where(np.arange(velocity.size) < 0.7 * velocity.size, 1.0, 2.0)
    base = replace(base, acceleration=gain * base.acceleration)
    found = analyse(synthetic.write_recording(tmp_path, dwell_plan(A0_WEAK), base, velocity, [DWELL_PART]))
    assert verdict(found, "Dwell settled") is Verdict.WARNING


def test_a_line_below_the_evaluated_band_is_reported(dwell_motions, tmp_path):
    """The report stated "periodic" and a tenth of the largest displacement, without a warning."""
    base, velocity, _ = dwell_motions["weak"]
    slow = 0.3 * np.max(velocity) * np.sin(2 * np.pi * 260 / 37 * np.arange(velocity.size) / RATE)
    path = synthetic.write_recording(tmp_path, dwell_plan(A0_WEAK), base, velocity + slow, [DWELL_PART])
    said = next(each for each in analyse(path).checks if each.what == "Slow motion")
    assert said.verdict is Verdict.WARNING
    assert said.text.startswith("motion at 7 Hz")


def test_a_dwell_whose_drive_has_another_frequency_is_refused(dwell_motions, tmp_path):
    """The report stated a level of nanometres and a Response I of thousands, from noise at 75 Hz."""
    base, velocity, _ = dwell_motions["weak"]
    weaker = 1e-3 * A0_WEAK * np.sin(2 * np.pi * 130.0 * np.arange(velocity.size) / RATE)
    base = replace(base, displacement_m=base.displacement_m + weaker)
    plan = dwell_plan(A0_WEAK).model_copy(update={"frequency_hz": 130.0})
    path = synthetic.write_recording(tmp_path, plan, base, velocity, [DWELL_PART])
    with pytest.raises(UnusableData, match="largest sine is at 260 Hz, not near 130 Hz"):
        analyse(path)


def test_a_drive_at_a_frequency_that_was_not_planned_is_reported():
    planned_hz = np.array([100.0, 200.0, 300.0])
    assert frequency_check(np.array([100.005, 299.99]), planned_hz).verdict is Verdict.PASSED
    told = frequency_check(np.array([100.0, 260.0]), planned_hz)
    assert told.verdict is Verdict.WARNING
    assert "at 260 Hz, which is not in the plan (nearest planned frequency: 300 Hz" in told.text


@pytest.mark.parametrize(
    ("share", "told"), [(1.0, Verdict.PASSED), (0.6, Verdict.WARNING), (1.1, Verdict.NOTE)]
)
def test_a_drive_level_below_its_plan_is_reported(weak, share, told):
    generator = load_rig("virtual_rig").generator.model_dump(mode="json")
    facts = replace(weak.facts, bench={"generator": generator})
    setting_v = facts.measurement.excitation.amplitude_vpp / 2
    levels = tuple(
        replace(each, peak=share * setting_v) if each.header.role == "drive_voltage" else each
        for each in facts.channels
    )
    (found,) = [each for each in measurement_checks(replace(facts, channels=levels)) if "level" in each.what]
    assert found.verdict is told
    stopped = replace(facts, channels=levels, state=RecordingState.STOPPED)
    (found,) = [each for each in measurement_checks(stopped) if "level" in each.what]
    assert found.verdict is not Verdict.WARNING


def scaled(facts, channel, factor, **header):
    """Return facts with another scale and header of one channel."""
    level = facts.level(channel)
    envelope = replace(
        level.envelope, lower=factor * level.envelope.lower, upper=factor * level.envelope.upper
    )
    changed = replace(level, header=replace(level.header, **header), envelope=envelope)
    return replace(facts, channels=tuple(changed if each is level else each for each in facts.channels))


@pytest.mark.parametrize(("role", "factor"), [("base_acceleration", 1e-6), ("m0_velocity", 1e-5)])
def test_a_scale_that_makes_the_response_implausible_is_reported(weak, role, factor):
    facts = weak.facts
    assert "Scales" not in {each.what for each in measurement_checks(facts)}
    (found,) = [each for each in measurement_checks(scaled(facts, role, factor)) if each.what == "Scales"]
    assert found.verdict is Verdict.WARNING
    assert "check the scales or sensitivities of m0_velocity and base_acceleration" in found.text


@pytest.mark.thorough
@pytest.mark.parametrize("factor", [1.0, 2.0, 0.1, -1.0])
def test_noise_with_a_wrong_scale_or_sign_of_the_mass_is_reported(tmp_path, factor):
    # Springs four times as stiff raise the lowest resonance far above the lowest line of the noise.
    stiffer = replace(gong2025(), stiffnesses=tuple(4.0 * each for each in gong2025().stiffnesses))
    plan, base, velocity, parts = synthetic.noise_from_rest(1e-8, settle_s=3.0, specimen=stiffer)
    path = synthetic.write_recording(tmp_path, plan, base, factor * velocity, parts, name="noise")
    found = [each.text for each in analyse(path).checks if each.what == "Scales"]
    assert len(found) == (factor != 1.0)
    assert all(f"moved {factor:.2g} times as far as the base" in text for text in found)


@pytest.mark.thorough
@pytest.mark.parametrize("case", ["related", "other noise", "1 s late", "0.02 s early"])
def test_noise_of_a_mass_that_does_not_follow_the_base_is_reported(tmp_path, case):
    base, velocity = synthetic.noise_band(10.0, 60.0, 560.0, 1e-8, seed=1)
    _, other = synthetic.noise_band(10.0, 60.0, 560.0, 1e-8, seed=2)
    size = np.std(velocity)
    moved, text = {
        "related": (velocity, None),
        "other noise": (other, r"\(median 0\.\d+\) is not above that of unrelated signals"),
        "1 s late": (np.roll(velocity, round(RATE)), r"about (0\.[89]\d?|1) s after the base"),
        "0.02 s early": (np.roll(velocity, round(-0.02 * RATE)), r"about 0\.02 s before the base"),
    }[case]
    moved = moved + 0.01 * size * np.random.default_rng(3).standard_normal(moved.size)
    plan = StreamedNoise(
        amplitude_vpp=1.0, band_start_hz=60.0, band_stop_hz=560.0, duration_s=10.0, settle_s=0.0
    )
    parts = [synthetic.Part("noise", 0.0, 10.0, {})]
    found = analyse(synthetic.write_recording(tmp_path, plan, base, moved, parts, name="noise"))
    told = [each.text for each in found.checks if each.what == "Coherence"]
    assert len(told) == (text is not None)
    assert all(re.search(text, each) for each in told)


def imported_base(unit, source):
    channels = [{"role": "drive_voltage", "source": "u"}, {"role": "base_acceleration", "source": source}]
    channels = [{**each, "full_scale": None, "file_unit": ""} for each in channels]
    units = [{"unit": "V", "full_scale": None}, {"unit": unit, "full_scale": None}]
    return {"imported": {"mapping": {"channels": channels}, "channels": units}}


@pytest.mark.parametrize("case", ["small force", "sharp resonance", "base in V", "base from the drive"])
def test_a_large_or_small_response_is_not_always_reported_as_a_wrong_scale(weak, case):
    facts = weak.facts
    match case:
        case "small force":
            found = scaled(facts, "m0_velocity", 1e-5, role="base_force", quantity="force")
            found = replace(found, response="base_force")
        case "sharp resonance":
            found = scaled(facts, "m0_velocity", 2000.0)
        case "base in V":
            found = replace(scaled(facts, "base_acceleration", 1e-6), bench=imported_base("V", "a"))
        case "base from the drive":
            found = replace(scaled(facts, "base_acceleration", 1e-6), bench=imported_base("", "u"))
    assert "Scales" not in {each.what for each in measurement_checks(found)}
    if "base" in case:
        known = replace(found, bench=imported_base("g", "a"))
        assert "Scales" in {each.what for each in measurement_checks(known)}


@pytest.mark.parametrize("generator", [{"name": "of another version"}, "AFG1022", None])
def test_no_minimum_level_is_checked_for_an_unknown_generator(weak, generator):
    facts = replace(weak.facts, bench={"generator": generator})
    (found,) = [each for each in measurement_checks(facts) if "level" in each.what]
    assert found.verdict is Verdict.PASSED


def test_a_calibration_dated_after_the_measurement_gives_a_warning_that_states_no_age(weak):
    facts = weak.facts
    channels = tuple(
        replace(each, header=replace(each.header, calibration_date="2098-02-10")) for each in facts.channels
    )
    (found,) = [each for each in measurement_checks(replace(facts, channels=channels)) if "Cal" in each.what]
    assert found.verdict is Verdict.WARNING
    assert "after the measurement" in found.text
    assert "2098-02-10" in found.text
    assert "days" not in found.text


def test_the_level_of_a_channel_states_its_peak_and_its_rms(weak, dwell_motions):
    velocity = dwell_motions["weak"][1]
    level = weak.facts.level("m0_velocity")
    assert level.peak == pytest.approx(np.max(np.abs(velocity)), rel=1e-6)
    assert level.rms == pytest.approx(np.sqrt(np.mean(velocity**2)), rel=1e-6)
    assert level.share_of_range == pytest.approx(level.peak / 1.0)
