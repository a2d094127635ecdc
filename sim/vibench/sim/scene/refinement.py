"""Solve a scene to a target error or within a requested time. SI units.

Results with ever smaller error estimates are computed until the target is met. Methods, in order of rising
cost: a closed form; Newton's iteration for a periodic motion that the run approaches; responses in a stated
window, checked by a stricter run; with sensitive dependence on the start, their mean over several starts.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..engine.batch import batches_pay, is_batchable
from ..engine.run import Accuracy, Outcome, Watch
from ..specimen.modes import modal_form
from ..specimen.specimen import Floats
from .course import TOLERANCE as TIGHT, stable_motion
from .followed_run import (
    FollowedRun,
    ObservedWindow,
    Stretch,
    follow_together,
    follow_with_section,
    states_of,
    whole_periods,
    window_of,
)
from .mean_of_starts import (
    ALIKE,
    FEWEST_STARTS,
    Start,
    error_of,
    next_size,
    others_of,
    time_factor,
    windows_of,
)
from .plan import LinearMotion, linear_motion, never_touches, plan_of
from .prediction import Method, MotionKind, ScenePrediction, StartMemory, TargetReport, state_of
from .repetition import MOST_PERIODS, Pace, Repetition, Sharpness, growth_of, kind_of, pace_of
from .scatter import COVERED
from .scene import PAPER_DURATION_S, Observable, Scene, Target
from .several_starts import LEAST_SIZE, PARTED, SEED, pushes
from .shares import student_quantile
from .solve import Question, solve_closed_form
from .stated_error import ROUNDED, ROUNDING, SAFETY, SIDES, error_per_period, with_errors

LONGEST_S, OUT_OF_REACH_S = 60.0, 1e6
"""Default limit of the computing time, and expected time above which an error is out of reach [s]."""
HOPELESS_S = 2.0
"""Computing time if no time is requested and the target error takes longer than the default limit [s]."""
FIRST_S, GRACE_S = 0.1, 0.05
"""Time until a first result is due, and nominal cost that this result may use after the time limit [s]."""
PART_S, MOST_PART_S = 4e-3, 30e-3
"""Nominal computing cost, and largest processor time, between two checks of the time limit [s]."""
BATCH_PARTS, MOST_TOGETHER = 8, 64
"""Nominal cost between two checks of a batch, relative to a single motion; largest number of motions."""
LANES = 8
"""Number of motions that a batch integrates at the same time."""
FIT_S = 0.03
"""Nominal computing cost of the collision fit for batches [s]."""
FIRST_CYCLES = 1e4
"""Largest number of cycles of the fastest mode before the first check of the time limit."""
CLOSE = 1e-2
"""Relative change of the state from one period to the next below which Newton's iteration is tried."""
KNOWN = 0.03
"""Relative distance from a known periodic motion, below which a run may be approaching that motion."""
MOST_PUSH = 1000.0
"""Changes of the start are proportional to the gap, or to this many drive amplitudes if that is less."""
LOOK_S, LOOK_PERIODS, LOOK_SHARE = 0.1, 4, 0.2
"""Interval between checks of the motion: at least LOOK_PERIODS drive periods. At first, the interval is the
time so far, up to LOOK_S [s]; later, LOOK_SHARE of the time so far."""
LOOKS = 8
"""Number of checks of a run from another start, before its window begins."""
LOOSE, TIGHTEST = Accuracy.QUICK.tolerance, 1e-12
SAME = 1e-3
"""Largest relative change of the state after a period for a motion that repeats."""
FIRST_STARTS, MOST_STARTS = 6, 1_000_000
NEWTON_COST, NEWTON_SHARE = 100.0, 0.3
"""Computing time of Newton's iteration, relative to one period of motion; largest share of the remaining time
that the iteration may use."""


