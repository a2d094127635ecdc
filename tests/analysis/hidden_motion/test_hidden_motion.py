"""The estimated hidden motion matches the simulated one, or the result states that it cannot be tracked."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.analysis import InvalidRequest, NotEnoughData
from vibench.analysis.errors import UnusableData
from vibench.analysis.hidden_motion import Hidden, Numbers, hidden_motion
from vibench.analysis.hidden_motion._hidden_motion import hidden_motion_of, measured_masses
from vibench.analysis.hidden_motion._prepared_motion import prepared_motion
from vibench.analysis.hidden_motion._tracking_model import tracked_specimen
from vibench.analysis.report._hidden_motion import hidden_impacts_figure, hidden_motion_figure
from vibench.sim import HuntCrossley, LinearGap, RigidStops, gong2025

SCORED_FROM_S = 0.4
PAIRED_S = 1e-4
"""Largest distance between a reported impact and its true impact [s]."""


@cache
def estimate_from(path, **how):
    with open_recording(path) as recording:
        return hidden_motion(recording, **how)


def estimate(recorded, **how):
    return estimate_from(recorded.path, **how)


def require_track(motion, recorded, track, rms_m, *, share=0.0, coverage=0.0):
    """Require the rms error of p [m], the share of samples with an estimate, and the coverage of 95 % bounds.

    The start is left out.
    """
    first = motion.first_sample
    error = track.p - recorded.p[first : first + track.p.size]
    later = np.arange(error.size) >= SCORED_FROM_S * motion.sample_rate_hz
    estimated = later & ~np.isnan(track.p)
    assert np.count_nonzero(estimated) >= share * np.count_nonzero(later)
    assert np.sqrt(np.mean(error[estimated] ** 2)) < rms_m
    assert np.mean(np.abs(error[estimated]) < 1.96 * track.p_sd[estimated]) >= coverage


def matches(found, true, reach):
    """Match found to true impacts one to one; return hits, false detections and timing errors."""
    free = list(found)
    near = []
    for each in true:
        if free and abs(best := min((other - each for other in free), key=abs)) < reach:
            near.append(best)
            free.remove(each + best)
    return len(near), len(found) - len(near), np.array(near)


def score_impacts(motion, found, true):
    rate = motion.sample_rate_hz
    low, high = SCORED_FROM_S * rate, motion.first_sample + motion.tracked.p.size - 0.02 * rate
    found_at = found + motion.first_sample
    inner = np.sort(true[(true > low) & (true < high)])
    return matches(found_at[(found_at > low - 5) & (found_at < high + 5)], inner, PAIRED_S * rate), inner.size


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "level_vpp", "seed"), [(260.0, 1.5, 43), ("sweep", 1.5, 44), ("noise", 10.0, 45)]
)
def test_a_track_continues_through_vibrometer_drop_outs(world_recording, kind, level_vpp, seed):
    """With 10 drop-outs per second, a third of the track and all parameters were once lost."""
    recorded = world_recording(kind, level_vpp, seed=seed, duration_s=3.0, dropouts_per_s=10.0)
    motion = estimate(recorded)
    require_track(motion, recorded, motion.tracked, 0.1e-6, share=0.95, coverage=0.9)
    numbers = {each.what: each for each in motion.found.parameters}
    for side in (Hidden.LOWER_GAP, Hidden.UPPER_GAP):
        assert numbers[side].low < 45e-6 < numbers[side].high
    require_track(motion, recorded, motion.free, 1.5e-6, share=0.9)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "level_vpp", "largest_rms_m"),
    [(260.0, 1.5, 0.1e-6), ("sweep", 1.5, 0.1e-6), ("noise", 10.0, 0.2e-6)],
)
def test_relative_motion_and_impacts_match_the_simulation(world_recording, kind, level_vpp, largest_rms_m):
    recorded = world_recording(kind, level_vpp, seed=41)
    motion = estimate(recorded, numbers=Numbers.AS_DESCRIBED)
    require_track(motion, recorded, motion.tracked, largest_rms_m, share=1.0, coverage=0.93)
    found_at, true_at = motion.tracked.collisions.samples, recorded.touches
    (found, false, apart), true = score_impacts(motion, found_at, true_at)
    assert true > 300
    assert found > 0.99 * true
    assert false < 0.005 * true
    assert np.median(np.abs(apart)) / motion.sample_rate_hz < 1e-6


@pytest.mark.thorough
def test_a_motion_against_a_one_sided_stop_is_tracked_and_the_gap_is_identified(world_recording):
    """No parameter is reported for the missing stop; undetermined parameters share one sentence."""
    one_sided = gong2025(gap_m=(30e-6, np.inf))
    recorded = world_recording(180.0, 0.5, seed=11, specimen=one_sided)
    motion = estimate(recorded, specimen=one_sided)
    assert motion.tracked.tracked_share > 0.95
    require_track(motion, recorded, motion.tracked, 0.1e-6)
    found = {each.what: each for each in motion.parameters}
    assert Hidden.UPPER_GAP not in found
    gap, m1 = found[Hidden.LOWER_GAP], found[Hidden.M1]
    assert gap.is_determined
    assert gap.low <= 30e-6 <= gap.high
    assert m1.low <= one_sided.masses[1] <= m1.high
    assert gap.described == 30e-6
    said = motion.sentences
    assert any(each.startswith("Lower gap: ") and each.endswith("(described as 30 µm).") for each in said)
    assert sum("m1" in each for each in said) == 1
    assert not any("inf" in each for each in said)


@pytest.mark.thorough
def test_chatter_between_the_stops_is_followed_without_a_contact_model(world_recording):
    """The motion has five impacts per period, most of them with hardly any flight between them."""
    one_sided = gong2025(gap_m=(30e-6, np.inf))
    recorded = world_recording(260.0, 1.5, seed=11, duration_s=2.6, specimen=one_sided)
    motion = estimate(recorded, specimen=one_sided)
    require_track(motion, recorded, motion.tracked, 0.1e-6)
    found_at, true_at = motion.tracked.collisions.samples, recorded.touches
    (found, false, _), true = score_impacts(motion, found_at, true_at)
    assert true > 4 * 260 * 1.5
    assert found > 0.99 * true
    assert false < 0.005 * true
    assert motion.free.impacts.samples.size < 0.1 * true
    assert not any(each.is_determined for each in motion.parameters)
    assert "or stayed at one stop" in motion.sentences[-1]


@pytest.mark.thorough
def test_motion_is_tracked_at_ten_times_the_sensor_noise(world_recording):
    recorded = world_recording(260.0, 1.5, seed=42, noise=10.0, duration_s=2.4)
    motion = estimate(recorded, numbers=Numbers.AS_DESCRIBED)
    require_track(motion, recorded, motion.tracked, 0.3e-6, share=0.98)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "level_vpp", "largest_rms_m"), [(260.0, 1.5, 1e-6), ("noise", 10.0, 1.5e-6)]
)
def test_motion_and_impacts_and_gaps_are_reported_without_a_contact_model(
    world_recording, kind, level_vpp, largest_rms_m
):
    recorded = world_recording(kind, level_vpp, seed=41)
    motion = estimate(recorded, numbers=Numbers.AS_DESCRIBED)
    require_track(motion, recorded, motion.free, largest_rms_m, share=0.95, coverage=0.93)
    (found, false, apart), true = score_impacts(motion, motion.free.impacts.samples, recorded.middles)
    assert found > 0.97 * true
    assert false < 0.01 * true
    assert np.median(np.abs(apart)) / motion.sample_rate_hz < 5e-6
    gaps = [each.value_m for each in motion.free_gaps]
    assert np.mean(gaps) == pytest.approx(np.mean(recorded.specimen.gaps_m), abs=0.5e-6)


@pytest.mark.thorough
def test_wrong_values_of_the_gaps_and_m1_are_corrected_from_the_motion(world_recording, described_otherwise):
    recorded = world_recording(260.0, 1.5, seed=41)
    wrong = described_otherwise(recorded.specimen, m1=1.03, gaps=(0.98, 1.04))
    motion = estimate(recorded, specimen=wrong)
    found = {each.what: each for each in motion.parameters}
    assert motion.found.searched
    truth = dict(zip((Hidden.LOWER_GAP, Hidden.UPPER_GAP), recorded.specimen.gaps_m, strict=True))
    truth[Hidden.M1] = recorded.specimen.masses[1]
    for what, true in truth.items():
        assert found[what].is_determined
        assert found[what].low < true < found[what].high
    for side in (Hidden.LOWER_GAP, Hidden.UPPER_GAP):
        assert found[side].value == pytest.approx(truth[side], abs=0.05e-6)
    assert found[Hidden.M1].value == pytest.approx(truth[Hidden.M1], rel=1e-3)
    require_track(motion, recorded, motion.tracked, 0.1e-6)


@pytest.mark.thorough
def test_the_bounds_of_parameters_hold_at_a_low_sample_rate_without_noise(world_recording):
    """Gaps were once 1.8 bounds off, and dampers 1.2."""
    recorded = world_recording(260.0, 1.5, duration_s=3.4, noise=0.0, rate_hz=12_800.0)
    found = [each for each in estimate(recorded).parameters if each.is_determined]
    assert {Hidden.LOWER_GAP, Hidden.UPPER_GAP, Hidden.C0, Hidden.C2} <= {each.what for each in found}
    for each in found:
        assert each.low < each.described < each.high


@pytest.mark.thorough
def test_wrong_values_of_springs_and_dampers_are_corrected_from_the_motion(world_recording):
    recorded = world_recording("noise", 10.0, seed=41)
    (k0, k1, k2), dampings = recorded.specimen.stiffnesses, recorded.specimen.dampings
    wrong = replace(
        recorded.specimen,
        stiffnesses=(0.996 * k0, k1, 1.005 * k2),
        dampings=tuple(1.3 * each for each in dampings),
    )
    motion = estimate(recorded, specimen=wrong)
    found = {each.what: each for each in motion.parameters}
    assert found[Hidden.K0].value == pytest.approx(k0, rel=1e-3)
    assert found[Hidden.K2].value == pytest.approx(k2, rel=1e-3)
    assert found[Hidden.K2].low < k2 < found[Hidden.K2].high
    require_track(motion, recorded, motion.tracked, 0.2e-6, share=1.0)


@pytest.mark.thorough
@pytest.mark.parametrize("loss_s_per_m", [0.05, 0.3])
def test_contact_loss_is_identified_and_not_attributed_to_a_damper(world_recording, loss_s_per_m):
    """With stops described as lossless, a loss of 0.05 s/m once biased c1 by five times its bounds."""
    hertz = gong2025()
    stops = HuntCrossley(hertz.contact.stops.contact_stiffness, loss_s_per_m)
    recorded = world_recording(260.0, 1.5, duration_s=2.6, seed=44, specimen=replace(hertz, contact=stops))
    motion = estimate(recorded, specimen=hertz)
    found = {each.what: each for each in motion.parameters}
    truth = {Hidden.LOSS: loss_s_per_m, Hidden.C1: hertz.dampings[1], Hidden.M1: hertz.masses[1]}
    truth |= dict(zip((Hidden.LOWER_GAP, Hidden.UPPER_GAP), hertz.gaps_m, strict=True))
    for what, true in truth.items():
        # Twice the bounds, since each of the five 95 % intervals may miss.
        assert found[what].value == pytest.approx(true, abs=2 * found[what].half_width), what
    assert found[Hidden.LOSS].half_width < 0.01


@pytest.mark.thorough
def test_parameters_are_identified_even_if_the_motion_settles_during_the_record(world_recording):
    """The later impacts are identical; a search from the middle of the record started 1.3 um off."""
    recorded = world_recording(257.0, 1.7, duration_s=2.2, seed=31)
    m0, m1, m2 = recorded.specimen.masses
    motion = estimate(recorded, specimen=replace(recorded.specimen, masses=(m0, 1.03 * m1, m2)))
    found = {each.what: each for each in motion.parameters}
    assert found[Hidden.M1].value == pytest.approx(m1, rel=1e-3)
    assert found[Hidden.LOWER_GAP].value == pytest.approx(45e-6, abs=0.05e-6)


@pytest.mark.thorough
def test_parameters_of_an_unstable_track_are_not_reported(world_recording):
    """Rigid stops described as Hertzian once gave gaps of (42.3 +- 0.9) um; 45 um is true."""
    usual = gong2025()
    recorded = world_recording(
        257.0, 1.7, duration_s=2.2, seed=31, specimen=replace(usual, contact=RigidStops(0.8))
    )
    motion = estimate(recorded, specimen=usual)
    assert not any(each.is_determined for each in motion.parameters)


@pytest.mark.thorough
def test_parameters_that_no_track_confirms_have_no_bounds(world_recording):
    """An m0 3 % heavier than described once gave gaps of (44.0 +- 0.2) um; 45 um is true."""
    usual = gong2025()
    m0, m1, m2 = usual.masses
    recorded = world_recording(
        257.0, 1.7, duration_s=2.2, seed=31, specimen=replace(usual, masses=(1.03 * m0, m1, m2))
    )
    motion = estimate(recorded, specimen=usual)
    assert not motion.is_confirmed
    assert not any(each.is_determined for each in motion.parameters)
    assert np.all(np.isnan(motion.free.p_sd))
    (said,) = (each for each in motion.sentences if each.startswith("Without a contact model"))
    assert "±" not in said
    assert motion.to_dict()["without_contact_model"]["gaps_sd_m"] in ([None, None], (None, None))
    # The reason is the description and not the length of the record (2 s).
    assert "may be described wrongly" in motion.sentences[-1]
    assert len(motion.sentences) < 10


@pytest.mark.thorough
def test_unequal_gaps_and_a_linear_contact_law_are_identified(world_recording):
    specimen = replace(
        gong2025(gap_m=(38e-6, 50e-6)), contact=LinearGap(4.9e6), masses=(6.1e-3, 1.9e-3, 2.2e-3)
    )
    recorded = world_recording(255.0, 2.0, seed=43, specimen=specimen)
    motion = estimate(recorded, specimen=specimen)
    require_track(motion, recorded, motion.tracked, 0.1e-6, share=1.0)
    assert motion.gaps_m == pytest.approx((38e-6, 50e-6), abs=0.05e-6)
    assert motion.specimen.exponent == pytest.approx(1.0, abs=0.02)


@pytest.mark.thorough
def test_an_invalid_track_is_left_out_and_the_reason_is_given(world_recording, described_otherwise):
    recorded = world_recording("noise", 10.0, seed=41)
    wrong = described_otherwise(recorded.specimen, m1=1.04, dampings=(1.5, 1.5, 1.5))
    motion = estimate(recorded, specimen=wrong, numbers=Numbers.AS_DESCRIBED)
    assert motion.tracked.tracked_share < 0.3
    assert any("residual" in each.reason or "acquired" in each.reason for each in motion.tracked.not_followed)
    missing = sum(each.stop - each.first for each in motion.tracked.not_followed)
    assert missing == np.count_nonzero(np.isnan(motion.tracked.p))
    assert "Not tracked for" in " ".join(motion.sentences)


@pytest.mark.thorough
def test_a_motion_without_contact_determines_no_gap(world_recording):
    recorded = world_recording(260.0, 0.05, seed=44, duration_s=1.2)
    motion = estimate(recorded)
    gaps = [each for each in motion.parameters if each.what in {Hidden.LOWER_GAP, Hidden.UPPER_GAP}]
    assert not any(each.is_determined for each in gaps)
    assert all(each.not_determined for each in gaps)
    assert motion.tracked.collisions.count == 0
    assert motion.free_gaps == (None, None)


@pytest.mark.thorough
def test_requests_that_can_give_no_result_are_refused_with_a_readable_message(world_recording):
    recorded = world_recording(260.0, 1.5, seed=41)
    rigid = replace(recorded.specimen, contact=RigidStops(0.8))
    with pytest.raises(InvalidRequest, match=r"'rigid' cannot be tracked.*hertz"):
        estimate(recorded, specimen=rigid)
    with pytest.raises(InvalidRequest, match=r"1 to 0\.5 s"):
        estimate(recorded, start_s=1.0, stop_s=0.5)
    with pytest.raises(NotEnoughData, match="too short"):
        estimate(recorded, start_s=0.5, stop_s=0.501)
    slow = world_recording(260.0, 1.5, seed=41, rate_hz=5120.0, duration_s=0.6)
    with pytest.raises(UnusableData, match=r"5120 Hz.*higher rate"):
        estimate(slow)
    overflowed = world_recording(260.0, 1.5, seed=41, overflow=0.7)
    with pytest.raises(UnusableData, match=r"jumps at least \d+ times by its whole span"):
        estimate(overflowed)


@pytest.mark.thorough
def test_the_hidden_motion_figures_show_the_motion_and_its_impacts(world_recording):
    recorded = world_recording(260.0, 1.5, seed=41)
    motion = estimate(recorded, numbers=Numbers.AS_DESCRIBED)
    zoom = hidden_motion_figure(motion).tables[0]
    assert max(np.abs(zoom.column("p_m"))) == pytest.approx(46e-6, abs=3e-6)
    tables = {each.name: each for each in hidden_impacts_figure(motion).tables}
    assert len(tables["hidden_impacts_shaken"].column("impulse_ns")) == motion.tracked.collisions.count
    free = tables["hidden_impacts_without_contact_model_shaken"]
    assert np.nanmedian(free.column("gap_m")) == pytest.approx(45e-6, abs=0.5e-6)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("further", "confirms"), [("m2_velocity", True), ("m1_velocity", True), ("m2_acceleration", None)]
)
def test_a_second_sensor_does_not_contradict_a_correct_track(world_recording, further, confirms):
    """Collisions in the m2 signal were once mistaken for drop-outs, and bridging took minutes."""
    motion = estimate(world_recording(260.0, 1.5, further=further), numbers=Numbers.AS_DESCRIBED)
    (check,) = motion.mass_checks
    assert (check.channel, check.confirms) == (further, confirms)
    assert motion.is_confirmed
    assert motion.to_dict()["measured_masses"][0]["confirms"] is confirms
    assert check.sentence in motion.sentences
    if confirms:
        assert (check.scale, check.unexplained) == (
            pytest.approx(1.0, abs=0.005),
            pytest.approx(0.0, abs=0.01),
        )


@pytest.mark.thorough
@pytest.mark.parametrize(("scale", "late"), [(0.8, 0), (1.0, 40)])
def test_a_second_sensor_with_wrong_amplitude_or_phase_refutes_the_track(world_recording, scale, late):
    """No bounds are given, since either the track or the sensor is wrong."""
    recorded = world_recording(260.0, 1.5, further="m2_velocity")
    with open_recording(recorded.path) as recording:
        motion = prepared_motion(recording, 0, recording.samples)
        (mass,) = measured_masses(recording, motion)
    mass.velocity = scale * np.roll(mass.velocity, late)
    found = hidden_motion_of(motion, tracked_specimen(recorded.specimen), None, "shaken", masses=(mass,))
    (check,) = found.mass_checks
    assert (check.confirms, found.is_confirmed, found.to_dict()["p_sd_m"]) == (False, False, None)
    assert np.isnan(found.free.p_sd).all()
    assert any("refutes the track" in each for each in found.sentences)
