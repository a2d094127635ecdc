"""Measured errors of the responses of a scene. SI units.

In a settled motion, integration errors decay. The responses are compared with those of the periodic motion
that Newton's iteration finds with a far smaller tolerance. A motion that has not settled accumulates errors:
it is repeated from its start with the smaller tolerance and compared in the same window. If the two runs
diverge, a repeated run is a new random sample. The difference of two samples is estimated from the blocks of
the window if the motion is stationary, otherwise from a few nearly equal starts.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..engine.run import Accuracy, Outcome, Watch
from ..specimen.specimen import Floats
from .course import FixedPoint, Lead, SceneRun
from .followed_run import FollowedRun, ObservedWindow, observe_window
from .prediction import MotionKind, ScenePrediction
from .repetition import Pace
from .scatter import draws_apart, draws_of_starts
from .scene import AutomaticDuration, Scene
from .several_starts import SEED, pushes
from .states_alone import Follow

STRICTER = {Accuracy.QUICK: 1e-10, Accuracy.STANDARD: 1e-10, Accuracy.REFERENCE: 1e-12}
"""Tolerance of the stricter run. The tolerance must be far below the error of closed-form collisions, which
is itself below a hundredth of the tolerance of *quick*."""
SHORTER = 4
"""Number of parts of a window; each is compared with the window. Leakage in a part is this factor larger."""
LOOKS = 8
"""Number of periods that are compared: periods of a repeating motion, otherwise of the drive."""
SAFETY = 2.0
"""Safety factor: stated error / measured error."""
ROUNDING = 1e-11
"""Relative rounding error of an exact result."""
ROUNDED = 1e-13
"""Offset of the start of the stricter run, relative to the drive amplitude. The offset is several times the
accumulated rounding error of a run, because one offset is only one sample of rounding errors."""
SIDES = np.array([1.0, -1.0, -1.0, -1.0, 1.0, 1.0])
"""Sign of the offset of each coordinate; y and z have the same sign, so that p does not change."""
FIRST_LOOK = 16
"""Drive periods until two runs are first compared; the number doubles before each later comparison."""
PARTED = 0.05
"""Difference [gaps], or relative difference of responses, above which two runs have separated."""
MEMORIES = 8.0
"""Decay times of the slowest mode after which a chaotic motion counts as stationary."""
MEMBERS = 5
"""Number of additional starts if the window cannot show how much two random samples differ."""


@dataclass(frozen=True, eq=False)
class StatedErrors:
    """Relative errors of Response I and II of x, then of p; NaN where unknown."""

    stated: Floats
    """Relative error of each of the four responses, shape (4,)."""
    integration: float
    """Largest measured integration error, which a stricter accuracy would reduce."""


UNKNOWN_ERRORS = StatedErrors(np.full(4, np.nan), np.nan)
"""Errors of a run that failed: all unknown."""


def stated_errors(
    scene: Scene,
    begin: FollowedRun,
    run: FollowedRun,
    seen: SceneRun,
    pace: Pace,
    slowest_rate: float,
    follow: Follow,
) -> StatedErrors:
    """Return the errors of the four responses of a scene.

    Parameters
    ----------
    scene
        Requested scene.
    begin, run
        The motion at time zero, and at its end.
    seen, pace
        Window and kind of the motion, and its time scales and tolerances.
    slowest_rate
        Rate of the slowest mode without contact [1/s], zero or negative.
    follow
        Function that integrates other starts.
    """
    answer = seen.window.responses_m
    # If the stricter run does not repeat yet, its spectral lines span another time: add the leakage.
    sure = _rounding(answer) + seen.leaked
    if isinstance(scene.duration, AutomaticDuration) and seen.repeats is None:
        sure += _by_window(seen)
    if seen.repeats is not None and seen.was_settled:
        off = settled_errors(run, answer, scene.accuracy, seen.steady)
        return StatedErrors(SAFETY * off + seen.repeats.distance + _rounding(answer), float(np.max(off)))
    if seen.steady is not None:
        steady_m = _responses(seen.steady.run.copy(), seen.steady.period / scene.drive.frequency_hz)
        sure += SAFETY * np.abs(answer - steady_m) / answer
    strict = _strict_run(scene, begin, seen, run)
    if strict.responses_m is not None and strict.is_together:
        off = np.abs(answer - strict.responses_m) / np.abs(answer)
        if float(np.max(off)) < PARTED:
            return StatedErrors(SAFETY * off + sure, float(np.max(off)))
    added = error_per_period(run, scene.accuracy)
    drawn, memories = None, -slowest_rate * seen.window.begins.time_s
    if seen.motion is MotionKind.CHAOTIC and memories >= MEMORIES:
        drawn = draws_apart(seen.blocks, len(seen.window.blocks))
    if drawn is None:
        drawn = draws_of_starts(answer, _more_starts(begin, seen, strict, pace, follow))
    return StatedErrors(drawn + SAFETY * added + seen.leaked, added)


def _by_window(seen: SceneRun) -> Floats:
    """Estimate the relative errors due to the position of the window in time, shape (4,).

    The errors are the largest differences from the responses in shorter windows at other positions. Early
    windows are included, because a slowly settling motion may settle further.
    """
    answer = seen.window.responses_m
    lines = np.array([[block.line_x_m, block.line_p_m] for block in seen.blocks])
    peaks = np.array([[block.peak_x_m, block.peak_p_m] for block in seen.blocks])
    length = max(1, len(seen.window.blocks) // SHORTER)
    short = [slice(first, first + length) for first in range(len(seen.blocks) - length + 1)]
    off_peaks = np.max([np.abs(peaks[each].max(axis=0) - answer[::2]) for each in short], axis=0)
    whole = np.array([seen.window.line_x_m, seen.window.line_p_m])
    off_lines = np.max([np.abs(lines[each].mean(axis=0) - whole) for each in short], axis=0) / SHORTER
    return np.asarray(SAFETY * np.array([off_peaks, off_lines]).T.ravel() / answer)


def _rounding(answer: Floats) -> Floats:
    """Return the relative rounding errors of responses; line and peak have the same absolute error."""
    return ROUNDING * np.repeat(answer[::2], 2) / answer


@dataclass(frozen=True, eq=False)
class _StrictRun:
    """Stricter run: the motion, integrated from the start with a smaller tolerance."""

    run: FollowedRun
    """Stricter run at the time when it separated from the original run, or at the window's end."""
    responses_m: Floats | None
    """Responses in the window [m], shape (4,); None if the two runs separate before the window."""
    is_together: bool
    """Whether the stricter run stayed together with the original run."""


