from dataclasses import replace

import numpy as np
import pytest

from vibench.sim import (
    Accuracy,
    Harmonic,
    Observable,
    Outcome,
    Scene,
    base_transmissibility,
    gong2025,
    periodic_orbit,
    solve_scene,
    steady_response,
)
from vibench.sim.scene.followed_run import FollowedRun
from vibench.sim.scene.prediction import Method, MotionKind, StartMemory
from vibench.sim.scene.scene import AutomaticDuration, FixedDuration, Given
from vibench.sim.specimen.modes import modal_form

from .predictions import errors, responses, scene_of

PERIODIC = [
    ("hertz", 130.0, 20e-6),
    ("hertz", 94.0, 5e-6),
    ("hertz", 225.0, 5e-6),
    ("linear_gap", 130.0, 20e-6),
    ("rigid:0.8", 130.0, 20e-6),
    ("power:3", 200.0, 5e-6),
    ("power:7", 130.0, 20e-6),
]
CHAOS = Scene(gong2025(), Harmonic(260.0, 5e-6))


def test_the_closed_form_matches_transmissibility_and_final_state():
    found = solve_scene(scene_of("hertz", 200.0, 5e-6))
    x, _, _, p = np.abs(base_transmissibility(gong2025(), 200.0)[0])
    np.testing.assert_allclose(responses(found), [x, x, p, p], rtol=1e-12)
    assert (found.method, found.motion, found.period) == (Method.CLOSED_FORM, MotionKind.PERIODIC, 1)
    followed = steady_response(gong2025(), Harmonic(200.0, 5e-6))
    assert found.response_i == pytest.approx(followed.response_i, rel=1e-9)
    scales = np.abs(followed.final_state).reshape(2, 3).max(axis=1).repeat(3)
    np.testing.assert_allclose(found.final_state / scales, followed.final_state / scales, atol=1e-8)


@pytest.mark.parametrize(("contact", "frequency_hz", "amplitude_m"), PERIODIC)
def test_a_prediction_of_fixed_duration_equals_the_plain_run(contact, frequency_hz, amplitude_m):
    scene = scene_of(contact, frequency_hz, amplitude_m, duration=FixedDuration(8.0, 2.0))
    found = solve_scene(scene)
    plain = steady_response(scene.specimen, scene.drive, scene.accuracy, 8.0, 2.0)
    assert found.motion is MotionKind.PERIODIC
    assert found.impacts == plain.impacts
    np.testing.assert_allclose(responses(found), responses(plain), rtol=3.0 * found.error_estimate)


@pytest.mark.parametrize("accuracy", [Accuracy.QUICK, Accuracy.STANDARD])
@pytest.mark.parametrize(("contact", "frequency_hz", "amplitude_m"), PERIODIC)
def test_periodic_motions_match_the_reference_within_their_error(
    contact, frequency_hz, amplitude_m, accuracy
):
    scene = scene_of(contact, frequency_hz, amplitude_m, duration=AutomaticDuration(), accuracy=accuracy)
    found = solve_scene(scene)
    truth = solve_scene(replace(scene, accuracy=Accuracy.REFERENCE, duration=FixedDuration(12.0, 2.0)))
    assert found.motion is truth.motion is MotionKind.PERIODIC
    off = np.abs(responses(found) / responses(truth) - 1.0).max()
    assert off <= found.error_estimate + truth.error_estimate
    assert found.error_estimate < 1e-3
    assert truth.error_estimate < 1e-7


@pytest.fixture
def integrated(monkeypatch):
    """Return the list of all integrated parts of runs."""
    parts, follow = [], FollowedRun.follow

    def follow_and_keep(run, *options, **more):
        parts.append(follow(run, *options, **more))
        return parts[-1]

    monkeypatch.setattr(FollowedRun, "follow", follow_and_keep)
    return parts


def test_whole_cycles_of_a_periodic_motion_are_skipped(integrated):
    specimen, drive = gong2025(), Harmonic(130.0, 20e-6)
    found = solve_scene(Scene(specimen, drive, duration=FixedDuration(30.0, 5.0)))
    assert sum(each.length_s for each in integrated) < 22.0
    whole = steady_response(specimen, drive)
    assert found.response_i == pytest.approx(whole.response_i, rel=1e-9)
    assert found.response_ii == pytest.approx(whole.response_ii, rel=1e-9)
    assert np.allclose(found.final_state, whole.final_state, rtol=1e-6, atol=1e-12)
    assert found.duration_s == pytest.approx(30.0)


