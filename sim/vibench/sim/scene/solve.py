"""Solve scenes and estimate the errors of their responses. SI units."""

import math
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..engine.run import Outcome
from ..specimen.stops import member
from .course import FixedCourse, SceneRun, SettlingCourse, stable_motion
from .followed_run import (
    FollowedRun,
    spectrum_of,
    states_of,
    take_steps,
    take_steps_of_all,
    whole_periods,
)
from .plan import DECAYED_SHARE, LinearMotion, linear_motion, plan_of
from .prediction import Ensemble, Method, MotionKind, ScenePrediction, StartMemory, state_of
from .repetition import FEWEST_TIMES, MOST_STATES, growth_of, pace_of
from .scatter import WindowScatter, window_scatter
from .scene import FEWEST, AutomaticDuration, FixedDuration, Observable, Scene
from .several_starts import (
    ALONE,
    SEED,
    TOO_FEW,
    Draw,
    ReachedMotion,
    SeveralStarts,
    ensemble_of,
    lasting,
    memory_of,
)
from .stated_error import (
    ROUNDING,
    SAFETY,
    UNKNOWN_ERRORS,
    StatedErrors,
    finite_or_none,
    settled_errors,
    stated_errors,
    with_errors,
)
from .states_alone import REMEMBERED, Follow, batches_are_worth_it, in_batches, one_by_one

if TYPE_CHECKING:
    from ..exponents.lyapunov import ExponentRun, LyapunovEstimate

EXPONENT_S = 25.0
"""Longest averaging time of a Lyapunov exponent [s]."""
EXPONENT_PRECISION = 0.2, 0.01
"""Required standard error of a Lyapunov exponent: absolute [1/s], and relative."""


class Question(StrEnum):
    """Set of results requested for a scene."""

    ANSWER = "answer"
    """Responses with errors and, with sensitive dependence on the start, motions from other starts."""
    MOTION = "motion"
    """Only the motion and its responses, without errors; for maps, where neighbouring points show errors."""


QuestionWord = Literal["answer", "motion"]


@dataclass(frozen=True)
class InBatches:
    """Solver that solves many scenes together, by `solve_scenes`."""

    question: Question = Question.ANSWER


Solver = Callable[[Scene], ScenePrediction] | InBatches
"""Solver of scenes: a function for one scene, or `InBatches`."""


def solve_scene(scene: Scene, question: Question | QuestionWord = Question.ANSWER) -> ScenePrediction:
    """Solve a scene as planned, with error estimates.

    Each of the four responses has a relative error; ``error_estimate`` is the largest. An error is twice the
    measured difference from a run with a far smaller tolerance (docs/accuracy.md). For a settled motion, the
    stricter run is the periodic motion that Newton's iteration finds; otherwise it begins at the start. If
    the two runs separate, any repeated run is a new random sample. The error is then the difference that two
    samples do not exceed in 95 % of cases.

    Raises ValueError when the specimen cannot be simulated from this start.
    """
    question = member(Question, question)
    if scene.target is not None:
        from .refinement import refine_to_end  # noqa: PLC0415 - most scenes have no target

        return refine_to_end(scene)
    method, motion = _plan(scene)
    if method is Method.CLOSED_FORM:
        return solve_closed_form(scene, motion, question)
    begun = _StartedScene(scene, method, motion, question)
    if begun.course.way is not None:
        begun.course.way.follow()
    chaos = begun.course.watch()
    if chaos is not None:
        chaos.follow()
    seen = take_steps(begun.run, begun.course.observe())
    exponent = begun.exponent(seen)
    if exponent is not None:
        exponent.course.follow()
    return begun.answer(seen, exponent, one_by_one)


def settle_scene(scene: Scene) -> ScenePrediction:
    """Solve a scene as planned, without error estimates and without other starts.

    The motion is the same as in `solve_scene`, at a third of the computing time or less. Chaos is integrated
    as long as the scene's duration allows. With an automatic duration the run ends after whole drive periods.

    Raises ValueError when the specimen cannot be simulated from this start.
    """
    return solve_scene(scene, Question.MOTION)


MOST_HELD = 2e7
"""Approximate number of states that a group of scenes may store at once: one gigabyte."""