def _more_starts(
    begin: FollowedRun, seen: SceneRun, strict: _StrictRun, pace: Pace, follow: Follow
) -> list[Floats]:
    """Return the responses of a few more starts in the same window, shape (4,) each; NaN if a run fails.

    The stricter run is one of these starts, because all other runs share step errors until they separate.
    """
    pushed = pushes(begin.specimen, begin.drive, MEMBERS, SEED)
    runs = [begin.with_push(push) for push in pushed[1:]]
    found = [strict.responses_m] if strict.responses_m is not None else []
    if not found:
        runs.append(strict.run.copy(begin.tolerance))
    window = seen.window
    until_s = max(window.begins.time_s - pace.section_s, *(run.time_s for run in runs))
    leads = [Lead(run, until_s, pace) for run in runs]
    follow([lead.states for lead in leads if lead.states is not None])
    for run, lead in zip(runs, leads, strict=True):
        lead.end()
        run.follow(window.begins.time_s)
        found.append(_responses_in(observe_window(run, window.length_s), run))
    return found


def settled_errors(run: FollowedRun, answer: Floats, accuracy: Accuracy, steady: FixedPoint | None) -> Floats:
    """Return the relative errors of the responses of a repeating motion; NaN if they cannot be computed.

    The responses in this and the next periods, whose time steps differ, are compared with those of the
    periodic motion near the run, computed with a smaller tolerance.
    """
    if steady is None:
        return np.full(4, np.nan)
    cycle_s, on = steady.period / run.drive.frequency_hz, run.copy(accuracy.tolerance)
    exact = _responses(steady.run.copy(), LOOKS * cycle_s)
    seen = [answer, *(_responses(on, cycle_s) for _ in range(LOOKS))]
    return np.asarray(np.max(np.abs(np.array(seen) - exact), axis=0) / np.abs(exact))