def test_no_part_of_a_chaotic_motion_is_skipped(integrated):
    solve_scene(Scene(gong2025(), Harmonic(260.0, 5e-6), duration=FixedDuration(30.0, 5.0)))
    assert sum(each.length_s for each in integrated) >= 30.0


def test_perturbations_are_computed_where_it_is_uncertain_whether_a_motion_is_chaotic(integrated):
    def in_window(parts):
        return [not np.isnan(each.growth) for each in parts if each.start_s >= 9.0 - 1e-9]

    length = FixedDuration(14.0, 5.0)
    chaos = solve_scene(replace(CHAOS, duration=length, budget_s=0.0))
    assert chaos.motion is MotionKind.CHAOTIC
    assert in_window(integrated)[:10] == 2 * [True] + 5 * [False] + 3 * [True]
    integrated.clear()
    torus = solve_scene(scene_of("power:3", 225.0, 5e-6, duration=length, budget_s=0.0))
    assert torus.motion is MotionKind.QUASI_PERIODIC
    assert all(in_window(integrated[:12]))


def test_chaotic_runs_from_other_initial_states_are_within_the_stated_error():
    """With 90 % coverage, 8 of 20 runs outside the stated error have a probability of 1/2400."""
    duration = FixedDuration(12.0, 4.0)
    found = solve_scene(replace(CHAOS, duration=duration))
    starts = np.random.default_rng(8).uniform(-1e-9, 1e-9, (20, 6))
    others = [
        steady_response(CHAOS.specimen, CHAOS.drive, CHAOS.accuracy, 12.0, 4.0, start).response_i
        for start in starts
    ]
    outside = np.abs(np.array(others) / found.response_i - 1.0) > found.error_estimate
    assert np.count_nonzero(outside) < 8


@pytest.mark.thorough
def test_chaos_that_ends_in_a_quasi_periodic_motion_is_not_called_chaotic():
    specimen = replace(gong2025(2.2e-5), lower_gap_m=38e-6, gap_m=52e-6)
    found = solve_scene(
        Scene(
            specimen,
            Harmonic(118.0, 12e-6),
            observe=(Observable.RESPONSE, Observable.LYAPUNOV),
            accuracy=Accuracy.REFERENCE,
            duration=AutomaticDuration(window_s=5.0),
        )
    )
    assert abs(found.lyapunov_per_s) < 3.0 * found.lyapunov_error_per_s
    assert found.motion is MotionKind.QUASI_PERIODIC


def test_the_spectrum_contains_response_ii_at_the_drive_frequency_and_chaotic_noise():
    observe = (Observable.RESPONSE, Observable.SPECTRUM)
    periodic = solve_scene(scene_of("hertz", 130.0, 20e-6, observe=observe, duration=FixedDuration(4.0, 1.0)))
    chaos = solve_scene(replace(CHAOS, observe=observe, duration=FixedDuration(4.0, 1.0)))
    for found in (periodic, chaos):
        line = np.argmin(np.abs(found.spectrum_hz - found.frequency_hz))
        assert found.spectrum_hz[line] == pytest.approx(found.frequency_hz)
        assert found.spectrum[line] == pytest.approx(found.response_ii, rel=1e-4)
    between = (chaos.spectrum_hz > 300.0) & (chaos.spectrum_hz < 500.0)
    quiet = np.abs(periodic.spectrum_hz / 130.0 - np.round(periodic.spectrum_hz / 130.0)) > 0.1
    assert np.median(chaos.spectrum[between]) > 1e-3
    assert np.max(periodic.spectrum[quiet]) < 1e-6


def test_the_poincare_section_contains_one_state_per_drive_period_of_the_window():
    observe = (Observable.RESPONSE, Observable.POINCARE)
    found = solve_scene(replace(CHAOS, observe=observe, duration=FixedDuration(4.0, 1.0)))
    assert found.section.shape == (260, 6)
    quiet = solve_scene(scene_of("hertz", 200.0, 1e-6, observe=observe))
    assert quiet.section.shape == (1000, 6)
    np.testing.assert_allclose(quiet.section[-1], quiet.final_state, atol=1e-15)


