"""A motion followed for a given time and observed at its end. SI units.

It is looked at once a drive period. Where it has not begun to repeat by the time that it should have
forgotten its start, a small change is carried along and extremes are kept block by block: a motion that
never repeats is known only by its growth and its statistics.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..model.arrays import Floats
from ..model.outcome import Outcome
from .followed_run import FollowedRun, Stretch
from .observed_window import (
    Block,
    ObservedWindow,
    blocks_of,
    follow_strobed,
    observe_window,
    samples_between,
    whole_periods,
)
from .pace import EXACTLY, Pace, growth_of
from .prediction import MotionKind
from .repetition import Repetition, kind_of
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
