"""Motions computed in a batch match single motions and do not depend on the rest of the batch."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, gong2025, integrate
from vibench.sim.engine.batch import follow_batch, is_batchable
from vibench.sim.engine.run import NativeRun, RunRecord, Watch
from vibench.sim.scene.plan import linear_motion
from vibench.sim.specimen.contact_laws import Hertz
from vibench.sim.specimen.specimen import Specimen

STANDARD = Accuracy.STANDARD.tolerance
SPECIMEN = gong2025()


@dataclass(frozen=True, eq=False)
class BatchedMotion:
    states: np.ndarray
    impacts: int
    peaks: np.ndarray
    """Peaks of x and p."""
    areas: np.ndarray
    run: NativeRun


def follow(specimen, drives, starts, periods, tolerance=STANDARD, watch=Watch.PEAKS_AND_LINES):
    runs = [NativeRun(specimen, drive, start, tolerance) for drive, start in zip(drives, starts, strict=True)]
    return [
        BatchedMotion(
            *(found.states, found.impacts),
            *(np.array([found.peak_x_m, found.peak_p_m]), np.array([found.area_x, found.area_p]), run),
        )
        for found, run in zip(follow_batch(runs, periods, watch), runs, strict=True)
    ]


def random_scenes(count, seed, duration_s=0.5):
    """Return random drives (60 to 420 Hz, 2 to 50 um) and states of their motions without contact."""
    rng = np.random.default_rng(seed)
    drives, starts = [], []
    while len(drives) < count:
        drive = Harmonic(rng.uniform(60.0, 420.0), math.exp(rng.uniform(math.log(2e-6), math.log(5e-5))))
        periods = int(duration_s * drive.frequency_hz) + int(rng.integers(8))
        state = integrate(SPECIMEN, drive, periods / drive.frequency_hz, "standard").final_state
        if abs(state[1] - state[2]) < SPECIMEN.gap_m:
            drives.append(drive)
            starts.append(state)
    return drives, starts


def sections(specimen, drive, start, periods, accuracy):
    """Return the states once per drive period of a single run, and the number of impacts."""
    run = integrate(
        specimen, drive, periods / drive.frequency_hz, accuracy, start, sample_rate_hz=drive.frequency_hz
    )
    return run.states[1:], run.impacts.count


def scaled_error(found, states):
    """Return the largest difference of states, scaled by the gap and by the gap times 2 pi 1 kHz."""
    scale = SPECIMEN.gap_m * np.repeat([1.0, 2.0 * math.pi * 1e3], 3)
    return np.abs((found - states) / scale).max(axis=-1)


def test_motions_in_a_batch_are_as_accurate_as_single_motions():
    drives, starts = random_scenes(40, 2026)
    periods = [max(1, math.ceil(0.01 * drive.frequency_hz)) for drive in drives]
    beside, alone = [], []
    for drive, start, count, found in zip(
        drives, starts, periods, follow(SPECIMEN, drives, starts, periods), strict=True
    ):
        exact, touches = sections(SPECIMEN, drive, start, count, "reference")
        assert found.impacts == touches
        # For a state in contact the batch returns the state after the contact.
        is_free = abs(exact[-1, 1] - exact[-1, 2]) < SPECIMEN.gap_m
        if is_free:
            beside.append(scaled_error(found.states[-1], exact[-1]))
            alone.append(scaled_error(sections(SPECIMEN, drive, start, count, "standard")[0][-1], exact[-1]))
    assert len(beside) >= 30
    assert np.median(beside) < 1e-7
    # Errors in the batch are of the same size as those of single motions.
    assert np.median(np.array(beside) / np.maximum(alone, 1e-9)) < 10.0


def test_a_periodic_motion_reaches_the_same_states_repeatedly():
    drive = Harmonic(130.0, 2e-5)
    settled = integrate(SPECIMEN, drive, 400.0 / 130.0, "standard").final_state
    (found,) = follow(SPECIMEN, [drive], [settled], [1000])
    alone, touches = sections(SPECIMEN, drive, settled, 1000, "standard")
    assert found.impacts == touches == 2000
    assert scaled_error(found.states, alone).max() < 1e-6


def test_a_motion_that_ends_in_contact_continues_from_that_state():
    drives, starts = random_scenes(24, 7)
    drives, starts = [drives[0]] * 64, [starts[0] * (1.0 + 1e-3 * k) for k in range(64)]
    found = follow(SPECIMEN, drives, starts, [12] * 64)
    assert not all(each.run.is_in_flight for each in found)
    for each in found:
        np.testing.assert_array_equal(each.states[-1], each.run.motion)
        depth = abs(each.run.motion[1] - each.run.motion[2]) - SPECIMEN.gap_m
        assert (depth > 0.0) != each.run.is_in_flight
    on_stop = next(each.run for each in found if not each.run.is_in_flight)
    exact = integrate(SPECIMEN, drives[0], 1.0 / drives[0].frequency_hz, "reference", on_stop.motion)
    on_stop.advance(13.0 / drives[0].frequency_hz, RunRecord(100))
    assert scaled_error(on_stop.motion, exact.final_state) < 1e-3


def test_a_motion_does_not_depend_on_the_other_motions_of_its_batch():
    drives, starts = random_scenes(20, 3)
    periods = [1 + 13 * k for k in range(20)]
    together = follow(SPECIMEN, drives, starts, periods)
    shuffled = np.random.default_rng(1).permutation(20)
    again = follow(SPECIMEN, *([each[k] for k in shuffled] for each in (drives, starts, periods)))
    for place, k in enumerate(shuffled):
        (alone,) = follow(SPECIMEN, [drives[k]], [starts[k]], [periods[k]])
        (unseen,) = follow(SPECIMEN, [drives[k]], [starts[k]], [periods[k]], watch=Watch.NOTHING)
        for each in (alone, again[place], unseen):
            np.testing.assert_array_equal(each.states, together[k].states)
            np.testing.assert_array_equal(each.run.motion, together[k].run.motion)
            assert each.impacts == together[k].impacts
        for each in (alone, again[place]):
            np.testing.assert_array_equal(each.peaks, together[k].peaks)
            np.testing.assert_array_equal(each.areas, together[k].areas)


def observe_alone(specimen, drive, start, periods):
    """Return peaks and line integrals of a single run at the accuracy *standard*."""
    run, record = NativeRun(specimen, drive, start, STANDARD), RunRecord(1000)
    record.watch(Watch.PEAKS_AND_LINES)
    run.advance(periods / drive.frequency_hz, record)
    return np.array([record.peak_x_m, record.peak_p_m]), np.array([record.area_x, record.area_p])


@pytest.mark.parametrize("specimen", [SPECIMEN, gong2025(gap_m=(30e-6, 60e-6))])
def test_peaks_and_spectral_lines_of_motions_match_between_a_batch_and_single_runs(specimen: Specimen):
    # Chaos does not amplify the rounding errors of a processor for so short a time.
    drives, starts = random_scenes(60, 11, duration_s=0.05)
    starts = [start for start in starts if -specimen.gaps_m[0] < start[1] - start[2] < specimen.gaps_m[1]]
    drives, peaks, lines = drives[: len(starts)], [], []
    for drive, start, found in zip(
        drives, starts, follow(specimen, drives, starts, [2] * len(starts)), strict=True
    ):
        peak, line = observe_alone(specimen, drive, start, 2)
        peaks.append(np.abs(found.peaks / peak - 1.0).max())
        lines.append(np.abs(found.areas - line).max() / np.abs(line).max())
    # Errors of the collisions' polynomials grow in chaotic motions.
    assert np.median(peaks) < 1e-8
    assert np.median(lines) < 1e-7
    assert max(peaks) < 1e-5
    assert max(lines) < 1e-4


def test_peaks_of_a_periodic_motion_are_not_missed_in_a_long_batch():
    drive = Harmonic(130.0, 2e-5)
    settled = integrate(SPECIMEN, drive, 400.0 / 130.0, "standard").final_state
    found = follow(SPECIMEN, [drive] * 9, [settled] * 9, [1, 2, 3, 50, 100, 200, 500, 999, 1000])
    peak, line = observe_alone(SPECIMEN, drive, settled, 2)
    for each in found:
        np.testing.assert_allclose(each.peaks, peak, rtol=1e-7)
        np.testing.assert_allclose(each.areas / len(each.states), line / 2.0, rtol=1e-6)


def test_peaks_of_a_batch_without_contact_have_a_closed_form():
    drive = Harmonic(400.0, 1e-6)
    (found,) = follow(SPECIMEN, [drive], [np.zeros(6)], [40_000])
    (last,) = follow(SPECIMEN, [drive], [found.run.motion], [10])
    motion = linear_motion(SPECIMEN, drive, np.zeros(6))
    steady = np.array([motion.steady_x, motion.steady_p])
    assert found.impacts == 0
    np.testing.assert_allclose(last.peaks, np.abs(steady), rtol=1e-9)
    np.testing.assert_allclose(np.abs(last.areas), 0.5 * 10.0 / 400.0 * np.abs(steady), rtol=1e-9)


@pytest.mark.parametrize(
    ("specimen", "tolerance", "follows"),
    [
        (SPECIMEN, STANDARD, True),
        (gong2025(gap_m=(30e-6, 60e-6)), STANDARD, True),
        (SPECIMEN, Accuracy.REFERENCE.tolerance, False),
        (gong2025(contact="rigid:0.8"), STANDARD, False),
        (gong2025(contact="power:5"), STANDARD, False),
        (gong2025(contact="linear"), STANDARD, False),
        (gong2025(damping_time_s=2e-4), STANDARD, False),
        (replace(SPECIMEN, contact=Hertz(1e6)), STANDARD, False),
        (replace(SPECIMEN, contact=Hertz(1e12)), STANDARD, True),
        (replace(SPECIMEN, contact=Hertz(1e300)), STANDARD, False),
    ],
)
def test_batches_need_a_lightly_damped_specimen_with_hertz_stops(specimen: Specimen, tolerance, follows):
    assert is_batchable(specimen, tolerance) is follows


def test_a_specimen_unsuitable_for_batches_is_refused():
    with pytest.raises(ValueError, match="cannot be simulated in a batch"):
        follow(gong2025(contact="rigid:0.8"), [Harmonic(100.0, 1e-6)], [np.zeros(6)], [1])


def test_a_batched_motion_of_zero_periods_is_refused():
    run = NativeRun(SPECIMEN, Harmonic(130.0, 2e-5), np.zeros(6), STANDARD)
    with pytest.raises(ValueError, match="refuses to follow_batch"):
        follow_batch([run], [0])


def test_a_tangent_vector_is_the_same_in_a_batch_as_in_a_single_run_and_leaves_the_motion_unchanged():
    drives, starts = random_scenes(20, 77, duration_s=0.05)
    periods = [max(1, math.ceil(0.01 * drive.frequency_hz)) for drive in drives]
    plain = follow(SPECIMEN, drives, starts, periods)
    change = np.linspace(1.0, 2.0, 6)[None] * np.repeat([1e-3, 1.0], 3)

    def carrying(place, tolerance=STANDARD):
        run = NativeRun(SPECIMEN, drives[place], starts[place], tolerance)
        run.carry(change)
        return run

    runs = [carrying(place) for place in range(20)]
    together = follow_batch(runs, periods)
    assert sum(found.impacts for found in together) > 100
    errors = []
    for place, (found, run) in enumerate(zip(together, runs, strict=True)):
        assert np.array_equal(found.states, plain[place].states)
        (alone,) = follow_batch([carrying(place)], [periods[place]])
        assert np.array_equal(found.growth, alone.growth)
        assert len(found.growth) == len(found.struck) == periods[place]
        assert found.struck[-1] == found.impacts
        exact = carrying(place, Accuracy.REFERENCE.tolerance)
        exact.advance(periods[place] / drives[place].frequency_hz, RunRecord(1000))
        one, other = (np.exp(each.growth[0]) * each.changes[0] for each in (run, exact))
        errors.append(np.linalg.norm(one - other) / np.linalg.norm(other))
        # The error of a vector grows like that of its motion, and with the curvature of the flow.
        assert errors[-1] < 1e-5 + 1000.0 * scaled_error(run.motion, exact.motion)
    assert np.median(errors) < 1e-6
