"""Stated errors are large enough: in transients, for long periods, without damping."""

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, Scene, gong2025, solve_scene
from vibench.sim.scene.followed_run import Block
from vibench.sim.scene.prediction import MotionKind
from vibench.sim.scene.scatter import draws_apart
from vibench.sim.scene.scene import FixedDuration, Given

from .predictions import errors, responses, scene_of

FROM_REST = FixedDuration(0.1, 0.05)


@pytest.mark.parametrize("accuracy", [Accuracy.QUICK, Accuracy.STANDARD])
@pytest.mark.parametrize("contact", ["power:7", "power:47", "power:201", "linear_gap", "hertz"])
def test_errors_of_transient_responses_are_within_the_stated_bound(contact, accuracy):
    found, truth = (
        solve_scene(scene_of(contact, 130.0, 20e-6, accuracy=level, duration=FROM_REST))
        for level in (accuracy, Accuracy.REFERENCE)
    )
    off = np.abs(responses(found) / responses(truth) - 1.0)
    assert np.all(off <= errors(found) + errors(truth))
    assert np.all(errors(found) < 1e-2)
    assert found.error_estimate == errors(found).max()


def test_a_transient_without_contact_is_exact():
    found = solve_scene(scene_of("hertz", 100.0, 1e-30, duration=FixedDuration(3.0, 1.0)))
    assert found.motion is MotionKind.UNDECIDED
    assert np.all(errors(found) < 1e-10)


@pytest.mark.parametrize("window_s", [0.5, 0.51])
def test_spectral_lines_are_computed_over_whole_periods_of_the_motion(window_s):
    found, longer = (
        solve_scene(scene_of("power:7", 278.6, 3e-6, duration=FixedDuration(8.0, length_s)))
        for length_s in (window_s, 2.0)
    )
    assert found.period == longer.period == 5
    # The window is not a multiple of five drive periods; leakage of subharmonics would be 1e-4.
    assert int(window_s * 278.6) % 5 != 0
    off = np.abs(responses(found) / responses(longer) - 1.0)
    assert np.all(off <= errors(found) + errors(longer))
    assert errors(found)[1] < 1e-6


def test_responses_agree_within_errors_even_if_only_one_accuracy_level_finds_the_period():
    """Only quick finds the period of five drive periods; over other lengths the leakage is 4e-3."""
    specimen = gong2025(1.2805892626268502e-05, 1.9123796753034876e-05, "power:3")
    drive, length = Harmonic(247.36193250882872, 1.0156553904452063e-06), FixedDuration(0.8114, 0.4708)
    quick, standard, reference = (
        solve_scene(Scene(specimen, drive, accuracy=level, duration=length)) for level in Accuracy
    )
    for found in (quick, standard):
        off = np.abs(responses(reference) / responses(found) - 1.0)
        assert np.all(off <= errors(found) + errors(reference))


def test_the_error_of_a_fixed_window_includes_the_distance_to_the_steady_state():
    specimen = gong2025(3.141343367807852e-6, 3.1865246546292145e-5, "linear_gap")
    drive = Harmonic(561.6604926866107, 2.6175677047112556e-6)
    found, later = (
        solve_scene(Scene(specimen, drive, duration=FixedDuration(length_s, 2.0)))
        for length_s in (30.0, 300.0)
    )
    assert found.motion is later.motion is MotionKind.PERIODIC
    off = np.abs(responses(found) / responses(later) - 1.0)
    assert off.max() > 1e-8
    assert np.all(off <= errors(found) + errors(later))


def test_undamped_motions_from_different_initial_states_differ_within_the_stated_error():
    """Each of 24 differences is within the error at 95 % probability; fewer than 16 at 0.01 %."""
    scene = scene_of("hunt_crossley:1", 64.4, 20e-6, 0.0, duration=FixedDuration(3.0, 1.0))
    found = solve_scene(scene)
    scale = 1e-9 * np.repeat([1.0, 400.0], 3)
    starts = np.random.default_rng(3).uniform(-1.0, 1.0, (6, 6)) * scale
    others = [
        solve_scene(
            Scene(
                scene.specimen, scene.drive, duration=scene.duration, start=Given(tuple(start)), budget_s=0.0
            )
        )
        for start in starts.tolist()
    ]
    inside = [np.abs(responses(other) / responses(found) - 1.0) <= errors(found) for other in others]
    assert np.count_nonzero(inside) >= 16


def test_spectral_lines_of_two_windows_agree_within_the_stated_error():
    random, inside = np.random.default_rng(7), 0
    for _ in range(1000):
        one, another = (5.0 + 0.4 * (random.normal(size=10) + 1j * random.normal(size=10)) for _ in range(2))
        blocks = [Block(1.0 + 0.1 * random.random(), 1.0 + 0.1 * random.random(), line, line) for line in one]
        apart = abs(abs(another.mean()) / abs(one.mean()) - 1.0)
        inside += apart <= draws_apart(blocks, 10)[1]
    assert inside / 1000 > 0.93


@pytest.mark.parametrize(
    ("contact", "amplitude_m", "frequency_hz", "duration_s"),
    [("rigid:1", 10e-6, 100.0, 0.4), ("linear_gap", 10e-6, 100.0, 0.35), ("rigid:0.5", 20e-6, 240.0, 0.4)],
)
def test_the_stated_errors_of_exactly_solved_laws_include_the_growth_of_rounding_errors(
    contact, amplitude_m, frequency_hz, duration_s
):
    """Scaled lengths give the same scene. Compared with itself, an exact law had an error of 1e-11."""
    found = []
    for scale in np.linspace(0.7, 1.4, 24):
        drive = Harmonic(frequency_hz, scale * amplitude_m)
        specimen = gong2025(contact=contact, gap_m=scale * 45e-6)
        length = FixedDuration(duration_s, 0.5 * duration_s)
        answer = solve_scene(Scene(specimen, drive, duration=length, budget_s=0.0))
        found.append((answer.response_i, answer.response_i * answer.response_i_error))
    answers, stated = np.transpose(found)
    assert np.all(np.abs(answers[:, None] - answers) <= stated[:, None] + stated)


def test_stated_errors_include_step_errors_before_divergence():
    # The largest p occurs before the runs diverge; its error at quick is 1.6e-5.
    start = Given((-3.011e-05, -5.022e-05, 4.918e-05, -0.03867, 0.003417, -0.01607))
    drive, length = Harmonic(300.749, 1.661e-05, 4.993954), FixedDuration(0.3, 0.3)
    found, truth = (
        solve_scene(Scene(gong2025(5e-6), drive, accuracy=level, duration=length, start=start, budget_s=0.01))
        for level in (Accuracy.QUICK, Accuracy.REFERENCE)
    )
    off = abs(found.relative_i / truth.relative_i - 1.0)
    assert 1e-6 < off < found.relative_i_error < 1e-3
