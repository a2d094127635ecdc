"""A motion followed for a given time and observed at its end. SI units.

It is looked at once a drive period. Where it has not begun to repeat by the time that it should have
forgotten its start, a small change is carried along and extremes are kept block by block: a motion that
never repeats is known only by its growth and its statistics.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..engine.run import Watch
from ..model.arrays import Floats
from ..model.outcome import Outcome
from .followed_run import (
    Block,
    FollowedRun,
    ObservedWindow,
    Stretch,
    blocks_of,
    follow_strobed,
    observe_window,
    samples_between,
    states_of,
    whole_periods,
    window_of,
)
from .prediction import MotionKind
from .repetition import EXACTLY, Pace, Repetition, growth_of, kind_of, wandered_until
from .states_alone import Asking, Following, StatesAlone


@dataclass(frozen=True, eq=False)
class SceneRun:
    """A run's end, and what was learnt on the way."""

    window: ObservedWindow
    blocks: tuple[Block, ...]
    """Of the motion that was watched, those of the window last."""
    was_settled: bool
    """The motion repeated before the window began."""
    motion: MotionKind
    repeats: Repetition | None
    settled_s: float | None
    """When it was known to be settled; None where that was not looked for, or not found."""
    ended: str
    """Why it was followed no longer."""
    path: tuple[Stretch, ...]
    """From its beginning until it had settled, or until a small change had surely grown without end."""
    grew: bool
    """A small change that was carried along has surely grown without end."""
    wandered_until_s: float
    """When it was last seen to change from period to period."""
    leaked: Floats = field(default_factory=lambda: np.zeros(4))
    """What the responses, relatively, would be off by if the lines were taken over all of the window, shape
    (4,); zero unless the motion was found to repeat in the window only."""


def run_for(run: FollowedRun, duration_s: float, window_s: float, pace: Pace) -> Asking[SceneRun]:
    """Follow a motion that is at time zero for a while, and observe the last ``window_s`` of it."""
    ((lead, is_settled),) = yield from leads([run], duration_s - window_s - pace.section_s, pace)
    last = follow_strobed(run, duration_s - window_s)
    before = pace.repeats([last])
    if before is None:
        run.follow_tangent()
    window = observe_window(run, window_s, pace.cycle([last]), pace.is_chaos if before is None else None)
    seen = judged(run, window, [last], pace, f"the {duration_s:g} s asked for are over")
    cycle = pace.cycle([last, *window.stretches])
    if window.line_periods % cycle != 0:
        # Its period was found only now: the window is gone through once more, for lines that do not leak.
        begins = window.begins.apart()
        begins.drop_tangent()
        whole = observe_window(begins, window_s, cycle)
        leaked = np.abs(window.responses_m / whole.responses_m - 1.0)
        seen = replace(seen, window=whole, leaked=leaked)
    path = lead if is_settled else (*lead, last, *window.stretches)
    # Since when it repeats was not looked for.
    return replace(seen, was_settled=before is not None, path=path, wandered_until_s=0.0)


def judged(
    run: FollowedRun, window: ObservedWindow, before: Sequence[Stretch], pace: Pace, ended: str
) -> SceneRun:
    """Say what a motion is, from its window and the stretches before it.

    Those before it that were watched are blocks as long as the window's own.
    """
    stretches = [*before, *window.stretches]
    repeats = pace.repeats(stretches)
    growth = growth_of(stretches)
    is_lost = run.outcome is not Outcome.REACHED_END
    return SceneRun(
        window=window,
        blocks=(*blocks_of(before), *window.blocks),
        was_settled=False,
        motion=MotionKind.UNDECIDED if is_lost else kind_of(repeats, growth, pace.fading_s),
        repeats=None if is_lost else repeats,
        settled_s=None,
        ended=run.outcome.text if is_lost else ended,
        path=tuple(stretches),
        grew=growth.is_certain and repeats is None,
        wandered_until_s=run.time_s if repeats is None else stretches[0].start_s,
    )


MOST_LOOKS = 4096
"""States that are kept of a long lead at most: enough to see other starts part from it."""
LOOKS = 16
"""How often it is looked for on a long lead whether the motion repeats, at least."""
LONGEST_SLICE = 1 << 16
"""Drive periods between two looks, at most: their states are held."""