def test_the_lyapunov_exponent_matches_the_final_motion():
    observe = (Observable.RESPONSE, Observable.LYAPUNOV)
    chaos = solve_scene(replace(CHAOS, observe=observe))
    assert chaos.lyapunov_per_s == pytest.approx(112.0, abs=6.0 * chaos.lyapunov_error_per_s + 2.0)
    assert 0.0 < chaos.lyapunov_error_per_s < 4.0
    quiet = solve_scene(scene_of("hertz", 200.0, 1e-6, observe=observe))
    assert quiet.lyapunov_per_s == pytest.approx(modal_form(gong2025()).rates.real.max())


@pytest.mark.thorough
def test_chaos_that_ends_during_the_averaging_of_its_exponent_gets_no_negative_exponent():
    """Each initial state is another realisation; on every computer some end in or after the window."""
    observe = (Observable.RESPONSE, Observable.LYAPUNOV)
    cubic = gong2025(6.483827302321825e-6, 27.07246318911318e-6, "power:3")
    linear = gong2025(30.90384489081641e-6, 13.596217218777594e-6, "linear_gap:1e6")
    scenes = (
        Scene(cubic, Harmonic(441.2471126492003, 52.00892322654357e-6), duration=FixedDuration(20.0, 5.0)),
        Scene(linear, Harmonic(163.6355123267624, 7.1261118269347125e-6), duration=FixedDuration(12.0, 10.0)),
    )
    starts = [Given((each * 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0)) for each in range(1, 13)]
    found = [
        solve_scene(replace(scene, observe=observe, budget_s=0.0, start=start))
        for scene in scenes
        for start in starts
    ]
    assert any(each.motion is MotionKind.CHAOTIC_SO_FAR and "chaos ended" in each.ended for each in found)
    for each in found:
        if each.motion in {MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR}:
            assert each.lyapunov_per_s is None or each.lyapunov_per_s > 3.0 * each.lyapunov_error_per_s


def test_a_diverging_motion_has_an_outcome_but_no_response():
    """The initial state is so far out that the contact force overflows."""
    begins_far = Given((0.0, 1e300, -1e300, 0.0, 0.0, 0.0))
    scene = scene_of("power:7", 130.0, 20e-6, start=begins_far, duration=FixedDuration(0.1, 0.05))
    found = solve_scene(scene)
    assert found.outcome is not Outcome.REACHED_END
    assert found.response_i is None
    assert found.error_estimate is None


def stiff_specimen():
    """Return an undamped specimen without stops whose fastest mode is much faster than the drive."""
    masses = (0.0058, 2.1, 2000.0)
    stiffnesses = tuple(
        k * mass / own for k, mass, own in zip(gong2025().stiffnesses, masses, gong2025().masses, strict=True)
    )
    return replace(gong2025(0.0, contact="linear"), masses=masses, stiffnesses=stiffnesses)


@pytest.mark.thorough
def test_a_perturbation_that_swings_between_displacement_and_velocity_is_not_growing():
    slow = Scene(stiff_specimen(), Harmonic(0.02, 1e-5), duration=FixedDuration(100.0, 50.0))
    found = solve_scene(slow)
    assert found.memory is StartMemory.KEPT
    assert found.motion is MotionKind.QUASI_PERIODIC


def test_a_scene_with_too_many_steps_ends_with_an_explanation(monkeypatch):
    monkeypatch.setattr("vibench.sim.scene.followed_run.MOST_STEPS", 10_000_000)
    found = solve_scene(Scene(stiff_specimen(), Harmonic(0.02, 1e-5), duration=FixedDuration(100.0, 50.0)))
    assert found.outcome is Outcome.TOO_LONG
    assert "simulate less time" in found.ended
    assert found.response_i is None
    assert found.ensemble is None


