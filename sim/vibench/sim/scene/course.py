"""Runs of a scene's motion for a given time (`FixedCourse`) or until it settles (`SettlingCourse`).

Both have three steps, so that many scenes can run side by side: `way` is followed first, `watch` then
classifies and returns any further motion to follow, and `seen` observes the end. In
between, `StatesAlone.follow` follows one motion, `in_batches` those of many scenes. SI units.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..engine.run import Watch
from ..specimen.outcome import Outcome
from ..specimen.state import Floats
from .fixed_point import stable_motion
from .followed_run import (
    Block,
    FollowedRun,
    ObservedWindow,
    Stretch,
    blocks_of,
    follow_with_section,
    observe_window,
    samples_between,
    states_of,
    whole_periods,
    window_of,
)
from .prediction import MotionKind
from .repetition import EXACTLY, Pace, Repetition, growth_of, kind_of, wandered_until
from .scene import FixedDuration
from .states_alone import StatesAlone


@dataclass(frozen=True, eq=False)
class SceneRun:
    """End of a run and its findings."""

    window: ObservedWindow
    blocks: tuple[Block, ...]
    """Blocks of the motion that was watched, those of the window last."""
    was_settled: bool
    """The motion repeated before the window began."""
    motion: MotionKind
    repeats: Repetition | None
    settled_s: float | None
    """When it was found to be settled; None if not checked or not found."""
    ended: str
    """Reason for its end."""
    path: tuple[Stretch, ...]
    """From its beginning until it had settled, or until a small change had certainly grown without end."""
    grew: bool
    """A small change that was carried along has certainly grown without end."""
    wandered_until_s: float
    """When it was last seen to change from period to period."""
    leaked: Floats = field(default_factory=lambda: np.zeros(4))
    """What the responses, relatively, would be off by if the lines were taken over all of the window, shape
    (4,); zero unless the motion was found to repeat in the window only."""


class FixedCourse:
    """Run of a motion for a given time, observed at its end.

    It is looked at once a drive period. Where it has not started to repeat by the time that it should have
    forgotten its start, a small change is carried along and extremes are kept block by block: a motion that
    never repeats is known only by its growth and its statistics.
    """

    def __init__(self, run: FollowedRun, pace: Pace, duration: FixedDuration) -> None:
        self._run, self._pace, self._duration = run, pace, duration
        self._lead = Lead(run, duration.duration_s - duration.window_s - pace.section_s, pace)

    @property
    def way(self) -> StatesAlone | None:
        """Motion until it should have settled; None if followed without checks."""
        return self._lead.states

    def watch(self) -> None:
        """Return nothing more to follow."""

    def seen(self) -> SceneRun:
        """Observe its end."""
        run, pace, duration = self._run, self._pace, self._duration
        lead = self._lead.end()
        last = follow_with_section(run, duration.duration_s - duration.window_s)
        before = pace.repeats([last])
        if before is None:
            run.follow_tangent()
        is_chaos = pace.is_chaos if before is None else None
        window = observe_window(run, duration.window_s, pace.cycle([last]), is_chaos)
        seen = classify(run, window, [last], pace, f"the {duration.duration_s:g} s asked for are over")
        cycle = pace.cycle([last, *window.stretches])
        if window.line_periods % cycle != 0:
            # Its period was found only now, so the window is repeated for lines without leakage.
            begins = window.begins.apart()
            begins.drop_tangent()
            whole = observe_window(begins, duration.window_s, cycle)
            leaked = np.abs(window.responses_m / whole.responses_m - 1.0)
            seen = replace(seen, window=whole, leaked=leaked)
        has_settled = self.way is not None and self.way.repeats is not None
        path = lead if has_settled else (*lead, last, *window.stretches)
        # The start of the repetition was not determined.
        return replace(seen, was_settled=before is not None, path=path, wandered_until_s=0.0)


def classify(
    run: FollowedRun,
    window: ObservedWindow,
    before: Sequence[Stretch],
    pace: Pace,
    ended: str,
    repeats: Repetition | None = None,
) -> SceneRun:
    """Return the kind of a motion from its window and the stretches before it.

    Those before it that were watched are blocks as long as the window's own. A motion that comes back is
    periodic only if Newton's iteration finds a stable motion there: chaos passes by unstable ones, and
    slowly by where two motions have just vanished in a fold.
    """
    stretches = [*before, *window.stretches]
    repeats, growth = repeats or pace.repeats(stretches), growth_of(stretches)
    motion = kind_of(repeats, growth, pace.fading_s)
    if run.outcome is not Outcome.REACHED_END:
        motion, repeats, ended = MotionKind.UNDECIDED, None, run.outcome.text
    elif repeats is not None:
        found = stable_motion(run, repeats.period)
        if found is None:
            ended = f"it comes back after {repeats.period} drive period(s), but near no stable motion"
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
    )


MOST_LOOKS = 4096
"""States that are kept of a long lead at most: enough to see other starts part from it."""
LOOKS = 16
"""Least number of checks on a long lead whether the motion repeats."""
LONGEST_SLICE = 1 << 16
"""Drive periods between two looks, at most: their states are held."""


class Lead:
    """A motion advanced to an instant, with some of its states.

    What repeats to rounding is followed no further: the whole cycles that are left are passed over. Where
    steps follow one another without a break nothing repeats so nearly.
    """

    def __init__(self, run: FollowedRun, until_s: float, pace: Pace) -> None:
        self._run, self._until_s, self._frequency_hz = run, max(until_s, run.time_s), pace.frequency_hz
        periods = whole_periods(self._until_s, pace.frequency_hz)
        self._every = every = max(1, math.ceil(periods / MOST_LOOKS))
        self.states: StatesAlone | None = None
        """To be followed; None where the motion is advanced without looking."""
        if pace.sharpness.noise < EXACTLY:
            exact = replace(pace, sharpness=replace(pace.sharpness, tolerance=EXACTLY))
            slice_periods = min(max(1, math.ceil(periods / LOOKS)), LONGEST_SLICE)
            way_s = math.ceil(pace.attractor_s * pace.frequency_hz) / pace.frequency_hz
            states = StatesAlone(run, exact, slice_periods=slice_periods, every=every, by_itself_s=way_s)
            self.states = states.aim(self._until_s)

    def end(self) -> tuple[Stretch, ...]:
        """Bring a motion whose states were followed to the instant; returns its path."""
        run, states = self._run, self.states
        if states is None:
            rate_hz = self._frequency_hz / self._every
            samples = samples_between(rate_hz, run.time_s, self._until_s)
            return (run.follow(self._until_s, samples=samples),)
        if states.repeats is not None:
            left = (self._until_s - run.time_s) * self._frequency_hz
            run.pass_over(int(left / states.repeats.period) * states.repeats.period)
        return tuple(states.path)


SLICE_S, SLICE_PERIODS = 0.25, 4
"""Between two looks pass this long and this many drive periods, if the window is not shorter."""
WINDOWS = 2
"""A motion that does not repeat is watched for this many windows; the last of them is the one observed."""
DRIFT_SHARE = 0.25
"""Share of the budget that a slow drift may use: finding its error repeats its path three times."""


class SettlingCourse:
    """Run of a motion until it repeats or certainly never will, and is then observed.

    A motion that repeats is observed over one of its own periods, which holds all there is to see. One that
    does not is observed over a window once it is certain that it never will. Because chaos can die out, it
    is followed on by its states alone for as long as a budget allows.

    Parameters
    ----------
    run, pace
        The motion, and what decides how long is long.
    window_s
        Observed of a motion that does not repeat; rounded to equal parts of whole drive periods.
    longest_s
        It is followed no longer, and called undecided if need be; for a window at least.
    alone_s
        Nominal cost of following chaos on by its states alone; zero does not follow it on.
    by_itself_s
        Until then it is not followed in a batch; see `StatesAlone`.
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
        """Follow it until it repeats or certainly never will; return chaos or a drift to follow further."""
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
            starts.append(run.apart())
            late.append(follow_with_section(run, end_s, Watch.PEAKS_AND_LINES))
        ended = f"it has not settled within {self._longest_s:g} s"
        seen = _observe_last(run, late or early, starts, in_window, pace, ended)
        self._seen = replace(seen, path=(*early, *late))
        return None

    def _follow_on(self, path: list[Stretch], watched: int, alone_s: float) -> StatesAlone:
        """Let it be followed until it ends or a budget is used up; the last ``watched`` were observed."""
        run, frequency_hz = self._run, self._pace.frequency_hz
        self._path, self._watched = path, watched
        until_s = whole_periods(self._longest_s - self._window_s, frequency_hz) / frequency_hz
        self._on = StatesAlone(run, self._pace, states_of(path)).aim(until_s, run.cost_s + alone_s)
        return self._on

    def seen(self) -> SceneRun:
        """Return what was seen; of a motion that was followed on, after a last window."""
        if self._on is not None:
            return self._after(self._on)
        assert self._seen is not None
        return self._seen

    def _after(self, states: StatesAlone) -> SceneRun:
        run, pace, path, watched = self._run, self._pace, self._path, self._watched
        if states.repeats is not None:
            seen = _observe_period(run, states.repeats, path, pace)
            return replace(seen, wandered_until_s=states.wandered_until_s)
        # Chaos may have settled on a torus, which does not repeat either; only growth distinguishes them.
        run.follow_tangent()
        begins, made = run.apart(), round(run.time_s * pace.frequency_hz)
        last = [
            follow_with_section(
                run, (made + number * self._slice_periods) / pace.frequency_hz, Watch.PEAKS_AND_LINES
            )
            for number in range(1, self._in_window + 1)
        ]
        window = window_of(begins, last)
        kind = kind_of(None, growth_of(last), pace.fading_s)
        if kind is not MotionKind.CHAOTIC:
            before = () if growth_of(path).is_certain else path[-watched:]
            seen = classify(run, window, before, pace, f"after {run.time_s:.3g} s it is {kind}")
            return replace(seen, grew=growth_of(path).is_certain, wandered_until_s=last[0].start_s)
        seen = classify(run, window, path[-watched:], pace, f"it is chaotic, for {run.time_s:.3g} s at least")
        if run.outcome is not Outcome.REACHED_END:
            return seen
        settled_s = path[-watched].start_s
        return replace(seen, motion=MotionKind.CHAOTIC, repeats=None, settled_s=settled_s, grew=True)


def _slices(window_s: float, frequency_hz: float) -> tuple[int, int]:
    """Drive periods of a slice, and slices of a window."""
    in_window = max(1, whole_periods(window_s, frequency_hz))
    periods = min(in_window, max(SLICE_PERIODS, math.ceil(SLICE_S * frequency_hz)))
    return periods, max(1, round(in_window / periods))


def _observe_period(run: FollowedRun, repeats: Repetition, path: Sequence[Stretch], pace: Pace) -> SceneRun:
    """Observe one period of a repeating motion, and find since when it is settled."""
    settled_s, begins = run.time_s, run.apart()
    section = states_of(path)
    since = wandered_until(section, 2.0 * math.pi * pace.frequency_hz, repeats.period)
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
    """Take the last stretches for the window."""
    last = stretches[-in_window:]
    begins = starts[-len(last)] if starts else run
    window = window_of(begins, last)
    return classify(run, window, stretches[:-in_window], pace, ended)