def error_per_period(run: FollowedRun, accuracy: Accuracy) -> float:
    """Return the largest relative error that one drive period adds to the responses; NaN if a run fails."""
    cycle_s = 1.0 / run.drive.frequency_hz
    on = run.copy(accuracy.tolerance)
    seen, missed = [], []
    for _ in range(LOOKS):
        twin = on.copy(STRICTER[accuracy])
        seen.append(_responses(on, cycle_s))
        missed.append(np.abs(seen[-1] - _responses(twin, cycle_s)))
    return float(np.max(np.max(missed, axis=0) / np.max(np.abs(seen), axis=0)))


def _strict_run(scene: Scene, begin: FollowedRun, seen: SceneRun, run: FollowedRun) -> _StrictRun:
    """Integrate a motion from its start with a smaller tolerance, until the runs separate or the window ends.

    The start is offset by a rounding error. Otherwise exact motion between contacts would be compared with
    itself. A motion that amplifies rounding errors would then appear exact.
    """
    loose, strict = begin.copy(scene.accuracy.tolerance), begin.copy(STRICTER[scene.accuracy])
    strict = strict.with_push(ROUNDED * scene.drive.amplitude_m * SIDES * strict.scales)
    begin_s, frequency = seen.window.begins.time_s, begin.drive.frequency_hz
    while strict.time_s < begin_s:
        until_s = min(begin_s, max(2.0 * strict.time_s, FIRST_LOOK / frequency))
        for each in (loose, strict):
            each.follow(until_s)
        if not _are_together(scene, loose, strict):
            return _StrictRun(strict, None, is_together=False)
    # Take the spectral lines over the same number of drive periods as in the original run.
    window = observe_window(strict, seen.window.length_s, max(seen.window.line_periods, 1))
    return _StrictRun(strict, _responses_in(window, strict), _are_together(scene, run, strict))


def _responses_in(window: ObservedWindow, run: FollowedRun) -> Floats:
    """Return the responses in a window of a run [m], shape (4,); NaN if the run failed."""
    return window.responses_m if run.outcome is Outcome.REACHED_END else np.full(4, np.nan)


def _are_together(scene: Scene, one: FollowedRun, other: FollowedRun) -> bool:
    """Return whether the states of two runs agree within `PARTED` times the gap; False if a run failed."""
    if not one.outcome is other.outcome is Outcome.REACHED_END:
        return False
    apart = np.abs(one.motion - other.motion) / one.scales
    return bool(np.max(apart) < PARTED * min(scene.specimen.gaps_m))


def _responses(run: FollowedRun, length_s: float) -> Floats:
    """Integrate over whole drive periods and return the responses [m], shape (4,); NaN if that fails."""
    seen = run.follow(run.time_s + length_s, Watch.PEAKS_AND_LINES)
    if run.outcome is not Outcome.REACHED_END:
        return np.full(4, np.nan)
    scale = 2.0 / length_s
    return np.array([seen.peak_x_m, scale * abs(seen.area_x), seen.peak_p_m, scale * abs(seen.area_p)])


def with_errors(found: ScenePrediction, stated: Floats) -> ScenePrediction:
    """Return the prediction with the errors of its four responses, and the largest of these errors."""
    response_i, response_ii, relative_i, relative_ii = (finite_or_none(float(error)) for error in stated)
    return replace(
        found,
        response_i_error=response_i,
        response_ii_error=response_ii,
        relative_i_error=relative_i,
        relative_ii_error=relative_ii,
        error_estimate=finite_or_none(float(np.max(stated))),
    )


def finite_or_none(value: float) -> float | None:
    """Return the number if it is finite, otherwise None."""
    return value if math.isfinite(value) else None