@dataclass(frozen=True, eq=False)
class SolvedScene:
    """Result of one of several scenes that were solved together."""

    prediction: ScenePrediction
    taken_s: float
    """Processor time of this thread for the scene [s], including the scene's share of batches. NaN if modules
    were loaded in this time."""


def solve_scenes(scenes: Sequence[Scene], question: Question = Question.ANSWER) -> list[SolvedScene]:
    """Solve several scenes as `solve_scene` does, in batches.

    The result of a scene does not depend on the other scenes. In chaos, `solve_scene` gives a different
    random sample. Raises ValueError when a scene cannot be simulated from its start.
    """
    found: list[SolvedScene] = []
    together: list[Scene] = []
    held = 0.0
    for scene in scenes:
        states = REMEMBERED * scene.duration.longest_s / FEWEST_TIMES * scene.drive.frequency_hz
        if together and held + states > MOST_HELD:
            found += _solve_together(together, question)
            together, held = [], 0.0
        together.append(scene)
        held += states
    return found + _solve_together(together, question)


def _solve_together(scenes: Sequence[Scene], question: Question) -> list[SolvedScene]:
    answers: dict[int, ScenePrediction] = {}
    begun: dict[int, _StartedScene] = {}
    taken_s = [0.0] * len(scenes)
    for place, scene in enumerate(scenes):
        with _count_time(taken_s, [place]):
            method, motion = _plan(scene)
            if method is Method.CLOSED_FORM:
                answers[place] = solve_closed_form(scene, motion, question)
            else:
                begun[place] = _StartedScene(scene, method, motion, question)
    ways = {place: each.course.way for place, each in begun.items() if each.course.way is not None}
    with _count_time(taken_s, ways):
        in_batches([*ways.values()])
    chaos = {}
    for place, each in begun.items():
        with _count_time(taken_s, [place]):
            followed_on = each.course.watch()
        if followed_on is not None:
            chaos[place] = followed_on
    with _count_time(taken_s, chaos):
        in_batches([*chaos.values()])
    with _count_time(taken_s, begun):
        steps = [each.course.observe() for each in begun.values()]
        found = take_steps_of_all([each.run for each in begun.values()], steps, are_batched=True)
    exponents = {
        place: exponent
        for (place, each), seen in zip(begun.items(), found, strict=True)
        if (exponent := each.exponent(seen)) is not None
    }
    if exponents:
        from ..exponents.tangent_run import follow_courses  # noqa: PLC0415 - as above

        with _count_time(taken_s, exponents):
            follow_courses([each.course for each in exponents.values()])
    for (place, each), seen in zip(begun.items(), found, strict=True):
        with _count_time(taken_s, [place]):
            answers[place] = each.answer(seen, exponents.get(place), in_batches)
    return [SolvedScene(answers[place], taken_s[place]) for place in range(len(scenes))]


@contextmanager
def _count_time(taken_s: list[float], places: Collection[int]) -> Iterator[None]:
    """Divide the processor time of the `with` block equally among scenes; add the shares to ``taken_s``."""
    began_s = time.thread_time()
    yield
    part_s = (time.thread_time() - began_s) / max(1, len(places))
    for place in places:
        taken_s[place] += part_s


def solve_ensemble(
    scene: Scene, starts: int = FEWEST, seed: int = SEED, budget_s: float = math.inf
) -> Ensemble | None:
    """Solve a scene from several starts that differ by a millionth of the gap.

    `solve_scene` does this with few starts if the motion depends sensitively on the start. More starts give
    narrower confidence intervals; another seed gives another random sample. Raises ValueError for fewer than
    4 starts, or when the specimen cannot be simulated.

    Parameters
    ----------
    scene
        Scene whose start is the first of the starts.
    starts
        Number of starts including the scene's own, at least 4.
    seed
        Seed of the random differences between the starts.
    budget_s
        Limit of the nominal processor time for all starts, as in `Scene` [s]; infinite for no limit.

    Returns
    -------
    Motions from all starts. None if the motion has a closed form, its run failed or the budget is too small.
    """
    if starts < TOO_FEW:
        msg = f"An ensemble of {starts} starts is not allowed: give {TOO_FEW} or more."
        raise ValueError(msg)
    method, motion = _plan(scene)
    if method is Method.CLOSED_FORM:
        return None
    begun = _StartedScene(scene, method, motion, Question.ANSWER)
    one_by_one([begun.course.way] if begun.course.way is not None else [])
    chaos = begun.course.watch()
    one_by_one([chaos] if chaos is not None else [])
    seen = take_steps(begun.run, begun.course.observe())
    if begun.run.outcome is not Outcome.REACHED_END:
        return None
    errors = begun.errors(seen, one_by_one)
    follow = in_batches if batches_are_worth_it(starts, scene.duration) else one_by_one
    return begun.ensemble(seen, errors, follow, Draw(starts, starts, starts, seed, budget_s))


