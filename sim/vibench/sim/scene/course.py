"""Runs of a scene's motion for a given time (`FixedCourse`) or until it settles (`SettlingCourse`).

Both have three steps, so that many scenes can be batched. `way` returns the motion to integrate first.
`watch` classifies the motion, and returns it if it must go on. `observe` observes the end of the motion.
The caller integrates these motions alone or in batches (`one_by_one`, `in_batches`, `take_steps_of_all`).
SI units.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np

from ..engine.run import Outcome, Watch
from ..periodic.newton import NEUTRAL, newton_iterates
from ..specimen.specimen import Floats
from .followed_run import (
    Block,
    FollowedRun,
    ObservedWindow,
    Steps,
    Stretch,
    blocks_of,
    follow_with_section,
    observe_window,
    samples_between,
    states_of,
    whole_periods,
    window_of,
    window_steps,
)
from .prediction import MotionKind
from .repetition import EXACTLY, Pace, Repetition, first_repetition, growth_of, kind_of
from .scene import FixedDuration
from .states_alone import StatesAlone

TOLERANCE, STRICTER = 1e-10, 0.01
"""Largest integration tolerance of the period map [-, tolerances of the run]."""
RETURNED = 1e-10
"""Largest change of state over one period of a periodic motion, relative to the motion's size."""
ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """Stable periodic motion found near a run."""

    run: FollowedRun
    """Run whose current state is on the periodic motion."""
    away: Floats
    """Inverse of (identity - Jacobian of the period map), scaled, shape (6, 6)."""
    distance: float
    """Distance of the given run from the periodic motion, relative to the size of the motion."""
    period: int
    """Period of the motion [drive periods]."""
    exponents_per_s: Floats
    """Largest Lyapunov exponent, from the multipliers in the last two iterations, shape (2,) [1/s]."""


def stable_motion(near: FollowedRun, period: int) -> FixedPoint | None:
    """Return the stable periodic motion of this period (in drive periods) near a run, or None."""
    try:
        return _fixed_point(near, period)
    except (ValueError, np.linalg.LinAlgError):
        # The iteration left the range of allowed states, or a Floquet multiplier equals 1.
        return None


def _fixed_point(near: FollowedRun, period: int) -> FixedPoint | None:
    run, start, scales = near.copy(min(TOLERANCE, STRICTER * near.tolerance)), near.motion, near.scales
    size, gone, exponents = float(np.abs(start / scales).max(initial=1e-300)), np.inf, np.empty(0)

    def image(state: Floats) -> tuple[Floats, Floats]:
        if state is not start:
            run.place(state)
        return run.image(period)

    for state, off, scaled in islice(newton_iterates(image, start, scales), ITERATIONS):
        if not np.all(np.isfinite(scaled)) or not np.abs(off).max() < max(gone, RETURNED * size):
            return None
        gone = float(np.abs(off).max())
        largest = max(float(np.abs(np.linalg.eigvals(scaled)).max()), 1e-300)
        exponents = np.append(exponents, math.log(largest) * run.drive.frequency_hz / period)[-2:]
        if gone < RETURNED * size and len(exponents) == 2:
            distance = float(np.abs((state - start) / scales).max()) / size
            away = np.asarray(np.linalg.inv(np.eye(6) - scaled))
            return FixedPoint(run, away, distance, period, exponents) if largest < 1.0 - NEUTRAL else None
    return None


@dataclass(frozen=True, eq=False)
class SceneRun:
    """Observed response window of a run, and the kind of the motion."""

    window: ObservedWindow
    blocks: tuple[Block, ...]
    """Peaks and spectral lines of consecutive parts of the motion; the window consists of the last parts."""
    was_settled: bool
    """Whether the motion repeated before the window began."""
    motion: MotionKind
    repeats: Repetition | None
    settled_s: float | None
    """Time at which the motion was found to have settled [s]; None if not checked, or not found."""
    ended: str
    """Reason for the end of the run."""
    path: tuple[Stretch, ...]
    """Stretches of the run, from its start until the motion settled or was proved chaotic."""
    grew: bool
    """Whether a small perturbation grew enough to prove chaos."""
    wandered_until_s: float
    """Last time at which successive periods of the motion still differed [s]."""
    steady: FixedPoint | None = None
    """Periodic motion that the run approaches; None if the motion does not repeat."""
    leaked: Floats = field(default_factory=lambda: np.zeros(4))
    """Relative change of the responses by leakage if spectral lines are computed over the whole window, shape
    (4,). Zero unless the motion was found to repeat only within the window."""