def test_perturbations_count_towards_the_step_limit_of_a_run(monkeypatch):
    """A step with perturbations counts four times, and period maps share the limit of their run."""
    monkeypatch.setattr("vibench.sim.scene.followed_run.MOST_STEPS", 100_000)
    plain, tangent, mapped = (
        FollowedRun(gong2025(), Harmonic(130.0, 1e-6), 1e-6, np.zeros(6)) for _ in range(3)
    )
    tangent.follow_tangent()
    for run in (plain, tangent):
        run.follow(100.0)
        assert run.outcome is Outcome.TOO_LONG
    assert 3.0 < plain.time_s / tangent.time_s < 5.0
    images = [mapped.image(100)[0] for _ in range(9)]
    assert np.all(np.isfinite(images[0]))
    assert np.all(np.isnan(images[-1]))


@pytest.mark.parametrize(
    ("contact", "damping_time_s", "frequency_hz", "periods"),
    [("linear", 1e-6, 400.0, 3000), ("linear", 2e-6, 600.0, 3000), ("hertz", 2e-5, 380.0, 300)],
)
def test_a_slowly_decaying_motion_is_undecided(contact, damping_time_s, frequency_hz, periods):
    """Such a motion was once classified as quasi-periodic, with a response 50 % too large."""
    specimen = gong2025(contact=contact, damping_time_s=damping_time_s)
    length = AutomaticDuration(window_s=200 / frequency_hz, longest_s=periods / frequency_hz)
    answer = solve_scene(Scene(specimen, Harmonic(frequency_hz, 1e-6), duration=length, budget_s=0.0))
    assert answer.motion is MotionKind.UNDECIDED


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frequency_hz", "amplitude_m", "damping_time_s"),
    [
        (119.88743, 20e-6, 3e-5),  # approaches a torus for minutes
        (111.9871, 22.993e-6, 3.882e-5),  # peaks repeat in each part of the window, spectral lines do not
        (118.43285, 30.028e-6, 4.588e-5),
    ],
)
def test_the_errors_of_a_chosen_window_hold_for_a_later_window(frequency_hz, amplitude_m, damping_time_s):
    asked = Scene(
        gong2025(damping_time_s=damping_time_s),
        Harmonic(frequency_hz, amplitude_m),
        duration=AutomaticDuration(),
    )
    answer = solve_scene(asked)
    later = solve_scene(replace(asked, duration=FixedDuration(300.0, 5.0), budget_s=0.0))
    assert np.all(np.abs(responses(answer) / responses(later) - 1.0) < errors(answer))
    assert np.all(errors(answer) < 0.2)


def test_a_window_of_too_many_drive_periods_is_refused():
    fast = Scene(gong2025(contact="power:5"), Harmonic(1e6, 1e-6), duration=FixedDuration(1e4, 5.0))
    with pytest.raises(ValueError, match=r"give 2 s or less"):
        solve_scene(fast)


@pytest.mark.parametrize("duration", [AutomaticDuration(longest_s=20.0), FixedDuration()])
def test_a_motion_is_undecided_while_a_slow_drift_lasts(duration):
    drift = Scene(gong2025(damping_time_s=3e-5), Harmonic(119.88743, 20e-6), duration=duration)
    answer = solve_scene(drift)
    assert answer.motion is MotionKind.UNDECIDED
    assert answer.ended.endswith("still drifts")


def test_a_motion_of_undamped_modes_and_the_drive_is_quasi_periodic():
    specimen = gong2025(contact="linear", damping_time_s=0.0)
    length = AutomaticDuration(window_s=0.5, longest_s=10.0)
    answer = solve_scene(Scene(specimen, Harmonic(400.0, 1e-6), duration=length, budget_s=0.0))
    assert answer.motion is MotionKind.QUASI_PERIODIC


def test_an_unstable_motion_that_repeats_is_not_called_periodic():
    specimen, drive = gong2025(2.39e-5), Harmonic(121.99, 46.75e-6)
    near = (-1.33e-6, -8.49e-6, -2.97e-6, 0.0572, 0.0793, 0.0805)
    orbit = periodic_orbit(specimen, drive, start=near)
    assert 1.04 < abs(orbit.floquet_multipliers[0]) < 1.05
    start = Given(tuple(map(float, orbit.state)))
    for duration in (AutomaticDuration(), FixedDuration(0.8, 0.1)):
        found = solve_scene(Scene(specimen, drive, start=start, duration=duration))
        assert (found.motion, found.period) == (MotionKind.UNDECIDED, None)
        assert found.ended == "it repeats after 1 drive period(s), but no stable motion is near"