def leads(
    runs: Sequence[FollowedRun], until_s: float, pace: Pace
) -> Asking[list[tuple[tuple[Stretch, ...], bool]]]:
    """Advance motions to an instant, and keep some states on the way; and whether each repeated before.

    What repeats to rounding is followed no further: the whole cycles that are left are passed over. Where
    steps follow one another without a break nothing repeats so nearly.
    """
    until_s = max(until_s, *(run.time_s for run in runs))
    periods = whole_periods(until_s, pace.frequency_hz)
    every = max(1, math.ceil(periods / MOST_LOOKS))
    if not pace.sharpness.noise < EXACTLY:
        rate_hz = pace.frequency_hz / every
        return [
            ((run.follow(until_s, samples=samples_between(rate_hz, run.time_s, until_s)),), False)
            for run in runs
        ]
    exact = replace(pace, sharpness=replace(pace.sharpness, tolerance=EXACTLY))
    slice_periods = min(max(1, math.ceil(periods / LOOKS)), LONGEST_SLICE)
    # On the way to its attractor a motion carries each error along; lanes begin at a whole drive period.
    way_s = math.ceil(pace.attractor_s * pace.frequency_hz) / pace.frequency_hz
    several = [StatesAlone(run, exact, slice_periods=slice_periods, every=every) for run in runs]
    for states in several:
        states.follow(min(until_s, way_s))
    yield [Following(states, until_s, math.inf) for states in several]
    for states in several:
        if states.repeats is not None:
            left = (until_s - states.run.time_s) * pace.frequency_hz
            states.run.pass_over(int(left / states.repeats.period) * states.repeats.period)
    return [(tuple(states.path), states.repeats is not None) for states in several]


# A motion followed until it has settled, for as long as that takes, and observed then. SI units.
#
# A motion that repeats is observed over one of its own periods, which holds all there is to see. One that
# does not is observed over a window once it is certain that it never will. Because chaos can die out, it is
# followed on by its states alone for as long as a budget allows.

SLICE_S, SLICE_PERIODS = 0.25, 4
"""Between two looks pass this long and this many drive periods, if the window is not shorter."""
WINDOWS = 2
"""A motion that does not repeat is watched for so many windows; the last of them is the one observed."""
DRIFT_SHARE = 0.25
"""Share of the budget that a slow drift may use: finding its error repeats its path three times."""


@dataclass(frozen=True)
class Patience:
    """How long a motion that has not settled is followed."""

    window_s: float
    """Observed of a motion that does not repeat; rounded to equal parts of whole drive periods."""
    longest_s: float
    """It is followed no longer, and called undecided if need be; for a window at least."""
    alone_s: float
    """Nominal cost of following chaos on by its states alone; zero does not follow it on."""
    is_exact: bool = True
    """On the way to its attractor a motion carries each error along: it is followed by itself there."""


def settling(run: FollowedRun, patience: Patience, pace: Pace) -> Asking[SceneRun]:
    """Follow a motion that is at time zero until it repeats or surely never will, and observe it."""
    slice_periods, in_window = _slices(patience.window_s, pace.frequency_hz)
    longest_s = patience.longest_s
    watched_after_s = min(pace.attractor_s, longest_s - in_window * slice_periods / pace.frequency_hz)
    slices = max(0, math.ceil(watched_after_s * pace.frequency_hz / slice_periods))
    begun = StatesAlone(run, pace, slice_periods=slice_periods, every=1)
    way = Following(begun, slices * slice_periods / pace.frequency_hz, math.inf)
    if patience.is_exact:
        way.by_itself()
    yield [way]
    early = begun.path
    if begun.repeats is not None:
        return _observe_period(run, begun.repeats, early, pace)
    late: list[Stretch] = []
    starts: list[FollowedRun] = []
    made = slices * slice_periods
    while run.outcome is Outcome.REACHED_END:
        repeats = pace.repeats([*early, *late])
        if repeats is not None:
            return _observe_period(run, repeats, [*early, *late], pace)
        kind = kind_of(None, growth_of(late), pace.fading_s)
        if kind is MotionKind.CHAOTIC and len(late) >= in_window and patience.alone_s > 0.0:
            return (yield from _followed_on(run, [*early, *late], len(late), patience, pace))
        if len(late) >= WINDOWS * in_window and kind is not MotionKind.UNDECIDED:
            if pace.drifts(late):
                less = replace(patience, alone_s=DRIFT_SHARE * patience.alone_s)
                return (yield from _followed_on(run, [*early, *late], len(late), less, pace))
            seen = _observed(run, late, starts, in_window, pace, f"it is {kind}")
            return replace(seen, settled_s=late[0].start_s, path=(*early, *late))
        made += slice_periods
        end_s = made / pace.frequency_hz
        if len(late) >= in_window and end_s > longest_s:
            break
        if not late:
            run.follow_tangent()
        starts.append(run.apart())
        late.append(follow_strobed(run, end_s, Watch.PEAKS_AND_LINES))
    before = late or early
    seen = _observed(run, before, starts, in_window, pace, f"it has not settled within {longest_s:g} s")
    return replace(seen, path=(*early, *late))