class FixedCourse:
    """A run of a motion for a given time, observed at the end.

    The state is checked once per drive period. A motion that does not repeat after the expected transient is
    described by the growth of perturbations and by statistics. For both, a tangent vector is propagated and
    the peaks of blocks are stored.
    """

    def __init__(self, run: FollowedRun, pace: Pace, duration: FixedDuration) -> None:
        self._run, self._pace, self._duration = run, pace, duration
        self._lead = Lead(run, duration.duration_s - duration.window_s - pace.section_s, pace)

    @property
    def way(self) -> StatesAlone | None:
        """Motion to integrate up to the expected settling time; None if no checks for repetition are made."""
        return self._lead.states

    def watch(self) -> None:
        """Return None: with a fixed duration the motion is not integrated further."""

    def observe(self) -> Steps[SceneRun]:
        """Observe the motion in the window at the end of the run, and classify the motion."""
        run, pace, duration = self._run, self._pace, self._duration
        lead = self._lead.end()
        last = yield duration.duration_s - duration.window_s, Watch.NOTHING
        before = pace.repeats([last])
        if before is None:
            run.follow_tangent()
        is_chaos = pace.is_chaos if before is None else None
        window = yield from window_steps(run, duration.window_s, pace.cycle([last]), is_chaos)
        seen = classify(run, window, [last], pace, f"the {duration.duration_s:g} s requested have passed")
        cycle = pace.cycle([last, *window.stretches])
        if window.line_periods % cycle != 0:
            # The period became known only in the window: to avoid leakage, observe whole periods again.
            begins = window.begins.copy()
            begins.drop_tangent()
            whole = observe_window(begins, duration.window_s, cycle)
            leaked = np.abs(window.responses_m / whole.responses_m - 1.0)
            seen = replace(seen, window=whole, leaked=leaked)
        has_settled = self.way is not None and self.way.repeats is not None
        path = lead if has_settled else (*lead, last, *window.stretches)
        # The run did not determine the time at which the motion settled.
        return replace(seen, was_settled=before is not None, path=path, wandered_until_s=0.0)


def classify(
    run: FollowedRun,
    window: ObservedWindow,
    before: Sequence[Stretch],
    pace: Pace,
    ended: str,
    repeats: Repetition | None = None,
) -> SceneRun:
    """Classify a motion from its response window and the stretches of the run before the window.

    The stretches before the window are as long as the blocks of the window. A motion that repeats counts as
    periodic only if Newton's iteration finds a stable periodic motion nearby. Chaos also comes close to
    unstable periodic motions, and lingers where a periodic motion has just vanished in a fold.
    """
    stretches = [*before, *window.stretches]
    repeats, growth = repeats or pace.repeats(stretches), growth_of(stretches)
    motion, found = kind_of(repeats, growth, pace.fading_s), None
    if run.outcome is not Outcome.REACHED_END:
        motion, repeats, ended = MotionKind.UNDECIDED, None, run.outcome.text
    elif repeats is not None:
        found = stable_motion(run, repeats.period)
        if found is None:
            ended = f"it repeats after {repeats.period} drive period(s), but no stable motion is near"
            motion, repeats = MotionKind.UNDECIDED, None
        else:
            repeats = replace(repeats, distance=found.distance)
    elif motion is MotionKind.QUASI_PERIODIC and any(map(pace.drifts, (stretches, window.stretches))):
        motion, ended = MotionKind.UNDECIDED, f"after {run.time_s:.3g} s it still drifts"
    return SceneRun(
        window=window,
        blocks=(*blocks_of(before), *window.blocks),
        was_settled=False,
        motion=motion,
        repeats=repeats,
        settled_s=None,
        ended=ended,
        path=tuple(stretches),
        grew=growth.is_certain and repeats is None,
        wandered_until_s=run.time_s if repeats is None else stretches[0].start_s,
        steady=found,
    )


MOST_LOOKS = 4096
"""Largest number of states stored before the window; enough to detect diverging neighbouring motions."""
LOOKS = 16
"""Smallest number of checks for repetition before the window."""
LONGEST_SLICE = 1 << 16
"""Largest number of drive periods between two checks for repetition, limited to save memory for states."""


