"""Motion verdicts on simulated and synthetic motions of known kind."""

import numpy as np
import pytest

from benchmarks.noise_verdicts import noise_points, regular_points
from benchmarks.stroboscopic_section import stroboscopic_section
from vibench.analysis import AnalysisError, motion_verdict
from vibench.analysis.chaos.verdict import MotionKind, Points, shortest_period
from vibench.sim import Harmonic, gong2025, lyapunov_exponent

DRIVE_HZ = 260.0
QUIET = np.array([1e-5, 1e-5])


def section(rng, period=1, scatter=0.0, count=1200):
    """Return Poincaré points that repeat after ``period`` drive periods, with white scatter."""
    centres = rng.standard_normal((period, 2))
    return centres[np.arange(count) % period] + scatter * rng.standard_normal((count, 2))


@pytest.mark.parametrize("period", [1, 2, 3, 7, 32])
def test_a_repeating_motion_is_called_periodic_with_the_right_period(period):
    rng = np.random.default_rng(period)
    noise = 1e-3
    found = motion_verdict(Points(section(rng, period, noise), np.full(2, noise)), DRIVE_HZ)
    assert (found.kind, found.period) == (MotionKind.PERIODIC, period)


def test_a_periodic_motion_with_noise_sixty_decibels_below_it_is_not_called_chaotic():
    rng = np.random.default_rng(1)
    points = section(rng, 1, 1e-3)
    stated = motion_verdict(Points(points, np.full(2, 1e-3)), DRIVE_HZ)
    # The stated noise is a hundredth of the true noise.
    hidden = motion_verdict(Points(30 * (points - points.mean(axis=0)), np.full(2, 3e-4)), DRIVE_HZ)
    assert stated.kind is MotionKind.PERIODIC
    assert hidden.kind is not MotionKind.CHAOTIC