def _plan(scene: Scene) -> tuple[Method, LinearMotion]:
    motion = linear_motion(scene.specimen, scene.drive, scene.start.state)
    return plan_of(scene, motion).method, motion


def solve_closed_form(scene: Scene, motion: LinearMotion, question: Question) -> ScenePrediction:
    """Return the prediction for a scene without contact, from the exact linear solution."""
    amplitude, period_s = scene.drive.amplitude_m, 1.0 / scene.drive.frequency_hz
    settled_s: float | None = None
    match scene.duration:
        case FixedDuration(duration_s=duration_s, window_s=window_s):
            ended = f"the {duration_s:g} s requested have passed"
        case AutomaticDuration():
            settled_s, window_s = motion.decay_time_s(DECAYED_SHARE), period_s
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
        final_state=state_of(motion.state(duration_s)),
        outcome=Outcome.REACHED_END,
        method=Method.CLOSED_FORM,
        accuracy=scene.accuracy.value,
        memory=StartMemory.KEPT,
    )
    found = with_errors(found, np.full(4, motion.transient_share(duration_s - window_s) + ROUNDING))
    if Observable.POINCARE in scene.observe:
        periods = whole_periods(duration_s, scene.drive.frequency_hz)
        count = whole_periods(window_s, scene.drive.frequency_hz)
        found = replace(found, section=np.tile(motion.state(periods * period_s), (count, 1)))
    if Observable.SPECTRUM in scene.observe:
        found = replace(found, spectrum_hz=np.array([scene.drive.frequency_hz]), spectrum=np.array([x]))
    if question is Question.MOTION:
        # Like an integrated motion, end after a whole number of drive periods.
        duration_s = math.ceil(duration_s * scene.drive.frequency_hz) / scene.drive.frequency_hz
        found = replace(found, duration_s=duration_s, final_state=state_of(motion.state(duration_s)))
    return found