def _followed_on(
    run: FollowedRun, path: Sequence[Stretch], watched: int, patience: Patience, pace: Pace
) -> Asking[SceneRun]:
    """Follow chaos or a slow drift by its states until it ends or the budget is used up; then observe.

    The last ``watched`` stretches of the path were observed.
    """
    slice_periods, in_window = _slices(patience.window_s, pace.frequency_hz)
    window_s = in_window * slice_periods / pace.frequency_hz
    states = StatesAlone(run, pace, states_of(path))
    until_s = whole_periods(patience.longest_s - window_s, pace.frequency_hz) / pace.frequency_hz
    yield [Following(states, until_s, run.cost_s + patience.alone_s)]
    if states.repeats is not None:
        seen = _observe_period(run, states.repeats, path, pace)
        return replace(seen, wandered_until_s=states.wandered_until_s)
    # Chaos may have settled on a torus, which does not repeat either: only growth tells the two apart.
    run.follow_tangent()
    begins, made = run.apart(), round(run.time_s * pace.frequency_hz)
    last = [
        follow_strobed(run, (made + number * slice_periods) / pace.frequency_hz, Watch.PEAKS_AND_LINES)
        for number in range(1, in_window + 1)
    ]
    window = window_of(begins, last)
    kind = kind_of(None, growth_of(last), pace.fading_s)
    if kind is not MotionKind.CHAOTIC:
        is_drifting = pace.drifts(last)
        found = "still drifts" if is_drifting else f"is {kind}"
        before = () if growth_of(path).is_certain else path[-watched:]
        seen = judged(run, window, before, pace, f"after {run.time_s:.3g} s it {found}")
        return replace(
            seen,
            motion=MotionKind.UNDECIDED if is_drifting else seen.motion,
            grew=growth_of(path).is_certain,
            wandered_until_s=last[0].start_s,
        )
    seen = judged(run, window, path[-watched:], pace, f"it is chaotic, for {run.time_s:.3g} s at least")
    if run.outcome is not Outcome.REACHED_END:
        return seen
    return replace(seen, motion=MotionKind.CHAOTIC, repeats=None, settled_s=path[-watched].start_s, grew=True)


def _slices(window_s: float, frequency_hz: float) -> tuple[int, int]:
    """Drive periods of a slice, and slices of a window."""
    in_window = max(1, whole_periods(window_s, frequency_hz))
    periods = min(in_window, max(SLICE_PERIODS, math.ceil(SLICE_S * frequency_hz)))
    return periods, max(1, round(in_window / periods))


def _observe_period(run: FollowedRun, repeats: Repetition, path: Sequence[Stretch], pace: Pace) -> SceneRun:
    """Observe one period of a motion that repeats, and say since when it has hardly changed any more."""
    settled_s, begins = run.time_s, run.apart()
    section = states_of(path)
    since = wandered_until(section, 2.0 * math.pi * pace.frequency_hz, repeats.period)
    end_s = settled_s + repeats.period / pace.frequency_hz
    one = follow_strobed(run, end_s, Watch.PEAKS_AND_LINES)
    window = window_of(begins, [one])
    seen = judged(run, window, [], pace, f"it repeats after {repeats.period} drive period(s)")
    if run.outcome is not Outcome.REACHED_END:
        return seen
    return replace(
        seen,
        motion=MotionKind.PERIODIC,
        repeats=repeats,
        settled_s=settled_s,
        was_settled=True,
        path=tuple(path),
        grew=growth_of(path).is_certain,
        wandered_until_s=settled_s - (len(section) - since) / pace.frequency_hz,
    )


def _observed(
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
    return judged(run, window, stretches[:-in_window], pace, ended)