class _Clock:
    """Clock that checks the time limit, and adds requested and reached error and time to a prediction."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._began_s = time.monotonic()
        self.limit_s = LONGEST_S if target.time_s is None else target.time_s

    @property
    def time_s(self) -> float:
        return time.monotonic() - self._began_s

    @property
    def is_over(self) -> bool:
        return self.time_s > self.limit_s

    def report(
        self,
        found: ScenePrediction,
        starts: int = 1,
        needed: tuple[float, float, float] | None = None,
        windows: int = 1,
        *,
        is_final: bool = False,
    ) -> ScenePrediction:
        """Return the prediction, with requested and reached error and time.

        ``is_final`` is True if more time does not reduce the error.
        """
        error, target = found.error_estimate, self._target
        is_met = error is not None and (target.error is None or error <= target.error)
        may_reach = is_met or not (is_final if needed is None else needed[1] > OUT_OF_REACH_S)
        wanted, taken_s = (target.error, target.time_s), self.time_s
        report = TargetReport(*wanted, error, taken_s, starts, windows, is_met, needed, may_reach)
        return replace(found, target=report)


@dataclass(frozen=True, eq=False)
class _Orbit:
    """Stable periodic motion found in a scene, with its responses."""

    period: int
    run: FollowedRun
    """Run whose current state is on the periodic motion."""
    section: Floats
    """States of the motion once per drive period, shape (period, 6)."""
    responses_m: Floats
    """Responses I and II of x, then of p, shape (4,) [m]."""
    errors: Floats
    """Relative errors of the four responses, shape (4,)."""
    impacts: int


@dataclass(eq=False)
class _Path:
    """A run from one start, with the periodic motion that the run may approach."""

    run: FollowedRun
    recent: Floats
    """Recent states of the run, once per drive period, shape (n, 6)."""
    orbit: _Orbit | None = None
    is_settled: bool = False
    """Whether the run certainly approaches the periodic motion."""
    distance: float = math.inf
    """Relative distance of the run, at the last check, from the periodic motion that it may approach."""
    closest: float = CLOSE
    """Relative change of the state per period below which Newton's iteration is tried next."""


def refine_scene(scene: Scene) -> Iterator[ScenePrediction]:
    """Yield results of a scene with a target, each better than the one before.

    Without a requested time, refining ends after a minute, or after two seconds if the target error certainly
    takes longer than a minute. Raises ValueError when the scene has no target, the specimen cannot be
    simulated, or the requested time is too short for one drive period.
    """
    if scene.target is None:
        msg = "A scene without a target cannot be refined: give it Target(error=...) or Target(time_s=...)."
        raise ValueError(msg)
    clock = _Clock(scene.target)
    motion = linear_motion(scene.specimen, scene.drive, scene.start.state)
    if plan_of(scene, motion).method is Method.CLOSED_FORM:
        yield clock.report(solve_closed_form(scene, motion, Question.ANSWER), is_final=True)
        return
    yield from _Refinement(scene, motion, clock).answers()


def uncertainty_of_time(samples: int) -> float:
    """Return the relative uncertainty (two standard deviations) of the time for a mean's target error."""
    # A standard deviation from n samples is uncertain by 1 / sqrt(2 n). The time grows with the square.
    return min(0.9, 2.0 * 2.0 / math.sqrt(2.0 * samples))


def takes_too_long(report: TargetReport) -> bool:
    """Return whether an error requested without a time certainly takes longer than the default limit."""
    return report.wanted_time_s is None and report.needed_s is not None and report.needed_s[1] > LONGEST_S


def refine_to_end(scene: Scene) -> ScenePrediction:
    """Return the last result of `refine_scene`."""
    *_, last = refine_scene(scene)
    return last