class Lead:
    """Part of a run before its window, with some of its states.

    Once the motion repeats to rounding error, the remaining whole periods are skipped. Periods cannot be
    skipped if contacts are integrated in time steps.
    """

    def __init__(self, run: FollowedRun, until_s: float, pace: Pace) -> None:
        self._run, self._until_s, self._frequency_hz = run, max(until_s, run.time_s), pace.frequency_hz
        periods = whole_periods(self._until_s, pace.frequency_hz)
        self._every = every = max(1, math.ceil(periods / MOST_LOOKS))
        self.states: StatesAlone | None = None
        """Motion to integrate with checks for repetition; None if no checks are made."""
        if pace.sharpness.noise < EXACTLY:
            exact = replace(pace, sharpness=replace(pace.sharpness, tolerance=EXACTLY))
            slice_periods = min(max(1, math.ceil(periods / LOOKS)), LONGEST_SLICE)
            way_s = math.ceil(pace.attractor_s * pace.frequency_hz) / pace.frequency_hz
            states = StatesAlone(run, exact, slice_periods=slice_periods, every=every, by_itself_s=way_s)
            self.states = states.aim(self._until_s)

    def end(self) -> tuple[Stretch, ...]:
        """Integrate to the end of the part before the window, and return the stretches of this part."""
        run, states = self._run, self.states
        if states is None:
            rate_hz = self._frequency_hz / self._every
            samples = samples_between(rate_hz, run.time_s, self._until_s)
            return (run.follow(self._until_s, samples=samples),)
        if states.repeats is not None:
            left = (self._until_s - run.time_s) * self._frequency_hz
            cycle = states.repeats.period
            run.pass_over(int(left / cycle) * cycle / self._frequency_hz)
        return tuple(states.path)


SLICE_S, SLICE_PERIODS = 0.25, 4
"""Shortest interval between two checks for repetition [s; drive periods]; at most one window."""
WINDOWS = 2
"""Number of windows in which a non-repeating motion is observed; the last window gives the responses."""
DRIFT_SHARE = 0.25
"""Share of the budget for integrating a slow drift; the error estimate takes three times as long."""


class SettlingCourse:
    """A run until the motion repeats or is certain never to repeat; then the motion is observed.

    A repeating motion is observed over one of its periods, any other motion over a window. Because chaos may
    end, a chaotic motion is integrated further, without a tangent vector, as far as a budget allows.

    Parameters
    ----------
    run, pace
        The motion, and its time scales and tolerances.
    window_s
        Length of the window for a non-repeating motion [s]; rounded to equal parts of whole drive periods.
    longest_s
        Longest simulated time [s], at least a window; a motion that is still unclear counts as undecided.
    alone_s
        Nominal computing cost for integrating chaos further [s]; zero for no further integration.
    by_itself_s
        Time after which the motion may join a batch [s]; see `StatesAlone`.
    """

    def __init__(
        self,
        run: FollowedRun,
        pace: Pace,
        window_s: float,
        longest_s: float,
        alone_s: float,
        by_itself_s: float,
    ) -> None:
        self._run, self._pace, self._longest_s, self._alone_s = run, pace, longest_s, alone_s
        self._slice_periods, self._in_window = _slices(window_s, pace.frequency_hz)
        watched_after_s = min(pace.attractor_s, longest_s - self._window_s)
        slices = max(0, math.ceil(watched_after_s * pace.frequency_hz / self._slice_periods))
        self._made = slices * self._slice_periods
        self.way = StatesAlone(
            run, pace, slice_periods=self._slice_periods, every=1, by_itself_s=by_itself_s
        ).aim(self._made / pace.frequency_hz)
        self._path, self._watched = list[Stretch](), 0
        self._on: StatesAlone | None = None
        self._seen: SceneRun | None = None

    @property
    def _window_s(self) -> float:
        return self._in_window * self._slice_periods / self._pace.frequency_hz

    def watch(self) -> StatesAlone | None:
        """Integrate until it is clear whether the motion repeats; return a motion that must be continued."""
        run, pace, in_window = self._run, self._pace, self._in_window
        early, late, starts = self.way.path, list[Stretch](), list[FollowedRun]()
        if self.way.repeats is not None:
            self._seen = _observe_period(run, self.way.repeats, early, pace)
            return None
        made = self._made
        while run.outcome is Outcome.REACHED_END:
            path = [*early, *late]
            repeats = pace.repeats(path)
            if repeats is not None:
                self._seen = _observe_period(run, repeats, path, pace)
                return None
            kind = kind_of(None, growth_of(late), pace.fading_s)
            if kind is MotionKind.CHAOTIC and len(late) >= in_window and self._alone_s > 0.0:
                return self._follow_on(path, len(late), self._alone_s)
            if len(late) >= WINDOWS * in_window and kind is not MotionKind.UNDECIDED:
                if pace.drifts(late):
                    return self._follow_on(path, len(late), DRIFT_SHARE * self._alone_s)
                seen = _observe_last(run, late, starts, in_window, pace, f"it is {kind}")
                self._seen = replace(seen, settled_s=late[0].start_s, path=tuple(path))
                return None
            made += self._slice_periods
            end_s = made / pace.frequency_hz
            if len(late) >= in_window and end_s > self._longest_s:
                break
            if not late:
                run.follow_tangent()
            starts.append(run.copy())
            late.append(follow_with_section(run, end_s, Watch.PEAKS_AND_LINES))
        ended = f"it has not settled within {self._longest_s:g} s"
        seen = _observe_last(run, late or early, starts, in_window, pace, ended)
        self._seen = replace(seen, path=(*early, *late))
        return None

    def _follow_on(self, path: list[Stretch], watched: int, alone_s: float) -> StatesAlone:
        """Return the motion to integrate further; the last ``watched`` stretches have a tangent vector."""
        run, frequency_hz = self._run, self._pace.frequency_hz
        self._path, self._watched = path, watched
        until_s = whole_periods(self._longest_s - self._window_s, frequency_hz) / frequency_hz
        self._on = StatesAlone(run, self._pace, states_of(path)).aim(until_s, run.cost_s + alone_s)
        return self._on

    def observe(self) -> Steps[SceneRun]:
        """Return window and kind of the motion; after further integration, observe a new window."""
        if self._on is not None:
            return (yield from self._observe_end(self._on))
        assert self._seen is not None
        return self._seen

    def _observe_end(self, states: StatesAlone) -> Steps[SceneRun]:
        run, pace, path, watched = self._run, self._pace, self._path, self._watched
        if states.repeats is not None:
            seen = _observe_period(run, states.repeats, path, pace)
            return replace(seen, wandered_until_s=states.wandered_until_s)
        # Chaos may have become quasi-periodic motion, which does not repeat either, but has zero growth.
        run.follow_tangent()
        begins, made = run.copy(), round(run.time_s * pace.frequency_hz)
        last: list[Stretch] = []
        for number in range(1, self._in_window + 1):
            end_s = (made + number * self._slice_periods) / pace.frequency_hz
            last.append((yield end_s, Watch.PEAKS_AND_LINES))
        window = window_of(begins, last)
        kind = kind_of(None, growth_of(last), pace.fading_s)
        if kind is not MotionKind.CHAOTIC:
            before = () if growth_of(path).is_certain else path[-watched:]
            seen = classify(run, window, before, pace, f"after {run.time_s:.3g} s it is {kind}")
            return replace(seen, grew=growth_of(path).is_certain, wandered_until_s=last[0].start_s)
        seen = classify(run, window, path[-watched:], pace, f"it is chaotic, for at least {run.time_s:.3g} s")
        if run.outcome is not Outcome.REACHED_END:
            return seen
        settled_s = path[-watched].start_s
        return replace(seen, motion=MotionKind.CHAOTIC, repeats=None, settled_s=settled_s, grew=True)


