"""A motion followed until it has settled, for as long as that takes, and observed then. SI units.

A motion that repeats is observed over one of its own periods, which holds all there is to see. One that does
not is observed over a window once it is certain that it never will; because chaos can die out, the certainty
must have lasted for a whole window before.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from ..model import Outcome
from ._fixed_run import Pace, SceneRun, growth_of, judged
from ._followed_run import FollowedRun, Stretch, Watch
from ._observed_window import follow_strobed, whole_periods, window_of
from ._prediction import MotionKind
from ._repetition import Repetition, kind_of

SLICE_S, SLICE_PERIODS = 0.25, 4
"""Between two looks pass this long and this many drive periods, if the window is not shorter."""
WINDOWS = 2
"""A motion that does not repeat is watched for so many windows; the last of them is the one observed."""


def run_until_settled(run: FollowedRun, window_s: float, longest_s: float, pace: Pace) -> SceneRun:
    """Follow a motion until it repeats or surely never will, and observe it.

    Parameters
    ----------
    run
        At time zero.
    window_s
        Observed of a motion that does not repeat [s]; rounded to equal parts of whole drive periods.
    longest_s
        The motion is followed no longer, and called undecided if need be [s]; for a window at least.
    pace
        What decides whether it has settled.

    """
    slice_periods, in_window = _slices(window_s, pace.frequency_hz)
    watched_after_s = min(pace.attractor_s, longest_s - in_window * slice_periods / pace.frequency_hz)
    early: list[Stretch] = []
    late: list[Stretch] = []
    starts: list[FollowedRun] = []
    made = 0
    while run.outcome is Outcome.REACHED_END:
        repeats = pace.repeats([*early, *late])
        if repeats is not None:
            return _observe_period(run, repeats, pace)
        kind = kind_of(None, growth_of(late), pace.forgetting_s)
        if len(late) >= WINDOWS * in_window and kind is not MotionKind.UNDECIDED:
            seen = _observed(run, late, starts, in_window, pace, f"it is {kind}")
            return replace(seen, settled_s=late[0].start_s)
        made += slice_periods
        end_s = made / pace.frequency_hz
        if len(late) >= in_window and end_s > longest_s:
            break
        if run.time_s < watched_after_s:
            early.append(follow_strobed(run, end_s))
            continue
        if not late:
            run.carry_tangent()
        starts.append(run.apart())
        late.append(follow_strobed(run, end_s, Watch.PEAKS_AND_LINES))
    before = late or early
    return _observed(run, before, starts, in_window, pace, f"it has not settled within {longest_s:g} s")


def _slices(window_s: float, frequency_hz: float) -> tuple[int, int]:
    """Drive periods of a slice, and slices of a window."""
    in_window = max(1, whole_periods(window_s, frequency_hz))
    periods = min(in_window, max(SLICE_PERIODS, math.ceil(SLICE_S * frequency_hz)))
    return periods, max(1, round(in_window / periods))


def _observe_period(run: FollowedRun, repeats: Repetition, pace: Pace) -> SceneRun:
    """Observe one period of a motion that repeats."""
    settled_s, begins = run.time_s, run.apart()
    end_s = settled_s + repeats.period / pace.frequency_hz
    one = follow_strobed(run, end_s, Watch.PEAKS_AND_LINES)
    window = window_of(begins, [one], [one.peak_x_m])
    seen = judged(run, window, [], pace, f"it repeats after {repeats.period} drive period(s)")
    if run.outcome is not Outcome.REACHED_END:
        return seen
    return replace(seen, motion=MotionKind.PERIODIC, repeats=repeats, settled_s=settled_s)


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
    window = window_of(begins, last, [stretch.peak_x_m for stretch in last])
    return judged(run, window, stretches[:-in_window], pace, ended)