class _StartedScene:
    """Scene whose motion is integrated in time, and the evaluation of this motion.

    Parameters
    ----------
    scene, question
        Scene, and extent of the solution.
    method, motion
        Method from the plan, and the linear motion, which is valid until a stop is touched.
    """

    def __init__(self, scene: Scene, method: Method, motion: LinearMotion, question: Question) -> None:
        self._scene, self._method, self._motion, self._question = scene, method, motion, question
        self._begin = FollowedRun(scene.specimen, scene.drive, scene.accuracy.tolerance, scene.start.state)
        self.run = self._begin.copy()
        self._pace = pace = pace_of(
            scene.specimen,
            scene.drive.frequency_hz,
            scene.accuracy,
            motion.slowest_rate,
            scene.duration.longest_s,
        )
        self.course: FixedCourse | SettlingCourse
        match scene.duration:
            case FixedDuration():
                self.course = FixedCourse(self.run, pace, scene.duration)
            case AutomaticDuration(window_s=window_s, longest_s=longest_s):
                is_answer = question is Question.ANSWER
                self.course = SettlingCourse(
                    self.run,
                    pace,
                    window_s,
                    min(longest_s, MOST_STATES / scene.drive.frequency_hz),
                    # In chaos, this start uses only a part of the budget; other starts use the rest.
                    alone_s=ALONE * scene.budget_s if is_answer else math.inf,
                    by_itself_s=math.inf if is_answer else 0.0,
                )

    def exponent(self, seen: SceneRun) -> "ExponentRun | None":
        """Return the run for the largest Lyapunov exponent; None if not requested or if no run is needed."""
        run, drive, scene = self.run, self._scene.drive, self._scene
        is_over = seen.steady is not None or run.outcome is not Outcome.REACHED_END
        if is_over or Observable.LYAPUNOV not in scene.observe:
            return None
        from ..exponents.lyapunov import ExponentRun, Precision  # noqa: PLC0415 - most scenes ask for none

        turns = math.fmod(drive.frequency_hz * run.time_s, 1.0)
        phase = math.fmod(2.0 * math.pi * turns + drive.phase_rad, 2.0 * math.pi)
        return ExponentRun(
            *(scene.specimen, replace(drive, phase_rad=phase), scene.accuracy, EXPONENT_S, 0.0, run.motion),
            precision=Precision(*EXPONENT_PRECISION),
        )

    def answer(self, seen: SceneRun, exponent: "ExponentRun | None", follow: Follow) -> ScenePrediction:
        """Return the prediction for the observed and integrated runs; ``follow`` integrates other starts."""
        scene = self._scene
        found = None if exponent is None else exponent.estimate()
        if self._question is Question.MOTION:
            return self._prediction(seen, UNKNOWN_ERRORS, StartMemory.UNKNOWN, None, found)
        is_whole = self.run.outcome is Outcome.REACHED_END
        errors = self.errors(seen, follow) if is_whole else UNKNOWN_ERRORS
        memory = memory_of(scene, self._begin, seen, self._motion)
        ensemble: Ensemble | None = None
        if is_whole and (memory is StartMemory.LOST or Observable.SCATTER in scene.observe):
            ensemble = self.ensemble(seen, errors, follow)
        return self._prediction(seen, errors, memory, ensemble, found)

    def errors(self, seen: SceneRun, follow: Follow) -> StatedErrors:
        """Return the errors of the scene's responses; the run must have reached its end."""
        rate = self._motion.slowest_rate
        return stated_errors(self._scene, self._begin, self.run, seen, self._pace, rate, follow)

    def ensemble(
        self, seen: SceneRun, errors: StatedErrors, follow: Follow, draw: Draw | None = None
    ) -> Ensemble | None:
        """Return the motions from as many other starts as the budget or ``draw`` allows; None if too few."""
        scene, pace = self._scene, self._pace
        requested = ReachedMotion(
            self.run,
            seen.motion,
            None if seen.repeats is None else seen.repeats.period,
            seen.window.responses_m,
            _between_windows(seen),
            seen.wandered_until_s,
            growth_of(seen.path),
        )
        if draw is None and Observable.SCATTER in scene.observe:
            draw = Draw(clear=FEWEST)
        elif draw is None:
            draw = Draw(budget_s=max(scene.budget_s - self.run.cost_s, ALONE * scene.budget_s))
        several = SeveralStarts(scene, self._begin, requested, pace, draw, follow)
        several.follow()

        def error_of(reached: ReachedMotion) -> float | None:
            if reached is requested:
                return finite_or_none(float(np.max(errors.stated)))
            if reached.period is None:
                return None if reached.scatter is None else reached.scatter.between_runs
            steady = stable_motion(reached.run, reached.period)
            off = settled_errors(reached.run, reached.responses_m, scene.accuracy, steady)
            return finite_or_none(SAFETY * float(np.max(off)) + pace.sharpness.tolerance + ROUNDING)

        if len(several.motions) == 1:
            return None
        return ensemble_of(several, scene.drive.amplitude_m, pace.forgetting_s, error_of)

    def _prediction(
        self,
        seen: SceneRun,
        errors: StatedErrors,
        memory: StartMemory,
        ensemble: Ensemble | None,
        exponent: "LyapunovEstimate | None",
    ) -> ScenePrediction:
        """Return the prediction from the motion observed in the window."""
        scene, run, window, amplitude = self._scene, self.run, seen.window, self._scene.drive.amplitude_m
        is_whole = run.outcome is Outcome.REACHED_END
        drawn = _between_windows(seen) if is_whole and self._question is Question.ANSWER else None
        scatter = None if drawn is None else drawn.relative
        rate = rate_error = None
        if exponent is not None:
            rate, rate_error = map(finite_or_none, (exponent.exponent_per_s, exponent.standard_error_per_s))
        elif seen.steady is not None and Observable.LYAPUNOV in scene.observe:
            rates = seen.steady.exponents_per_s
            rate, rate_error = float(rates.mean()), float(0.5 * np.ptp(rates))
        if Observable.SCATTER in scene.observe:
            scatter = None if ensemble is None else ensemble.scatter
        found = ScenePrediction(
            frequency_hz=scene.drive.frequency_hz,
            amplitude_m=amplitude,
            response_i=window.largest_x_m / amplitude if is_whole else None,
            response_ii=abs(window.line_x_m) / amplitude if is_whole else None,
            relative_i=window.largest_p_m / amplitude if is_whole else None,
            relative_ii=abs(window.line_p_m) / amplitude if is_whole else None,
            impacts=window.impacts,
            impact_rate_hz=window.impacts / window.length_s if window.length_s > 0.0 else 0.0,
            motion=_final_kind(scene, seen, ensemble),
            period=None if seen.repeats is None else seen.repeats.period,
            duration_s=run.time_s,
            window_s=window.length_s,
            settled_s=seen.settled_s,
            ended=_ending(seen, ensemble),
            integration_error=finite_or_none(errors.integration),
            scatter=scatter,
            lyapunov_per_s=rate,
            lyapunov_error_per_s=rate_error,
            start=scene.start.name,
            final_state=state_of(run.motion),
            outcome=run.outcome,
            method=self._method,
            accuracy=scene.accuracy.value,
            memory=memory,
            ensemble=ensemble if memory is StartMemory.LOST else None,
        )
        found = with_errors(found if exponent is None else _confirm_chaos(found, exponent), errors.stated)
        if is_whole and Observable.POINCARE in scene.observe:
            found = replace(found, section=states_of(window.stretches))
        if is_whole and Observable.SPECTRUM in scene.observe:
            lines = spectrum_of(window)
            found = replace(found, spectrum_hz=lines.frequency_hz, spectrum=lines.amplitude_m / amplitude)
        return found


