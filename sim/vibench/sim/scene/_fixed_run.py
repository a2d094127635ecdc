"""A motion followed for a given time and observed at its end, or until it has settled. SI units.

It is looked at once a drive period. Where it has not begun to repeat by the time that it should have
forgotten its start, a small change is carried along and extremes are kept block by block: a motion that
never repeats is known only by its growth and its statistics.

A motion followed until it has settled, for as long as that takes, and observed then. SI units.

A motion that repeats is observed over one of its own periods, which holds all there is to see. One that does
not is observed over a window once it is certain that it never will; because chaos can die out, the certainty
must have lasted for a whole window before.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..kernels import Floats
from ..model import Accuracy, Outcome, PowerLaw, Specimen
from ._followed_run import FollowedRun, ObservedQuantities, Stretch
from ._observed_window import (
    ObservedWindow,
    follow_strobed,
    observe_window,
    states_of,
    whole_periods,
    window_of,
)
from ._prediction import MotionKind
from ._repetition import Growth, Repetition, Sharpness, kind_of, repetition, section_needed

FORGETTING = 8.0
"""Forgetting times after which a motion that does not repeat is taken to be on its attractor."""
FEWEST_TIMES = 40.0
"""The longest run holds this many forgetting times; slower modes, and undamped ones, count as so slow."""
FEWEST_PERIODS = 32
"""Drive periods after which a motion that does not repeat is taken to be on its attractor, at least."""
SETTLED = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-8}
"""Distance from the motion that it repeats, over its size, at which it counts as settled."""
ROUNDING = 1e-10
"""Noise of exact flight and of contacts that begin and end as they did a period before."""
STEPPING = 100.0
"""Noise over the tolerance where steps follow one another without a break: they fall elsewhere in each
period. Measured: 70 at most (p^7 at 130 Hz and 20 um)."""


@dataclass(frozen=True)
class Pace:
    """What decides how long is long, for one drive."""

    frequency_hz: float
    forgetting_s: float
    """Time in which the slowest mode without contact fades by e."""
    sharpness: Sharpness

    @property
    def forgetting_periods(self) -> float:
        """The forgetting time in drive periods."""
        return self.forgetting_s * self.frequency_hz

    @property
    def attractor_s(self) -> float:
        """When a motion that does not repeat is taken to be on its attractor."""
        return max(FORGETTING * self.forgetting_s, FEWEST_PERIODS / self.frequency_hz)

    @property
    def section_s(self) -> float:
        """Length of the section that lets every period be found."""
        return (section_needed(self.forgetting_periods) + 1) / self.frequency_hz

    def repeats(self, stretches: Sequence[Stretch]) -> Repetition | None:
        """Say whether the motion of these stretches, one after the other, repeats at their end."""
        omega = 2.0 * np.pi * self.frequency_hz
        return repetition(states_of(stretches), omega, self.forgetting_periods, self.sharpness)


def pace_of(
    specimen: Specimen, frequency_hz: float, accuracy: Accuracy, slowest_rate: float, longest_s: float
) -> Pace:
    """Choose the pace for a specimen whose slowest mode has ``slowest_rate`` [1/s], zero or negative."""
    slowest_s = longest_s / FEWEST_TIMES
    forgetting_s = min(slowest_s, -1.0 / slowest_rate) if slowest_rate < 0.0 else slowest_s
    match specimen.contact:
        case PowerLaw():
            noise = STEPPING * accuracy.tolerance
        case _:
            noise = ROUNDING
    return Pace(frequency_hz, forgetting_s, Sharpness(max(SETTLED[accuracy], 2.0 * noise), noise))


@dataclass(frozen=True, eq=False)
class SceneRun:
    """A run's end, and what was learnt on the way."""

    window: ObservedWindow
    block_peaks_m: Floats
    """Largest abs(x) in equal blocks of the settled motion, those of the window last, shape (blocks,)."""
    blocks_in_window: int
    motion: MotionKind
    repeats: Repetition | None
    settled_s: float | None
    """When it was known to be settled; None where that was not looked for, or not found."""
    ended: str
    """Why it was followed no longer."""


def run_for(run: FollowedRun, duration_s: float, window_s: float, pace: Pace) -> SceneRun:
    """Follow a motion that is at time zero for a while, and observe the last ``window_s`` of it."""
    last = _last_section(run, duration_s - window_s, pace)
    if pace.repeats([last]) is None:
        run.follow_tangent()
    window = observe_window(run, window_s)
    return judged(run, window, [last], pace, f"the {duration_s:g} s asked for are over")


def judged(
    run: FollowedRun, window: ObservedWindow, before: Sequence[Stretch], pace: Pace, ended: str
) -> SceneRun:
    """Say what a motion is, from its window and the stretches before it.

    Those before it that were watched are blocks as long as the window's own.
    """
    stretches = [*before, *window.stretches]
    repeats = pace.repeats(stretches)
    growth = growth_of(stretches)
    peaks = [stretch.peak_x_m for stretch in before if stretch.peak_x_m > 0.0]
    is_lost = run.outcome is not Outcome.REACHED_END
    return SceneRun(
        window=window,
        block_peaks_m=np.array([*peaks, *window.block_peaks_m]),
        blocks_in_window=len(window.block_peaks_m),
        motion=MotionKind.UNDECIDED if is_lost else kind_of(repeats, growth, pace.forgetting_s),
        repeats=None if is_lost else repeats,
        settled_s=None,
        ended=run.outcome.text if is_lost else ended,
    )


def growth_of(stretches: Sequence[Stretch]) -> Growth:
    """Growth of a small change over those stretches in which one was carried."""
    carried = [stretch for stretch in stretches if np.isfinite(stretch.growth)]
    logarithms = np.array([stretch.growth for stretch in carried])
    return Growth(logarithms, sum(stretch.length_s for stretch in carried))


def _last_section(run: FollowedRun, until_s: float, pace: Pace) -> Stretch:
    """Advance to an instant; the states of the last periods are kept."""
    run.follow(max(run.time_s, until_s - pace.section_s))
    return follow_strobed(run, until_s)


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
            run.follow_tangent()
        starts.append(run.apart())
        late.append(follow_strobed(run, end_s, ObservedQuantities.PEAKS_AND_LINES))
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
    one = follow_strobed(run, end_s, ObservedQuantities.PEAKS_AND_LINES)
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
