"""The answer to a scene: what was seen, and how far to trust it. SI units."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..exponents.lyapunov import LyapunovEstimate, Precision, lyapunov_exponent
from ..model.accuracy import Accuracy
from ..model.arrays import Floats
from ..model.outcome import Outcome
from .course import Patience, SceneRun, run_for, settling
from .followed_run import FollowedRun, spectrum_of, states_of, whole_periods
from .linear_motion import LinearMotion, linear_motion
from .plan import plan_of, transient_decay_s
from .prediction import Ensemble, Method, MotionKind, ScenePrediction, StartMemory, State
from .repetition import FEWEST_TIMES, MOST_STATES, Pace, growth_of, pace_of
from .scatter import WindowScatter, window_scatter
from .scene import AutomaticDuration, FixedDuration, Observable, Scene
from .several_starts import (
    ALONE,
    FEWEST,
    SEED,
    TOO_FEW,
    Draw,
    ErrorOf,
    ReachedMotion,
    ensemble_beside,
    lasting,
    memory_of,
    reached_motion,
)
from .stated_error import (
    ROUNDING,
    SAFETY,
    UNKNOWN_ERRORS,
    StatedErrors,
    known,
    off_settled,
    stated_errors,
    with_errors,
)
from .states_alone import REMEMBERED, Asking, Following, alone, follow_all, in_lanes, lanes_are_worth_it

EXPONENT_S = 25.0
"""An exponent is averaged for so long, if it is not known well enough before [s]."""
EXPONENT_PRECISION = Precision(absolute_per_s=0.2, relative=0.01)


def solve_scene(scene: Scene) -> ScenePrediction:
    """Run a scene as planned, and say what was seen and how far to trust it.

    Each response has an error: how far, relatively, that of another run of the same scene at a far stricter
    accuracy may lie; ``error_estimate`` is the largest of the four. It is measured (docs/accuracy.md): where
    the motion has settled, twice the difference to a run with a far smaller tolerance that is taken on
    from the end until it has forgotten it; where it has not, twice the difference to such a run from the
    start. Where the two part, the start is forgotten and another run is another draw: the error is then what
    two draws differ by in 19 cases of 20.

    Raises
    ------
    ValueError
        When the specimen cannot be followed in time, or not from such a start.

    """
    return alone(solving_scene(scene))


def solving_scene(scene: Scene) -> Asking[ScenePrediction]:
    """Do as `solve_scene`, and hand out what may be followed beside others."""
    motion = linear_motion(scene.specimen, scene.drive, scene.start.state)
    plan = plan_of(scene, motion)
    if plan.method is Method.CLOSED_FORM:
        return _in_closed_form(scene, motion)
    return (yield from _followed(scene, plan.method, motion))


def solve_ensemble(
    scene: Scene, starts: int = FEWEST, seed: int = SEED, budget_s: float = math.inf
) -> Ensemble | None:
    """Follow a scene from so many starts a millionth of the gap apart, whether or not its own is forgotten.

    `solve_scene` does so by itself where the start is forgotten, with as few starts as tell the motions
    apart; more of them give narrower intervals, and another seed another draw.

    Parameters
    ----------
    scene
        Asked for; its start is the first.
    starts
        How many, that one among them; at least 4.
    seed
        Of the small changes of the start.
    budget_s
        Processor time for all of them, counted as that of a scene; without an end when infinite.

    Returns
    -------
    What they came to. None where the motion is known in closed form, was lost, or the budget is too small.

    Raises
    ------
    ValueError
        When fewer than 4 starts are asked for, or the specimen cannot be followed in time.

    """
    if starts < TOO_FEW:
        msg = f"An ensemble of {starts} starts is not allowed: ask for {TOO_FEW} or more."
        raise ValueError(msg)
    motion = linear_motion(scene.specimen, scene.drive, scene.start.state)
    if plan_of(scene, motion).method is Method.CLOSED_FORM:
        return None
    begin = FollowedRun(scene.specimen, scene.drive, scene.accuracy.tolerance, scene.start.state)
    run = begin.apart()
    follow = in_lanes if lanes_are_worth_it(starts, scene.duration) else alone
    seen, pace = alone(_seen(scene, run, motion))
    if run.outcome is not Outcome.REACHED_END:
        return None
    asked = _asked(run, seen, _between_windows(seen))
    errors = alone(stated_errors(scene, begin, run, seen, pace, motion.slowest_rate))
    error_of = _error_of(scene.accuracy, asked, errors, pace)
    draw = Draw(starts, starts, starts, seed, budget_s)
    return follow(ensemble_beside(scene, begin, asked, pace, error_of, draw))


def _in_closed_form(scene: Scene, motion: LinearMotion) -> ScenePrediction:
    """Give the steady motion without contact."""
    amplitude, period_s = scene.drive.amplitude_m, 1.0 / scene.drive.frequency_hz
    settled_s: float | None = None
    match scene.duration:
        case FixedDuration(duration_s=duration_s, window_s=window_s):
            ended = f"the {duration_s:g} s asked for are over"
        case AutomaticDuration():
            settled_s, window_s = transient_decay_s(motion), period_s
            duration_s = settled_s + period_s
            ended = "it repeats after 1 drive period(s)"
    x, p = abs(motion.steady_x) / amplitude, abs(motion.steady_p) / amplitude
    has_exponent = Observable.LYAPUNOV in scene.observe
    found = ScenePrediction(
        frequency_hz=scene.drive.frequency_hz,
        amplitude_m=amplitude,
        response_i=x,
        response_ii=x,
        relative_i=p,
        relative_ii=p,
        impacts=0,
        impact_rate_hz=0.0,
        motion=MotionKind.PERIODIC,
        period=1,
        duration_s=duration_s,
        window_s=window_s,
        settled_s=settled_s,
        ended=ended,
        integration_error=0.0,
        scatter=0.0 if Observable.SCATTER in scene.observe else None,
        lyapunov_per_s=motion.slowest_rate if has_exponent else None,
        lyapunov_error_per_s=0.0 if has_exponent else None,
        start=scene.start.name,
        final_state=_state(motion.state(duration_s)),
        outcome=Outcome.REACHED_END,
        method=Method.CLOSED_FORM,
        accuracy=scene.accuracy.value,
        memory=StartMemory.KEPT,
    )
    found = with_errors(found, np.full(4, motion.share_left(duration_s - window_s) + ROUNDING))
    if Observable.POINCARE in scene.observe:
        periods = whole_periods(duration_s, scene.drive.frequency_hz)
        count = whole_periods(window_s, scene.drive.frequency_hz)
        found = replace(found, section=np.tile(motion.state(periods * period_s), (count, 1)))
    if Observable.SPECTRUM in scene.observe:
        return replace(found, spectrum_hz=np.array([scene.drive.frequency_hz]), spectrum=np.array([x]))
    return found


def settle_scene(scene: Scene) -> ScenePrediction:
    """Run a scene as planned, and say what it came to, but neither errors nor what other starts come to.

    It is the same motion that `solve_scene` describes, in a third of the time or less: for maps, whose
    neighbouring points tell more than the error of each. Chaos is followed on for as long as the scene's
    duration allows. One of an automatic duration ends after whole drive periods.

    Raises
    ------
    ValueError
        When the specimen cannot be followed in time, or not from such a start.

    """
    return alone(settling_scene(scene))


def settling_scene(scene: Scene) -> Asking[ScenePrediction]:
    """Do as `settle_scene`, and hand out what may be followed beside others."""
    motion = linear_motion(scene.specimen, scene.drive, scene.start.state)
    method = plan_of(scene, motion).method
    if method is Method.CLOSED_FORM:
        found = _in_closed_form(scene, motion)
        # As a motion that is followed: what goes on from its end finds the drive where it was at its start.
        length_s = math.ceil(found.duration_s * scene.drive.frequency_hz) / scene.drive.frequency_hz
        return replace(found, duration_s=length_s, final_state=_state(motion.state(length_s)))
    run = _begun(scene)
    seen, _ = yield from _watching(scene, run, motion, math.inf, is_exact=False)
    return _found(scene, method, run, seen, _Judged())


@dataclass(frozen=True, eq=False)
class _Judged:
    """What is known of a motion beyond what was seen of it."""

    errors: StatedErrors = UNKNOWN_ERRORS
    drawn: WindowScatter | None = None
    memory: StartMemory = StartMemory.UNKNOWN
    ensemble: Ensemble | None = None


def _begun(scene: Scene) -> FollowedRun:
    return FollowedRun(scene.specimen, scene.drive, scene.accuracy.tolerance, scene.start.state)


def _followed(scene: Scene, method: Method, motion: LinearMotion) -> Asking[ScenePrediction]:
    """Follow the motion in time, and judge it."""
    begin = _begun(scene)
    run = begin.apart()
    seen, pace = yield from _seen(scene, run, motion)
    is_whole = run.outcome is Outcome.REACHED_END
    errors = UNKNOWN_ERRORS
    if is_whole:
        errors = yield from stated_errors(scene, begin, run, seen, pace, motion.slowest_rate)
    drawn = _between_windows(seen) if is_whole else None
    memory = memory_of(scene, begin, seen, motion)
    ensemble: Ensemble | None = None
    if is_whole and (memory is StartMemory.LOST or Observable.SCATTER in scene.observe):
        asked = _asked(run, seen, drawn)
        error_of = _error_of(scene.accuracy, asked, errors, pace)
        ensemble = yield from ensemble_beside(scene, begin, asked, pace, error_of)
    return _found(scene, method, run, seen, _Judged(errors, drawn, memory, ensemble))


def _found(scene: Scene, method: Method, run: FollowedRun, seen: SceneRun, by: _Judged) -> ScenePrediction:
    """Write down what was seen of a motion that was followed in time."""
    window, amplitude = seen.window, scene.drive.amplitude_m
    is_whole = run.outcome is Outcome.REACHED_END
    exponent = _exponent(scene, run) if is_whole and Observable.LYAPUNOV in scene.observe else None
    found = ScenePrediction(
        frequency_hz=scene.drive.frequency_hz,
        amplitude_m=amplitude,
        response_i=window.largest_x_m / amplitude if is_whole else None,
        response_ii=abs(window.line_x_m) / amplitude if is_whole else None,
        relative_i=window.largest_p_m / amplitude if is_whole else None,
        relative_ii=abs(window.line_p_m) / amplitude if is_whole else None,
        impacts=window.impacts,
        impact_rate_hz=window.impacts / window.length_s if window.length_s > 0.0 else 0.0,
        motion=_lasting(scene, seen, by.ensemble),
        period=None if seen.repeats is None else seen.repeats.period,
        duration_s=run.time_s,
        window_s=window.length_s,
        settled_s=seen.settled_s,
        ended=_ended(seen, by.ensemble),
        integration_error=known(by.errors.integration),
        scatter=_scatter(scene, by.ensemble, by.drawn),
        lyapunov_per_s=known(exponent.exponent_per_s) if exponent is not None else None,
        lyapunov_error_per_s=known(exponent.standard_error_per_s) if exponent is not None else None,
        start=scene.start.name,
        final_state=_state(run.state),
        outcome=run.outcome,
        method=method,
        accuracy=scene.accuracy.value,
        memory=by.memory,
        ensemble=by.ensemble if by.memory is StartMemory.LOST else None,
    )
    found = with_errors(found, by.errors.stated)
    return _with_pictures(scene, found, seen) if is_whole else found


def _seen(scene: Scene, run: FollowedRun, motion: LinearMotion) -> Asking[tuple[SceneRun, Pace]]:
    """Follow the motion for as long as was asked; chaos alone for a part of the budget."""
    return _watching(scene, run, motion, ALONE * scene.budget_s)


def _watching(
    scene: Scene, run: FollowedRun, motion: LinearMotion, alone_s: float, *, is_exact: bool = True
) -> Asking[tuple[SceneRun, Pace]]:
    """Do the same, chaos alone for so long, and hand out what may be followed beside others."""
    drive = scene.drive
    longest_s = scene.duration.longest_s
    pace = pace_of(scene.specimen, drive.frequency_hz, scene.accuracy, motion.slowest_rate, longest_s)
    match scene.duration:
        case FixedDuration(duration_s=duration_s, window_s=window_s):
            return (yield from run_for(run, duration_s, window_s, pace)), pace
        case AutomaticDuration(window_s=window_s):
            patience = Patience(window_s, min(longest_s, MOST_STATES / drive.frequency_hz), alone_s, is_exact)
            return (yield from settling(run, patience, pace)), pace


def _between_windows(seen: SceneRun) -> WindowScatter | None:
    """Find the scatter of Response I from blocks, if nothing repeats."""
    if seen.motion is MotionKind.PERIODIC:
        return None
    return window_scatter([block.peak_x_m for block in seen.blocks], len(seen.window.blocks))


def _asked(run: FollowedRun, seen: SceneRun, drawn: WindowScatter | None) -> ReachedMotion:
    """Describe what the start that was asked for came to."""
    period = None if seen.repeats is None else seen.repeats.period
    growth = growth_of(seen.path)
    return reached_motion(run, seen.motion, period, seen.window, drawn, seen.wandered_until_s, growth)


def _error_of(accuracy: Accuracy, asked: ReachedMotion, errors: StatedErrors, pace: Pace) -> ErrorOf:
    """Make what estimates the error of the responses of a motion that some start came to."""

    def error_of(reached: ReachedMotion) -> float | None:
        if reached is asked:
            return known(float(np.max(errors.stated)))
        if reached.period is None:
            return None if reached.scatter is None else reached.scatter.between_runs
        off = off_settled(reached.run, reached.responses_m, accuracy, reached.period, pace.forgetting_s)
        return known(SAFETY * float(np.max(off)) + pace.sharpness.tolerance + ROUNDING)

    return error_of


def _lasting(scene: Scene, seen: SceneRun, ensemble: Ensemble | None) -> MotionKind:
    """Call a motion chaotic that was asked to be followed until it has settled only if it lasts."""
    escape = None if ensemble is None else ensemble.escape
    match scene.duration:
        case FixedDuration() if escape is None or escape.escapes == 0:
            return seen.motion
        case _:
            return lasting(seen.motion, escape)


def _ended(seen: SceneRun, ensemble: Ensemble | None) -> str:
    if seen.motion is MotionKind.CHAOTIC and ensemble is not None and ensemble.escape is not None:
        return f"{seen.ended} (mean lifetime above {ensemble.escape.lifetime_above_s:.3g} s)"
    return seen.ended


def _scatter(scene: Scene, ensemble: Ensemble | None, drawn: WindowScatter | None) -> float | None:
    """Give the scatter of Response I over starts, where it was asked for, or else over windows."""
    if Observable.SCATTER in scene.observe:
        return None if ensemble is None else ensemble.scatter
    return None if drawn is None else drawn.relative


def _exponent(scene: Scene, run: FollowedRun) -> LyapunovEstimate:
    """Find the largest exponent of the motion that a run has come to."""
    drive = scene.drive
    phase = math.fmod(
        2.0 * math.pi * math.fmod(drive.frequency_hz * run.time_s, 1.0) + drive.phase_rad, 2.0 * math.pi
    )
    return lyapunov_exponent(
        scene.specimen,
        replace(drive, phase_rad=phase),
        scene.accuracy,
        EXPONENT_S,
        0.0,
        run.state,
        precision=EXPONENT_PRECISION,
    )


def _with_pictures(scene: Scene, found: ScenePrediction, seen: SceneRun) -> ScenePrediction:
    """Add the section and the spectrum where they were asked for."""
    window = seen.window
    if Observable.POINCARE in scene.observe:
        found = replace(found, section=states_of(window.stretches))
    if Observable.SPECTRUM in scene.observe:
        lines = spectrum_of(window)
        return replace(
            found, spectrum_hz=lines.frequency_hz, spectrum=lines.amplitude_m / scene.drive.amplitude_m
        )
    return found


def _state(values: Floats) -> State:
    x, y, z, vx, vy, vz = (float(value) for value in values)
    return (x, y, z, vx, vy, vz)


MOST_HELD = 2e7
"""States of scenes that are solved together, about: a gigabyte."""


@dataclass(frozen=True, eq=False)
class Solved:
    """What a scene came to that was solved beside others."""

    prediction: ScenePrediction
    taken_s: float
    """Processor time of this thread for it [s]; of what was followed together, its part. NaN when what a
    process pays once was part of it."""


def solve_scenes(scenes: Sequence[Scene]) -> list[Solved]:
    """Solve several scenes, each as `solve_scene` does, in lanes as long as states are enough.

    The answer to each does not depend on the others.

    Raises
    ------
    ValueError
        When one of them cannot be followed in time, or not from its start.

    """
    return _side_by_side(scenes, solving_scene)


def settle_scenes(scenes: Sequence[Scene]) -> list[Solved]:
    """Settle several scenes, each as `settle_scene` does; as `solve_scenes` otherwise."""
    return _side_by_side(scenes, settling_scene)


def _side_by_side(
    scenes: Sequence[Scene], asking: Callable[[Scene], Asking[ScenePrediction]]
) -> list[Solved]:
    found: list[Solved] = []
    together: list[Scene] = []
    for scene in scenes:
        if together and sum(map(_held_states, (*together, scene))) > MOST_HELD:
            found += _solved(together, asking)
            together = []
        together.append(scene)
    return found + _solved(together, asking)


def _held_states(scene: Scene) -> float:
    """Say how many states of a scene are held at a time, of all its starts, at most."""
    per_start = REMEMBERED * scene.duration.longest_s / FEWEST_TIMES * scene.drive.frequency_hz
    return per_start * (FEWEST if scene.budget_s > 0.0 else 1.0)


def _solved(scenes: Sequence[Scene], asking: Callable[[Scene], Asking[ScenePrediction]]) -> list[Solved]:
    under_way = [asking(scene) for scene in scenes]
    answers: dict[int, ScenePrediction] = {}
    taken_s = [0.0] * len(scenes)
    while len(answers) < len(scenes):
        asked: dict[int, Sequence[Following]] = {}
        for place, each in enumerate(under_way):
            if place not in answers:
                began_s = time.thread_time()
                try:
                    asked[place] = next(each)
                except StopIteration as end:
                    answers[place] = end.value
                taken_s[place] += time.thread_time() - began_s
        began_s = time.thread_time()
        follow_all([each for several in asked.values() for each in several])
        share_s = (time.thread_time() - began_s) / max(1, sum(len(each) for each in asked.values()))
        for place, several in asked.items():
            taken_s[place] += share_s * len(several)
    return [Solved(answers[place], taken_s[place]) for place in range(len(scenes))]


def solve_in_lanes(scene: Scene) -> ScenePrediction:
    """Solve one scene as `solve_scenes` does among any others: to the last digit the same answer.

    For one scene alone `solve_scene` is faster; of chaos it is another draw.
    """
    return solve_scenes([scene])[0].prediction


def settle_in_lanes(scene: Scene) -> ScenePrediction:
    """Settle one scene as `settle_scenes` does among any others: to the last digit the same answer.

    For one scene alone `settle_scene` is faster; of chaos it is another draw.
    """
    return settle_scenes([scene])[0].prediction