def _between_windows(seen: SceneRun) -> WindowScatter | None:
    """Return the scatter of Response I between windows, from blocks; None for a periodic motion."""
    if seen.motion is MotionKind.PERIODIC:
        return None
    return window_scatter([block.peak_x_m for block in seen.blocks], len(seen.window.blocks))


def _final_kind(scene: Scene, seen: SceneRun, ensemble: Ensemble | None) -> MotionKind:
    """Return the motion's kind; with an automatic duration, only chaos proved to last is "chaotic"."""
    escape = None if ensemble is None else ensemble.escape
    match scene.duration:
        case FixedDuration() if escape is None or escape.escapes == 0:
            return seen.motion
        case _:
            return lasting(seen.motion, escape)


def _confirm_chaos(found: ScenePrediction, exponent: "LyapunovEstimate") -> ScenePrediction:
    """Return the prediction; correct the motion kind "chaotic" if the exponent is not positive."""
    from ..exponents.lyapunov import ExponentVerdict  # noqa: PLC0415 - as above

    is_chaotic = found.motion in {MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR}
    if not is_chaotic or exponent.verdict is ExponentVerdict.CHAOTIC:
        return found
    if exponent.verdict is not ExponentVerdict.REGULAR:
        return replace(
            found,
            motion=MotionKind.UNDECIDED,
            ended="perturbations grew, but the exponent is zero within its error",
        )
    chaos = exponent.transient
    return replace(
        found,
        motion=MotionKind.CHAOTIC_SO_FAR,
        ended=f"chaos ended {exponent.since_s:.3g} s after the window",
        lyapunov_per_s=None if chaos is None else chaos.exponent_per_s,
        lyapunov_error_per_s=None if chaos is None else chaos.standard_error_per_s,
    )


def _ending(seen: SceneRun, ensemble: Ensemble | None) -> str:
    if seen.motion is MotionKind.CHAOTIC and ensemble is not None and ensemble.escape is not None:
        return f"{seen.ended} (mean lifetime above {ensemble.escape.lifetime_above_s:.3g} s)"
    return seen.ended