def test_narrow_band_noise_is_not_chaotic():
    rng = np.random.default_rng(2)
    series = np.zeros((1600, 2))
    for step in range(2, 1600):
        series[step] = 1.6 * series[step - 1] - 0.9 * series[step - 2] + rng.standard_normal(2)
    found = motion_verdict(Points(series[100:] / 5, QUIET), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED
    assert found.evidence.zero_one is not None
    assert found.evidence.zero_one.k > 0.9, "the naive test is fooled, or this test says nothing"


def test_a_motion_on_a_closed_curve_is_quasi_periodic_with_its_rotation_number():
    turns = (np.sqrt(5) - 1) / 2 / 2
    angle = 2 * np.pi * turns * np.arange(1000)
    points = np.column_stack((np.cos(angle) + 0.2 * np.cos(3 * angle), np.sin(angle + 0.4)))
    found = motion_verdict(Points(points, QUIET), DRIVE_HZ)
    assert found.kind is MotionKind.QUASI_PERIODIC
    assert found.evidence.rotation is not None
    assert found.evidence.rotation.turns_per_period == pytest.approx(turns, abs=1e-6)


def test_a_decaying_motion_is_undecided():
    decay = np.exp(-np.arange(1200) / 400)[:, np.newaxis] * np.array([1.0, 0.5])
    found = motion_verdict(Points(1 + decay, QUIET), DRIVE_HZ)
    assert (found.kind, found.evidence.is_settled) == (MotionKind.UNDECIDED, False)
    assert "settle" in found.why


def henon(count):
    """Return points of the chaotic Hénon map."""
    points = np.empty((count, 2))
    x, y = 0.1, 0.3
    for each in points:
        x, y = 1 - 1.4 * x * x + y, 0.3 * x
        each[:] = x, y
    return points


@pytest.fixture(scope="module")
def chaos():
    return henon(3000)


@pytest.mark.parametrize("settled", [2100, 900], ids=["short transient", "longer transient"])
def test_the_verdict_after_transient_chaos_describes_the_final_motion(chaos, settled):
    points = np.vstack((chaos[:-settled], np.full((settled, 2), 0.2)))
    found = motion_verdict(Points(points, QUIET), DRIVE_HZ)
    assert (found.kind, found.period, found.evidence.periods) == (MotionKind.PERIODIC, 1, settled)
    assert f"only for the last {settled} drive periods" in found.why


@pytest.mark.thorough
def test_a_periodic_motion_that_turns_chaotic_is_chaotic(chaos):
    points = np.vstack((np.full((750, 2), 0.2), chaos[:2250]))
    found = motion_verdict(Points(points, QUIET), DRIVE_HZ)
    assert found.kind is MotionKind.CHAOTIC
    assert found.evidence.periods == 2100, "the block in which it was lost is not judged"


def test_a_motion_that_changes_late_is_undecided(chaos):
    points = np.vstack((np.full((2100, 2), 0.2), chaos[:900]))
    found = motion_verdict(Points(points, QUIET), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED
    assert "drive periods before the end" in found.why


@pytest.mark.parametrize("count", [200, 202, 650, 1200])
@pytest.mark.parametrize("lost", [1, 15, 40])
def test_a_motion_that_changes_in_the_last_periods_is_undecided(count, lost):
    rng = np.random.default_rng(lost)
    points = section(rng, count=count, scatter=1e-5)
    points[-lost:] += rng.standard_normal((lost, 2))
    found = motion_verdict(Points(points, QUIET), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED
    assert "fewer than 200 drive periods before the end" in found.why


@pytest.mark.thorough
def test_intermittent_chaos_is_classified_over_the_whole_record(chaos):
    points = chaos[:1500].copy()
    points[300:450] = points[900:1200] = 0.2
    assert motion_verdict(Points(points, QUIET), DRIVE_HZ).evidence.periods == 1500


def test_a_short_record_is_classified_as_undecided():
    found = motion_verdict(Points(np.ones((150, 2)), QUIET), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED
    assert "150 drive periods" in found.why


def test_scatter_close_to_the_noise_is_classified_as_undecided():
    rng = np.random.default_rng(3)
    found = motion_verdict(Points(section(rng, 1, 0.3), np.full(2, 0.1)), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED
    assert "times their noise" in found.why


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frequency_hz", "amplitude_m", "kind", "period"),
    [
        (260.0, 0.2e-6, MotionKind.PERIODIC, 1),
        (130.0, 20e-6, MotionKind.PERIODIC, None),
        (260.0, 5e-6, MotionKind.CHAOTIC, None),
    ],
    ids=["no contact", "impacts that repeat", "chaos"],
)
def test_verdicts_from_poincare_points_match_the_simulated_specimen(frequency_hz, amplitude_m, kind, period):
    states = stroboscopic_section(gong2025(), Harmonic(frequency_hz, amplitude_m), 2600)[1100:]
    points = states[:, [0, 3]] / np.array([1.0, 2 * np.pi * frequency_hz])
    size = np.sqrt(np.mean(points**2))
    rng = np.random.default_rng(5)
    noise = 1e-3
    seen = points / size + noise * rng.standard_normal(points.shape)
    found = motion_verdict(Points(seen, np.full(2, noise)), frequency_hz)
    assert found.kind is kind, found.why
    assert period is None or found.period == period


@pytest.mark.thorough
def test_chaotic_motion_with_impacts_is_found_in_windows_of_five_seconds():
    """At least 60 % of the windows of the paper's dwell are chaotic in every realisation."""
    window, skipped, count = 1300, 300, 36
    points = stroboscopic_section(gong2025(), Harmonic(260.0, 19e-6), skipped + count * window)[skipped:, :2]
    points = points / points.std(axis=0)
    kinds = [motion_verdict(Points(each, QUIET), 260.0).kind for each in np.split(points, count)]
    assert set(kinds) <= {MotionKind.CHAOTIC, MotionKind.UNDECIDED}
    assert kinds.count(MotionKind.CHAOTIC) >= 0.6 * count


def duffing(periods, damping=0.3, force=0.5, turn=1.2, steps=60):
    """Poincaré points and largest exponent per period of x'' + damping x' - x + x^3 = force cos(turn t)."""

    def rate(t, motion):
        x, v, dx, dv = motion
        return np.array(
            [v, x - x**3 - damping * v + force * np.cos(turn * t), dv, (1 - 3 * x * x) * dx - damping * dv]
        )

    h = 2 * np.pi / turn / steps
    motion, points, grown = (
        np.array([0.1, 0.2, 1.0, 0.0]),
        np.empty((periods + 100, 2)),
        np.empty(periods + 100),
    )
    for period in range(periods + 100):
        for step in range(steps):
            t = (period * steps + step) * h
            one = rate(t, motion)
            two = rate(t + h / 2, motion + h / 2 * one)
            three = rate(t + h / 2, motion + h / 2 * two)
            four = rate(t + h, motion + h * three)
            motion = motion + h / 6 * (one + 2 * two + 2 * three + four)
        points[period], size = motion[:2], np.hypot(*motion[2:])
        grown[period] = np.log(size)
        motion[2:] /= size
    return points[100:], float(np.mean(grown[100:]))


def known_exponent(name):
    """Poincaré points of a chaotic motion, and its largest exponent per period."""
    if name == "duffing":
        return duffing(1500)
    if name == "henon":
        return henon(1500), 0.4192
    drive = Harmonic(260.0, 19e-6)
    exponent = lyapunov_exponent(gong2025(), drive, duration_s=20.0)
    points = stroboscopic_section(gong2025(), drive, 1900)[400:, [0, 3]]
    return points, exponent.exponent_per_s / drive.frequency_hz


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["duffing", pytest.param("henon", marks=pytest.mark.slow), "stops"])
def test_the_exponent_estimated_from_poincare_points_is_a_lower_bound(name):
    """Estimates for the Duffing oscillator were 83.9 and, in more noise, 66.3 per second; 142.5 is true."""
    points, exponent = known_exponent(name)
    points = points / (np.sqrt(2) * points.std(axis=0))
    rng = np.random.default_rng(1)
    said = 0
    for noise in (0.0, 1e-3, 1e-2, 3e-2):
        seen = points + noise * rng.standard_normal(points.shape)
        least = motion_verdict(Points(seen, np.full(2, noise)), DRIVE_HZ).least_exponent_per_s
        if least is not None:
            said += 1
            assert 0 < least <= exponent * DRIVE_HZ
    assert said or name == "stops"


@pytest.mark.parametrize(("seed", "number"), [(4303, 0), (52, 42), (54, 42), (51, 36), (65, 30)])
def test_a_decaying_transient_is_undecided_and_not_periodic_or_quasi_periodic(seed, number):
    """The first case was once reported as period 22, the last one as quasi-periodic."""
    _, points = regular_points(number, seed)
    assert motion_verdict(points, DRIVE_HZ).kind is MotionKind.UNDECIDED


@pytest.mark.thorough
@pytest.mark.parametrize("number", range(5))
def test_noise_behind_a_static_nonlinearity_is_not_chaotic(number):
    """Narrow-band noise through a cubic was called chaotic in 6 of 6 cases, through x + x²/2 in 9 of 20."""
    _, points = noise_points(number, seed=2)
    found = motion_verdict(points, DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED, found.why


def test_the_shortest_period_is_reported_only_if_it_repeats_several_times():
    points = section(np.random.default_rng(6), 5)
    assert shortest_period(Points(points, QUIET)) == 5
    assert shortest_period(Points(points[:18], QUIET)) is None


def test_noise_without_motion_is_not_called_periodic():
    rng = np.random.default_rng(11)
    # Points are scaled by sqrt(2) times their rms: noise alone has a standard deviation of 1 / sqrt(2).
    noise = np.full(2, np.sqrt(0.5))
    found = motion_verdict(Points(noise * rng.standard_normal((1500, 2)), noise), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED
    assert "noise" in found.why


def test_a_motion_that_noise_could_hide_is_not_called_periodic():
    rng = np.random.default_rng(12)
    circle = rng.uniform(0, 2 * np.pi, 1500)
    hidden = 0.3 * np.column_stack((np.cos(circle), np.sin(circle)))
    noise = np.full(2, 0.25)
    found = motion_verdict(Points(hidden + noise * rng.standard_normal((1500, 2)), noise), DRIVE_HZ)
    assert found.kind is MotionKind.UNDECIDED


@pytest.mark.parametrize(
    ("value", "noise", "drive_hz", "said"),
    [
        (np.full((500, 2), np.nan), QUIET, DRIVE_HZ, "points contain values that are not finite"),
        (np.zeros(500), QUIET, DRIVE_HZ, r"points of shape \(500,\) with noise of shape \(2,\) were given"),
        (np.zeros((500, 2)), np.full(3, 1e-3), DRIVE_HZ, r"with noise of shape \(3,\) were given"),
        (np.zeros((500, 2)), -QUIET, DRIVE_HZ, "is not allowed; give standard deviations"),
        (np.zeros((500, 2)), QUIET, -260.0, "a drive frequency of -260.0 Hz is not allowed"),
    ],
)
def test_invalid_poincare_points_or_noise_or_frequency_are_refused(value, noise, drive_hz, said):
    """A chaotic section of 500 points with one lost point was once reported as quasi-periodic."""
    with pytest.raises(AnalysisError, match=said):
        motion_verdict(Points(value, noise), drive_hz)


@pytest.mark.thorough
def test_a_period_that_explains_little_of_the_scatter_is_not_reported():
    """A slow transient of 0.3 % of the orbit was once reported as period 10."""
    place, rng = np.arange(700), np.random.default_rng(1)
    moved = 0.0032 * np.exp((0.201j * np.pi - 2e-4) * place)
    value = np.column_stack((0.7 + moved.real, moved.imag)) + 1e-5 * rng.standard_normal((700, 2))
    assert motion_verdict(Points(value, np.full(2, 1e-5)), 260.0).period in {None, 1}