class _Refinement:
    """Refinement of a scene whose motion is integrated in time."""

    def __init__(self, scene: Scene, motion: LinearMotion, clock: _Clock) -> None:
        assert scene.target is not None
        self._scene, self._target, self._motion, self._clock = scene, scene.target, motion, clock
        self._method = plan_of(scene, motion).method
        self._frequency_hz = frequency_hz = scene.drive.frequency_hz
        longest_s = scene.duration.longest_s
        self._pace: Pace = pace_of(
            scene.specimen, frequency_hz, Accuracy.QUICK, motion.slowest_rate, longest_s
        )
        fastest = float(np.abs(modal_form(scene.specimen).rates).max(initial=0.0))
        self._part_s = min(1.0 / frequency_hz, FIRST_CYCLES / max(fastest, frequency_hz))
        self._begin = FollowedRun(scene.specimen, scene.drive, LOOSE, scene.start.state)
        self._pushes = self._random_changes(1)
        # Only an undamped motion never settles; it needs a twin with a strict tolerance.
        strict = TIGHT if motion.slowest_rate >= 0.0 else Accuracy.STANDARD.tolerance
        self._main, self._twin = self._begin.copy(), self._begin.copy(strict).with_push(self._pushes[0])
        self._scales = np.repeat([1.0, 2.0 * math.pi * frequency_hz], 3)
        self._window_periods = max(1, whole_periods(scene.duration.window_s, frequency_hz))
        self._due_s = min(FIRST_S, clock.limit_s)
        self._pair = self._main.copy(), self._twin.copy()
        """Copies of the run and of the stricter companion run, made at the last check of the two runs."""
        self._nearly = replace(self._pace, sharpness=Sharpness(ALIKE, self._pace.sharpness.noise))
        self._orbits: list[_Orbit] = []
        """All periodic motions found in this scene so far."""
        self._size_m = self._spent_s = 0.0
        self._run_error: float | None = None
        """Relative integration error of the responses of each start; None if not yet measured."""
        self._kind: MotionKind | None = None
        """Kind of the motion from the first start if this motion does not repeat; None if not yet known."""
        self._has_answered = False
        self._path = _Path(self._main, np.empty((0, 6)))
        self._kept = max(4 * MOST_PERIODS, 2 * math.ceil(self._pace.forgetting_periods) + MOST_PERIODS)
        """Number of latest states, one per drive period, that are stored."""
        self._first_section = np.empty((0, 6))
        """States of the first of several starts, once per drive period of this start's first window."""
        self._is_batched = False
        """Whether further starts are integrated in SIMD batches."""

    def answers(self) -> Iterator[ScenePrediction]:
        """Yield ever better results; raise ValueError if the time was too short for any result."""
        for found in self._all():
            self._has_answered = True
            yield found
        if not self._has_answered:
            msg = (
                f"A time of {self._clock.limit_s:g} s is not allowed for this scene: one drive period of "
                f"{1.0 / self._frequency_hz:g} s takes longer to compute; give more time."
            )
            raise ValueError(msg)

    def _all(self) -> Iterator[ScenePrediction]:
        settle_s = math.ceil(self._settle_s * self._frequency_hz) / self._frequency_hz
        while self._main.time_s < settle_s:
            look_s = min(self._next_look_s(self._main), settle_s)
            ours, other = self._follow_parts(self._main, look_s), self._follow_parts(self._twin, look_s)
            if self._is_lost:
                yield self._lost_result()
                return
            if ours is None or other is None:
                yield from self._interim()
                return
            self._pair = self._main.copy(), self._twin.copy()
            if self._have_parted(ours, other):
                yield from self._many_starts()
                return
            if self._approaches(self._path, ours):
                yield self._on_orbit()
                return
            if self._clock.time_s > self._due_s and not self._has_answered:
                yield from self._interim()
        yield from self._one_start()

    def _next_look_s(self, run: FollowedRun) -> float:
        made = round(run.time_s * self._frequency_hz)
        look = max(LOOK_PERIODS, LOOK_SHARE * made, min(LOOK_S * self._frequency_hz, made))
        return (made + math.ceil(look)) / self._frequency_hz

    def _random_changes(self, count: int) -> Floats:
        """Return random changes of the initial state, shape (count, 6), far smaller than the motion."""
        drawn = pushes(self._scene.specimen, self._scene.drive, count, SEED)
        gap_m, most_m = min(self._scene.specimen.gaps_m), MOST_PUSH * self._scene.drive.amplitude_m
        return np.asarray(drawn * (most_m / gap_m if most_m < gap_m < math.inf else 1.0))

    @property
    def _settle_s(self) -> float:
        """Simulated time after which a motion that does not repeat is observed [s]."""
        longest_s = self._scene.duration.longest_s
        if self._motion.slowest_rate >= 0.0:
            longest_s = min(longest_s, PAPER_DURATION_S)
        window_s = self._window_periods / self._frequency_hz
        return max(1.0 / self._frequency_hz, min(self._pace.settling_s, longest_s - window_s))

    @property
    def _is_lost(self) -> bool:
        return self._main.outcome is not Outcome.REACHED_END

    def _follow_parts(
        self, run: FollowedRun, until_s: float, watch: Watch = Watch.NOTHING
    ) -> list[Stretch] | None:
        """Integrate a motion in short parts; return the parts, or None after the time limit or a failure."""
        found = self._follow_all([run], until_s, watch)
        return None if found is None else found[0]

    def _follow_all(
        self, runs: Sequence[FollowedRun], until_s: float, watch: Watch = Watch.NOTHING
    ) -> list[list[Stretch]] | None:
        """Integrate several motions to the same time in batches, as `_follow_parts` does for one motion."""
        parts: list[list[Stretch]] = [[] for _ in runs]
        at_once = 1 if len(runs) == 1 else BATCH_PARTS
        while under_way := [place for place, run in enumerate(runs) if run.time_s < until_s]:
            if self._clock.is_over and (self._has_answered or self._spent_s > GRACE_S):
                return None
            cost_s, began_s = sum(run.cost_s for run in runs), time.thread_time()
            length_s = self._part_s * at_once / len(under_way)
            if at_once == 1:
                parts[0].append(follow_with_section(runs[0], min(until_s, runs[0].time_s + length_s), watch))
            else:
                most, group = max(1, int(length_s * self._frequency_hz)), [runs[k] for k in under_way]
                left = [round((until_s - run.time_s) * self._frequency_hz) for run in group]
                seen = follow_together(group, [min(most, each) for each in left], watch)
                for place, part in zip(under_way, seen, strict=True):
                    parts[place].append(part)
            if any(run.outcome is not Outcome.REACHED_END for run in runs):
                return None
            spent_s = max(sum(run.cost_s for run in runs) - cost_s, 1e-9)
            taken_s = time.thread_time() - began_s
            self._spent_s += max(spent_s, taken_s)
            # Set the length by the nominal cost (equal on every machine), unless this is far too low.
            self._part_s *= min(4.0, at_once * PART_S / spent_s, MOST_PART_S / max(taken_s, 1e-9))
        return parts

    def _observe_next(self, run: FollowedRun, periods: int) -> ObservedWindow | None:
        """Return the next ``periods`` drive periods as a window; None after the time limit or a failure."""
        found = self._observe_all([run], periods)
        return None if found is None else found[0]

    def _observe_all(self, runs: Sequence[FollowedRun], periods: int) -> list[ObservedWindow] | None:
        """Return a window for each of several motions at the same time, like `_observe_next`."""
        begins = [run.copy() for run in runs]
        made = round(runs[0].time_s * self._frequency_hz)
        parts = self._follow_all(runs, (made + periods) / self._frequency_hz, Watch.PEAKS_AND_LINES)
        if parts is None:
            return None
        return [window_of(begin, own) for begin, own in zip(begins, parts, strict=True)]

    def _have_parted(self, ours: Sequence[Stretch], other: Sequence[Stretch]) -> bool:
        """Return whether the runs from two starts have separated."""
        mine, theirs = states_of(ours)[:, :3], states_of(other)[:, :3]
        self._size_m = max(self._size_m, float(np.abs(mine).max(initial=0.0)))
        gap_m = min(self._scene.specimen.gaps_m)
        size_m = max(self._size_m, LEAST_SIZE * gap_m if math.isfinite(gap_m) else 0.0)
        return not float(np.abs(mine - theirs).max(initial=0.0)) < PARTED * size_m

    def _approaches(self, path: _Path, seen: Sequence[Stretch]) -> bool:
        """Add new states to a path; return whether the run now approaches a known stable periodic motion."""
        path.recent = recent = np.concatenate([path.recent, states_of(seen)])[-self._kept :]
        if self._motion.slowest_rate >= 0.0 or len(recent) < 2 * LOOK_PERIODS:
            return False
        points = recent / self._scales
        size = float(np.abs(points).max(initial=1e-300))
        changes = np.abs(points[-MOST_PERIODS - 1 : -1] - points[-1]).max(axis=1)[::-1] / size
        near = np.flatnonzero(changes < path.closest)
        now = self._away_from(path.orbit, recent[-1], size)
        if not changes.min() < CLOSE:
            path.closest = CLOSE
        elif len(near) > 0 and not now < path.distance:
            path.closest = 0.3 * float(changes[near[0]])
            known = self._nearest(recent[-1], KNOWN * size)
            # If a run stops approaching a motion, the run may be near another, such as a mirror image.
            is_new = known is not None and known is not path.orbit
            path.orbit = (known if is_new else self._newton(path.run, int(near[0]) + 1)) or path.orbit
            now = self._away_from(path.orbit, recent[-1], size)
        path.distance = now
        if path.orbit is None:
            return False
        lag = path.orbit.period * math.ceil(self._pace.forgetting_periods / path.orbit.period)
        if len(recent) <= lag:
            return False
        before = self._away_from(path.orbit, recent[-1 - lag], size)
        return now < CLOSE and now < max(0.5 * before, 0.03 * CLOSE)

    def _away_from(self, orbit: _Orbit | None, state: Floats, size: float) -> float:
        """Return the distance of a state from a periodic motion, relative to ``size``; inf for no motion."""
        if orbit is None:
            return math.inf
        return float(np.abs((orbit.section - state) / self._scales).max(axis=1).min()) / size

    def _nearest(self, state: Floats, within: float) -> _Orbit | None:
        """Return the known periodic motion nearest to a state; None if none is closer than ``within``."""
        found = min(self._orbits, key=lambda each: self._away_from(each, state, 1.0), default=None)
        return found if self._away_from(found, state, 1.0) < within else None

    def _newton(self, near: FollowedRun, period: int) -> _Orbit | None:
        """Return a stable periodic motion near a run; its period divides ``period`` (in drive periods)."""
        cost_s = NEWTON_COST * near.cost_s / near.time_s * period / self._frequency_hz
        if cost_s > NEWTON_SHARE * max(self._clock.limit_s - self._clock.time_s, GRACE_S):
            return None
        found = stable_motion(near, period)
        if found is None:
            return None
        run, away, strict = found.run, found.away, found.run.copy(TIGHTEST)
        off = (strict.image(period)[0] - strict.motion) / self._scales
        strict = strict.with_push(away @ off * self._scales)
        windows = [self._observe_next(each.copy(), period) for each in (run, strict)]
        if windows[0] is None or windows[1] is None:
            return None
        states = states_of(windows[1].stretches) / self._scales
        same = SAME * float(np.abs(states).max(initial=1e-300))
        for shorter in range(1, period):
            if period % shorter == 0 and np.ptp(states[shorter - 1 :: shorter], axis=0).max() < same:
                return self._newton(near, shorter)
        first, second = windows[0].responses_m, windows[1].responses_m
        # The rounding error at the end of a period is amplified by the inverse matrix of Newton's iteration.
        grown = max(1.0, 1e-3 * float(np.abs(away).sum(axis=1).max()))
        rounding = grown * ROUNDING * np.repeat(second[::2], 2) / second
        errors = SAFETY * np.abs(first - second) / second + rounding
        section = states_of(windows[1].stretches)
        known = self._nearest(section[-1], same)
        if known is None:
            known = _Orbit(period, strict, section, second, errors, windows[1].impacts)
            self._orbits.append(known)
        return known

    def _on_orbit(self) -> ScenePrediction:
        orbit = self._path.orbit
        assert orbit is not None
        period_s = orbit.period / self._frequency_hz
        found = replace(
            self._prediction(orbit.responses_m, orbit.errors, self._main.time_s, period_s, orbit.impacts),
            motion=MotionKind.PERIODIC,
            period=orbit.period,
            settled_s=self._main.time_s,
            ended=f"it repeats after {orbit.period} drive period(s)",
            final_state=state_of(orbit.run.motion),
            memory=StartMemory.KEPT,
            section=self._section(orbit.section),
        )
        return self._clock.report(found, is_final=True)

    def _section(self, states: Floats) -> Floats | None:
        """Return the states once per drive period if a Poincaré section was requested, otherwise None."""
        return states if Observable.POINCARE in self._scene.observe else None

    def _interim(self) -> Iterator[ScenePrediction]:
        """Yield an early result, for a window that begins at the last check of both runs."""
        self._spent_s = 0.0
        run, twin = (each.copy() for each in self._pair)
        periods = min(self._window_periods, max(1, round(run.time_s * self._frequency_hz) // 8))
        windows = [self._observe_next(each, periods) for each in (run, twin)]
        if windows[0] is None or windows[1] is None:
            return
        found = self._in_window(windows[0], windows[1], run, self._remaining_change)
        yield replace(found, memory=StartMemory.UNKNOWN)

    @property
    def _remaining_change(self) -> float:
        """Relative distance of a run from its final motion, estimated from the change in one decay time."""
        points = self._path.recent / self._scales
        lag = min(math.ceil(self._pace.forgetting_periods), len(points) // 2)
        before = points[max(0, len(points) - 1 - lag - MOST_PERIODS) : len(points) - lag]
        if len(before) == 0:
            return 1.0
        size = float(np.abs(points).max(initial=1e-300))
        return SAFETY * float(np.abs(before - points[-1]).max(axis=1).min()) / size

    def _in_window(
        self, window: ObservedWindow, other: ObservedWindow, run: FollowedRun, unsettled: float = 0.0
    ) -> ScenePrediction:
        """Return the result for one start in a stated window, with errors from a stricter run."""
        answer = window.responses_m
        off = np.abs(answer - other.responses_m) / answer
        is_parted = not float(off.max()) < PARTED
        times = 0.5 * student_quantile(1, COVERED) if is_parted else SAFETY
        errors = times * off + ROUNDING * np.repeat(answer[::2], 2) / answer + unsettled
        found = self._prediction(answer, errors, run.time_s, window.length_s, window.impacts)
        found = replace(
            found,
            ended=f"observed from {run.time_s - window.length_s:.4g} to {run.time_s:.4g} s",
            final_state=state_of(run.motion),
            memory=StartMemory.UNKNOWN if is_parted else StartMemory.KEPT,
            integration_error=float(off.max()),
            section=self._section(states_of(window.stretches)),
        )
        return self._clock.report(found, is_final=run.tolerance == TIGHT)

    def _one_start(self) -> Iterator[ScenePrediction]:
        """Yield results for a motion that does not repeat and does not depend sensitively on its start."""
        main, twin, until_s = self._main, self._twin, self._main.time_s
        for tolerance in (TIGHT, TIGHTEST):
            if tolerance == TIGHTEST:
                main = self._begin.copy(TIGHT)
                rounded = ROUNDED * self._scene.drive.amplitude_m * SIDES * self._scales
                twin = self._begin.copy(TIGHTEST).with_push(rounded)
            elif twin.tolerance > TIGHT:
                twin = self._begin.copy(TIGHT).with_push(self._pushes[0])
            are_there = all(self._follow_parts(each, until_s) is not None for each in (main, twin))
            windows = [self._observe_next(each, self._window_periods) for each in (main, twin) if are_there]
            if len(windows) < 2 or windows[0] is None or windows[1] is None:
                if not self._has_answered:
                    yield from self._interim()
                return
            if self._have_parted(windows[0].stretches, windows[1].stretches):
                self._main, self._twin = main, twin
                yield from self._many_starts()
                return
            found = self._in_window(windows[0], windows[1], main)
            yield found
            if found.target is not None and found.target.is_met and self._target.error is not None:
                return

    def _many_starts(self) -> Iterator[ScenePrediction]:
        """Yield mean responses over a growing number of nearly equal starts, in stated windows."""
        lead_s = max(min(self._pace.attractor_s, PAPER_DURATION_S), 1.5 * self._main.time_s)
        begins_s = math.ceil(lead_s * self._frequency_hz) / self._frequency_hz
        each_s = begins_s + self._window_periods / self._frequency_hz
        if self._clock.time_s * (1.0 + each_s / self._main.time_s) > self._due_s and not self._has_answered:
            yield from self._interim()
        starts: list[Start] = []
        self._is_batched = self._needs_batches(starts, each_s)
        wanted, windows = FEWEST_STARTS if self._is_batched else FIRST_STARTS, 1
        while len(starts) < MOST_STARTS:
            is_over = not self._observe_more(starts, wanted, windows, begins_s) or self._clock.is_over
            is_due = not self._has_answered and self._clock.time_s > self._due_s
            is_complete = len(starts) == wanted and windows_of(starts) == windows
            if len(starts) > 1 and (is_complete or is_due or is_over):
                found = self._mean(starts, begins_s)
                yield found
                assert found.target is not None
                is_enough = len(starts) >= FIRST_STARTS and self._target.error is not None
                if is_enough and found.target.is_met:
                    return
                is_over = is_over or (takes_too_long(found.target) and self._clock.time_s > HOPELESS_S)
            if is_over:
                if self._is_lost and not self._has_answered:
                    yield self._lost_result()
                return
            if is_complete:
                self._is_batched = self._is_batched or self._needs_batches(starts, each_s)
                lead = begins_s * self._frequency_hz / self._window_periods
                wanted, windows = next_size(starts, self._target.error, lead)
                if self._is_batched:
                    wanted = LANES * math.ceil(wanted / LANES)

    def _needs_batches(self, starts: Sequence[Start], each_s: float) -> bool:
        """Return whether batches of the missing starts save more time than the collision fit takes.

        ``each_s`` is the simulated time of a start. The decision uses nominal costs, so it is reproducible.
        """
        if not batches_pay() or self._clock.limit_s < 10.0 * FIT_S:
            return False
        missing, error = float(FEWEST_STARTS - len(starts)), self._target.error
        if missing <= 0.0:
            missing = math.inf if error is None else len(starts) * (time_factor(starts, error) - 1.0)
        is_worth_it = missing * each_s * self._main.cost_s / self._main.time_s > FIT_S
        return is_worth_it and is_batchable(self._scene.specimen, LOOSE)

    def _observe_more(self, starts: list[Start], wanted: int, windows: int, begins_s: float) -> bool:
        """Observe one more window or start, or several in a batch; return False after the time limit."""
        most = MOST_TOGETHER if self._is_batched else 1
        behind = [each for each in starts if each.repeats is None and len(each.windows) < windows][:most]
        if not behind:
            return self._observe_starts(starts, min(wanted - len(starts), most), begins_s)
        seen = self._observe_all([each.run for each in behind], self._window_periods)
        for each, window in zip(behind, seen or [], strict=False):
            each.windows.append(window.responses_m)
        return seen is not None

    def _observe_starts(self, starts: list[Start], count: int, begins_s: float) -> bool:
        """Add the next ``count`` starts, with one window each; return False after the time limit."""
        paths = [self._new_path(len(starts) + k) for k in range(count)]
        # In a batch, continuing a settled run takes less time than checking whether it has settled.
        looks = 1 if self._is_batched else LOOKS
        for look in range(1, looks + 1):
            look_s = math.ceil(begins_s * look / looks * self._frequency_hz) / self._frequency_hz
            ahead = [path for path in paths if path.run.time_s < look_s and not path.is_settled]
            seen = self._follow_all([path.run for path in ahead], look_s)
            if seen is None:
                return False
            for path, parts in zip(ahead, seen, strict=True):
                path.is_settled = self._approaches(path, parts)
        moving = [path for path in paths if not path.is_settled]
        windows = self._observe_all([path.run for path in moving], self._window_periods) if moving else []
        if windows is None:
            return False
        left = iter(windows)
        for path in paths:
            if path.is_settled:
                assert path.orbit is not None
                impacts = path.orbit.impacts * self._window_periods // path.orbit.period
                settled, section = Repetition(path.orbit.period, 0.0), path.orbit.section
                found = Start(path.run, [path.orbit.responses_m], settled, impacts)
            else:
                window = next(left)
                section = states_of(window.stretches)
                repeats = self._nearly.repeats(window.stretches)
                found = Start(path.run, [window.responses_m], repeats, window.impacts)
            if not starts:
                self._first_section = section
            starts.append(found)
        return True

    def _new_path(self, number: int) -> _Path:
        """Return the run from start ``number``; start 0 is the requested start."""
        if number == 0:
            return self._path
        if number > len(self._pushes):
            self._pushes = self._random_changes(2 * number)
        return _Path(self._begin.with_push(self._pushes[number - 1]), np.empty((0, 6)))

    def _mean(self, starts: Sequence[Start], begins_s: float) -> ScenePrediction:
        """Return the result with mean responses over all starts and windows so far."""
        windows, window_s = windows_of(starts), self._window_periods / self._frequency_hz
        means = [each.mean(windows) for each in starts]
        responses, mean = np.array(means), np.mean(means, axis=0)
        ends_s = begins_s + windows * window_s
        if self._run_error is None:
            self._run_error = SAFETY * error_per_period(starts[0].run, Accuracy.QUICK)
        errors = error_of(starts) + self._run_error
        found = self._prediction(mean, errors, ends_s, window_s, starts[0].impacts)
        first = starts[0].repeats
        is_settled = first is not None and first.distance < self._pace.sharpness.tolerance
        is_periodic = is_settled and others_of(starts) == 0
        if self._kind is None and first is None:
            self._kind = self._kind_of_others(starts[0].run)
        each_observed = f"observed from {begins_s:.4g} to {ends_s:.4g} s"
        if windows > 1:
            each_observed += f", in {windows} windows of {window_s:.4g} s"
        found = replace(
            found,
            motion=MotionKind.PERIODIC if is_periodic else self._kind or MotionKind.UNDECIDED,
            period=first.period if first is not None and is_periodic else None,
            ended=f"mean of {len(starts)} starts, each {each_observed}",
            final_state=state_of(starts[0].run.motion),
            memory=StartMemory.LOST,
            scatter=float(responses[:, 0].std(ddof=1) / mean[0]),
            section=self._section(self._first_section),
        )
        needed = None
        if self._target.error is not None:
            per_s = self._clock.time_s / sum(each.run.time_s for each in starts)
            lead = begins_s / window_s
            count, more = next_size(starts, self._target.error, lead, math.inf)
            more_s = (count * (lead + more) - len(starts) * (lead + windows)) * window_s
            off = uncertainty_of_time(len(starts) * windows)
            about_s = max(0.0, self._clock.time_s + per_s * more_s)
            needed = about_s, (1.0 - off) * about_s, (1.0 + off) * about_s
        return self._clock.report(found, len(starts), needed, windows)

    def _kind_of_others(self, begin: FollowedRun) -> MotionKind:
        """Return the kind of a motion that does not repeat, from the growth of perturbations in a window."""
        run, seen = begin.copy(), list[Stretch]()
        run.follow_tangent()
        until_s = run.time_s + self._window_periods / self._frequency_hz
        while run.time_s < until_s:
            part = self._follow_parts(run, min(until_s, self._next_look_s(run)))
            if part is None:
                return MotionKind.UNDECIDED
            seen += part
            if self._pace.is_chaos(seen):
                return MotionKind.CHAOTIC_SO_FAR
        found = kind_of(None, growth_of(seen), self._pace.fading_s)
        is_torus = found is MotionKind.QUASI_PERIODIC and not self._pace.drifts(seen)
        return found if is_torus else MotionKind.UNDECIDED

    def _lost_result(self) -> ScenePrediction:
        """Return the result for a motion whose integration failed."""
        run = self._main
        found = self._prediction(np.full(4, math.nan), np.full(4, math.nan), run.time_s, 0.0, 0)
        found = replace(found, ended=run.outcome.text, outcome=run.outcome)
        return self._clock.report(found, 0)

    def _prediction(
        self, responses_m: Floats, errors: Floats, duration_s: float, window_s: float, impacts: int
    ) -> ScenePrediction:
        """Return a prediction with responses and errors; the caller sets the other fields."""
        amplitude_m = self._scene.drive.amplitude_m
        is_free = never_touches(self._scene.specimen, self._motion)
        response_i, response_ii, relative_i, relative_ii = (
            None if math.isnan(each) else float(each) / amplitude_m for each in responses_m
        )
        found = ScenePrediction(
            frequency_hz=self._frequency_hz,
            amplitude_m=amplitude_m,
            response_i=response_i,
            response_ii=response_ii,
            relative_i=relative_i,
            relative_ii=relative_ii,
            impacts=impacts,
            impact_rate_hz=impacts / window_s if window_s > 0.0 else 0.0,
            motion=MotionKind.UNDECIDED,
            duration_s=duration_s,
            window_s=window_s,
            ended="",
            start=self._scene.start.name,
            final_state=state_of(self._main.motion),
            outcome=Outcome.REACHED_END,
            method=self._method,
            accuracy=self._scene.accuracy.value,
            memory=StartMemory.KEPT if is_free else StartMemory.UNKNOWN,
        )
        return with_errors(found, errors)