def _slices(window_s: float, frequency_hz: float) -> tuple[int, int]:
    """Return the number of drive periods in a slice (between two checks), and of slices in a window."""
    in_window = max(1, whole_periods(window_s, frequency_hz))
    periods = min(in_window, max(SLICE_PERIODS, math.ceil(SLICE_S * frequency_hz)))
    return periods, max(1, round(in_window / periods))


def _observe_period(run: FollowedRun, repeats: Repetition, path: Sequence[Stretch], pace: Pace) -> SceneRun:
    """Observe one period of a repeating motion, and find the time at which the motion settled."""
    settled_s, begins = run.time_s, run.copy()
    section = states_of(path)
    since = first_repetition(section, 2.0 * math.pi * pace.frequency_hz, repeats.period)
    end_s = settled_s + repeats.period / pace.frequency_hz
    one = follow_with_section(run, end_s, Watch.PEAKS_AND_LINES)
    window = window_of(begins, [one])
    seen = classify(run, window, [], pace, f"it repeats after {repeats.period} drive period(s)", repeats)
    if seen.repeats is None:
        return replace(seen, path=tuple(path))
    return replace(
        seen,
        settled_s=settled_s,
        was_settled=True,
        path=tuple(path),
        grew=growth_of(path).is_certain,
        wandered_until_s=settled_s - (len(section) - since) / pace.frequency_hz,
    )


def _observe_last(
    run: FollowedRun,
    stretches: Sequence[Stretch],
    starts: Sequence[FollowedRun],
    in_window: int,
    pace: Pace,
    ended: str,
) -> SceneRun:
    """Classify the motion of a run whose window consists of its last ``in_window`` stretches."""
    last = stretches[-in_window:]
    begins = starts[-len(last)] if starts else run
    window = window_of(begins, last)
    return classify(run, window, stretches[:-in_window], pace, ended)
