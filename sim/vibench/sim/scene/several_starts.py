"""Motions of a scene from several nearly equal starts (initial states). SI units.

After transient chaos, chance determines which motion is reached, and when. Starts that differ by a
millionth of the gap then give random samples. These starts are integrated in rounds until all motions have
settled, chaos is known to last, or the budget is used up.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..engine.run import Outcome, Watch
from ..specimen.drive import Harmonic
from ..specimen.specimen import Floats, Specimen, Y, Z
from .course import SceneRun
from .followed_run import FollowedRun, Stretch, follow_with_section, observe_window, window_of
from .plan import LinearMotion, never_touches
from .prediction import Ensemble, FoundMotion, MotionKind, StartMemory
from .repetition import FEWEST_NEUTRAL, NEUTRAL, Growth, Pace, kind_of
from .scatter import COVERED, WindowScatter, window_scatter
from .scene import CLEAR, FEWEST, MOST, FixedDuration, Scene
from .shares import Count, EscapeRate, escape_rate, shares_of, student_quantile, wilson_share
from .states_alone import Follow, StatesAlone

PUSH = 1e-6
"""Largest change of the initial state: displacements / gap, velocities / (gap * 2 pi f)."""
SEED = 2025
PARTED = 0.01
"""Relative difference of displacements above which the motions from two starts have separated; this is ten
thousand times the initial difference."""
TOUCHING = 0.999
"""Ratio of abs(p) to the gap above which m1 may be in contact."""
LEAST_SIZE = 1e-3
"""Smallest size of a motion in the test for separation [gaps]."""
LEAST_S = 1e-3
"""Smallest assumed computing cost of a run from one start [s]."""
TOO_FEW = 4
"""Smallest number of starts for which an ensemble of motions is computed."""
LASTING_S = 300.0
"""Mean lifetime above which chaos counts as lasting [s]; ten times the duration of the paper's runs."""


@dataclass(frozen=True, eq=False)
class ReachedMotion:
    """Final motion of the run from one start (initial state)."""

    run: FollowedRun
    """The run from this start, at the end of its response window."""
    motion: MotionKind
    period: int | None
    responses_m: Floats
    """Largest abs(x) and amplitude of x at the drive frequency, then both for p, shape (4,) [m]."""
    scatter: WindowScatter | None
    """Scatter of the largest abs(x) between windows, if the motion does not repeat."""
    wandered_until_s: float
    """Last time at which successive periods of the motion still differed [s]."""
    growth: Growth
    """Growth of a small perturbation of the motion; empty if the motion repeats."""


def pushes(specimen: Specimen, drive: Harmonic, count: int, seed: int) -> Floats:
    """Return random small changes of a start, shape (count, 6), proportional to gap or drive amplitude."""
    gap_m = min(specimen.gaps_m)
    length_m = gap_m if 0.0 < gap_m < math.inf else drive.amplitude_m
    scale = PUSH * length_m * np.repeat([1.0, 2.0 * math.pi * drive.frequency_hz], 3)
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 6)) * scale


def is_sensitive_to_start(begin: FollowedRun, path: Sequence[Stretch]) -> bool:
    """Return whether the motion from a slightly different start separates from a given motion.

    Parameters
    ----------
    begin
        The motion at its start.
    path
        Stretches of the motion from its start until it settled.
    """
    gap_m = min(begin.specimen.gaps_m)
    farthest_m = max((np.abs(each.states[:, :3]).max(initial=0.0) for each in path), default=0.0)
    size_m = max(float(farthest_m), LEAST_SIZE * gap_m)
    twin = begin.with_push(pushes(begin.specimen, begin.drive, 1, SEED)[0])
    for stretch in path:
        beside = twin.follow(stretch.end_s, samples=stretch.samples)
        pressed = _touches(begin.specimen, beside.states) & _touches(begin.specimen, stretch.states)
        apart_m = np.abs(beside.states[~pressed, :3] - stretch.states[~pressed, :3]).max(initial=0.0)
        if not apart_m < PARTED * size_m:
            return True
    return False


def _touches(specimen: Specimen, states: Floats) -> NDArray[np.bool_]:
    """Return whether m1 may touch a stop in each state, shape (n, 6); batches extrapolate such states."""
    lower_m, upper_m = (TOUCHING * gap_m for gap_m in specimen.gaps_m)
    p = states[:, Y] - states[:, Z]
    return np.asarray((p >= upper_m) | (p <= -lower_m))


@dataclass(frozen=True)
class Draw:
    """Settings of an ensemble: numbers of starts, seed, and limit of the computing cost."""

    clear: int = CLEAR
    """Number of starts, including the requested one, if all starts reach one motion or chaos lasts."""
    fewest: int = FEWEST
    """Number of starts in all other cases."""
    most: int = MOST
    """Number of starts if different starts reach different motions."""
    seed: int = SEED
    budget_s: float = math.inf
    """Limit of the nominal computing cost of the runs from all starts [s]."""


NOT_CARRIED = Growth(np.empty(0), 0.0)
MORE_S = 1.0
"""Margin added to the simulated time that the starts still need to prove lasting chaos [s]."""


class SeveralStarts:
    """Additional starts of a scene, and the motions reached from these starts.

    Each start is integrated at most as long as the scene's duration allows.
    """

    def __init__(
        self,
        scene: Scene,
        begin: FollowedRun,
        requested: ReachedMotion,
        pace: Pace,
        draw: Draw,
        follow: Follow,
    ) -> None:
        self._pace, self._draw, self._follow_all = pace, draw, follow
        self._window_s, longest_s = scene.duration.window_s, scene.duration.longest_s
        # Duration of the final run with a tangent vector; this run classifies a non-repeating motion.
        self._judging_s = min(FEWEST_NEUTRAL * pace.forgetting_s, max(0.0, longest_s - self._window_s))
        self._last_s = max(0.0, longest_s - self._window_s - self._judging_s)
        self._least_s = longest_s if isinstance(scene.duration, FixedDuration) else pace.settling_s
        # Simulated time at the end of the first round; the time doubles with each round.
        self._first_s = min(self._least_s, self._last_s)
        changes = pushes(begin.specimen, begin.drive, draw.most - 1, draw.seed)
        self._waiting = map(begin.with_push, changes)
        self._under_way: list[StatesAlone] = []
        self._reached = [requested]

    @property
    def motions(self) -> tuple[ReachedMotion, ...]:
        """Motions reached from the starts; the motion of the requested start comes first."""
        return tuple(self._reached)

    @property
    def followed_s(self) -> float:
        """Sum of the simulated times of the runs from all starts [s]."""
        return sum(each.run.time_s for each in self.motions)

    @property
    def escape(self) -> EscapeRate | None:
        """Rate at which chaos ends; None if no motion was irregular for long enough.

        A motion that is still irregular after the expected transient counts as chaotic from then until it
        settles. If it has neither settled nor been proved chaotic, its chaos may already have ended;
        therefore the time that detecting repetition takes is subtracted.
        """
        known = [
            (each.wandered_until_s, each.period is not None, each.motion is MotionKind.CHAOTIC)
            for each in self._reached
        ]
        known += [(each.wandered_until_s, each.repeats is not None, False) for each in self._under_way]
        unsure_s, attractor_s = self._pace.settling_s, self._pace.attractor_s
        chaos = [
            (until_s - attractor_s - (0.0 if is_over or has_grown else unsure_s), is_over)
            for until_s, is_over, has_grown in known
        ]
        chaotic_s = sum(max(0.0, life_s) for life_s, _ in chaos)
        if chaotic_s <= 0.0:
            return None
        return escape_rate(sum(is_over for life_s, is_over in chaos if life_s > 0.0), chaotic_s)

    def follow(self) -> None:
        """Integrate and observe runs from as many starts as are needed, within the budget."""
        run, budget_s = self._reached[0].run, self._draw.budget_s
        each_s = run.cost_s * min(1.0, self._least_s / run.time_s)
        if budget_s < (TOO_FEW - 1) * each_s:
            return
        spent_s = self._follow_some(self._draw.clear - 1, budget_s, each_s)
        if not self._is_clear:
            more = self._draw.fewest - self._draw.clear
            spent_s += self._follow_some(more, budget_s - spent_s, each_s)
        if any(each.period is not None for each in self.motions) and len(motions_among(self.motions)) > 1:
            # The cost per start so far determines how many more starts the budget allows.
            each_s = spent_s / (len(self.motions) - 1)
            more = self._draw.most - self._draw.fewest
            self._follow_some(more, budget_s - spent_s, each_s)

    @property
    def _is_clear(self) -> bool:
        """Whether all starts reached the same motion, which is periodic or lasting chaos."""
        settled = all(each.period is not None for each in self._reached)
        return len(motions_among(self._reached)) == 1 and (settled or self._is_lasting)

    def _follow_some(self, wanted: int, budget_s: float, each_s: float) -> float:
        """Integrate and observe up to ``wanted`` more starts within a budget; return the total cost [s]."""
        count = math.floor(min(float(wanted), max(0.0, budget_s) / max(each_s, LEAST_S)))
        self._under_way = [StatesAlone(run, self._pace) for run in islice(self._waiting, count)]
        self._follow_rounds(budget_s)
        found = [self._observe(each) for each in self._under_way]
        self._under_way = []
        self._reached += [each for each in found if each.run.outcome is Outcome.REACHED_END]
        return sum(each.run.cost_s for each in found)

    @property
    def _cost_s(self) -> float:
        return sum(each.run.cost_s for each in self._under_way)

    @property
    def _is_lasting(self) -> bool:
        """Whether chaos lasts: no run has settled, and the mean lifetime is proved to be long enough."""
        escape = self.escape
        return not self._has_settled and escape is not None and escape.lifetime_above_s > LASTING_S

    @property
    def _has_settled(self) -> bool:
        """Whether the run from any start has reached a repeating motion."""
        reached = any(each.period is not None for each in self._reached)
        return reached or any(each.repeats is not None for each in self._under_way)

    def _follow_rounds(self, budget_s: float) -> None:
        reach_s = self._first_s
        while True:
            left = [each for each in self._under_way if not each.is_over]
            allowed_s = max(0.0, budget_s - self._cost_s) / max(1, len(left))
            self._follow_all([each.aim(reach_s, each.run.cost_s + allowed_s) for each in left])
            left = [each for each in left if not each.is_over]
            if not left or self._cost_s >= budget_s or self._is_lasting:
                return
            if any(each.run.time_s < reach_s for each in left):
                continue  # use the budget that finished starts have left over
            if reach_s >= self._last_s:
                return
            lasting_s = reach_s + self._lasting_after_s / len(left)
            reach_s = min(2.0 * reach_s, lasting_s, self._last_s)

    @property
    def _lasting_after_s(self) -> float:
        """Simulated time still needed to prove that chaos lasts, if no start settles [s]."""
        escape = self.escape
        if escape is None or self._has_settled:
            return math.inf
        return max(0.0, escape.chaotic_s * (LASTING_S / escape.lifetime_above_s - 1.0)) + MORE_S

    def _observe(self, other: StatesAlone) -> ReachedMotion:
        run = other.run
        if other.repeats is not None:
            period, kind = other.repeats.period, MotionKind.PERIODIC
            begins, end_s = run.copy(), run.time_s + other.repeats.period / self._pace.frequency_hz
            one = follow_with_section(run, end_s, Watch.PEAKS_AND_LINES)
            window = window_of(begins, [one])
            until_s = other.wandered_until_s
            return ReachedMotion(run, kind, period, window.responses_m, None, until_s, NOT_CARRIED)
        until_s = other.wandered_until_s
        growth = other.growth_over(self._judging_s)
        window = observe_window(run, self._window_s)
        scatter = window_scatter([block.peak_x_m for block in window.blocks], len(window.blocks))
        kind = kind_of(None, growth, self._pace.fading_s)
        return ReachedMotion(run, kind, None, window.responses_m, scatter, until_s, growth)


SAME = 1e-3
"""Largest relative difference of responses between runs of the same motion."""
APART = 2.0
"""Difference of responses [scatter limits] above which chaotic motions count as different."""


CLEAREST = (MotionKind.PERIODIC, MotionKind.QUASI_PERIODIC, MotionKind.CHAOTIC)
"""Kinds of motion that may represent a group of starts, the preferred kind first."""


def motions_among(reached: Sequence[ReachedMotion]) -> list[list[ReachedMotion]]:
    """Return the starts grouped by motion; a group's first start is the clearest and represents the group."""
    groups: list[list[ReachedMotion]] = []
    order = {kind: place for place, kind in enumerate(CLEAREST)}
    for each in sorted(reached, key=lambda one: order.get(one.motion, len(order))):
        same = next((group for group in groups if is_same(group[0], each)), None)
        if same is None:
            groups.append([each])
        else:
            same.append(each)
    return groups


def kind_among(group: Sequence[ReachedMotion], forgetting_s: float) -> MotionKind:
    """Return the kind of a motion that several starts reached.

    In weak or bursting chaos, the perturbations of most starts may not grow while observed. If growth is
    certain from one start, the total growth over all starts decides.
    """
    kinds = [each.motion for each in group if each.motion in CLEAREST]
    if group[0].period is None and any(each.growth.is_certain for each in group):
        grown = sum(each.growth.total for each in group)
        times = sum(each.growth.duration_s for each in group) / forgetting_s
        is_chaos = MotionKind.CHAOTIC in kinds and grown > NEUTRAL * times
        return MotionKind.CHAOTIC if is_chaos else MotionKind.UNDECIDED
    if group[0].period is not None or not kinds:
        return group[0].motion
    return max(CLEAREST, key=kinds.count)


def is_same(one: ReachedMotion, other: ReachedMotion) -> bool:
    """Return whether two starts reached the same motion or its mirror image.

    Periodic motions are compared by period and all four responses; by responses alone if one start settled
    too late to be classified. Other motions are compared by Response I only, within its scatter between
    windows; chaotic motions that differ by less count as one. Weak chaos may appear undecided or
    quasi-periodic from some starts: if the kinds of two motions differ, the smaller scatter is used.
    """
    if one.period is not None and other.period is not None and one.period != other.period:
        return False
    difference = np.abs(one.responses_m - other.responses_m)
    if np.all(difference <= SAME * np.maximum(one.responses_m, other.responses_m)):
        return True
    if one.period is not None or other.period is not None:
        return False
    is_one_kind = one.motion is other.motion
    if one.scatter is None or other.scatter is None:
        return is_one_kind
    counts = max if is_one_kind else min
    largest = max(one.responses_m[0], other.responses_m[0])
    allowed = SAME + APART * counts(one.scatter.between_runs, other.scatter.between_runs)
    return bool(difference[0] <= allowed * largest)


PENDING = (MotionKind.CHAOTIC_SO_FAR, MotionKind.UNDECIDED)
"""Kinds of motion that may still turn into another motion if the run is continued."""
FEWEST_DRAWS = 3
"""Smallest number of starts from which the scatter of Response I of their common motion is estimated."""

ErrorOf = Callable[[ReachedMotion], float | None]
"""Function that returns the relative error of the responses of a motion; None if unknown."""


def ensemble_of(
    several: SeveralStarts, amplitude_m: float, forgetting_s: float, error_of: ErrorOf
) -> Ensemble:
    """Return the motions reached from all starts, each with its share of the starts and its errors.

    Parameters
    ----------
    several
        Starts that have been integrated and observed.
    amplitude_m
        Drive amplitude [m].
    forgetting_s
        Decay time (factor e) of the slowest mode without contact [s].
    error_of
        Function for the relative error of the responses of one start.
    """
    reached, escape = several.motions, several.escape
    groups = motions_among(reached)
    requested = next(group for group in groups if any(each is reached[0] for each in group))
    groups = sorted(groups, key=len, reverse=True)
    kinds = [lasting(kind_among(group, forgetting_s), escape) for group in groups]
    counts = counts_of(kinds, [len(group) for group in groups])
    shares = shares_of(counts)
    pending = sum(each.trials for each in counts if not each.is_final)
    return Ensemble(
        starts=len(reached),
        motions=tuple(
            FoundMotion(
                motion=kind,
                period=group[0].period,
                **_responses(group, amplitude_m),
                error_estimate=_error(group, error_of),
                starts=len(group),
                share=share,
            )
            for group, kind, share in zip(groups, kinds, shares, strict=True)
        ),
        requested_motion=next(place for place, group in enumerate(groups) if group is requested),
        unseen_share=wilson_share(pending, len(reached)).high,
        escape=escape,
        scatter=_deviation([each.responses_m[0] for each in reached]),
        followed_s=several.followed_s,
    )


def counts_of(kinds: Sequence[MotionKind], starts: Sequence[int]) -> list[Count]:
    """Return the number of starts that reached each motion, and whether the motion is final.

    With several chaotic motions even lasting chaos is not final: one chaotic motion may change to another,
    and the escape rate counts only changes to periodic motions.
    """
    is_one_chaos = kinds.count(MotionKind.CHAOTIC) == 1
    return [
        Count(count, kind not in PENDING and (kind is not MotionKind.CHAOTIC or is_one_chaos))
        for kind, count in zip(kinds, starts, strict=True)
    ]


def lasting(motion: MotionKind, escape: EscapeRate | None) -> MotionKind:
    """Return the kind of a motion; "chaotic so far" if chaos ended in any start's run or may not last."""
    if motion is not MotionKind.CHAOTIC:
        return motion
    lasts = escape is not None and escape.escapes == 0 and escape.lifetime_above_s > LASTING_S
    return motion if lasts else MotionKind.CHAOTIC_SO_FAR


def _responses(group: Sequence[ReachedMotion], amplitude_m: float) -> dict[str, float]:
    """Return the responses of the first start if the motion repeats, otherwise their mean over the group."""
    shown = group[:1] if group[0].period is not None else group
    means = np.mean([each.responses_m for each in shown], axis=0) / amplitude_m
    return dict(
        zip(("response_i", "response_ii", "relative_i", "relative_ii"), map(float, means), strict=True)
    )


def _error(group: Sequence[ReachedMotion], error_of: ErrorOf) -> float | None:
    """Return the 95 % limit of the relative difference between a run's responses and their group mean."""
    if group[0].period is not None:
        return error_of(group[0])
    if len(group) < FEWEST_DRAWS:
        # If chaos has bursts, runs from some starts contain no burst: use the largest error.
        known = [each for each in map(error_of, group) if each is not None]
        return max(known, default=None)
    widened = math.sqrt(1.0 + 1.0 / len(group)) * student_quantile(len(group) - 1, COVERED)
    return widened * (_deviation([each.responses_m[0] for each in group]) or 0.0)


def _deviation(values: Sequence[float]) -> float | None:
    """Return the standard deviation of values divided by their mean; None for a single value."""
    return float(np.std(values, ddof=1) / np.mean(values)) if len(values) > 1 else None


ALONE = 0.5
"""Share of the budget for integrating chaos further; runs from other starts use the rest of the budget."""


def memory_of(scene: Scene, begin: FollowedRun, seen: SceneRun, motion: LinearMotion) -> StartMemory:
    """Return whether the start determines the final motion.

    Parameters
    ----------
    scene
        Requested scene.
    begin
        The motion at its start.
    seen
        Window and kind of the motion at the end of the run.
    motion
        Linear motion without stops.
    """
    if never_touches(scene.specimen, motion):
        return StartMemory.KEPT
    if seen.grew:
        return StartMemory.LOST
    if scene.budget_s == 0.0 or seen.path[-1].outcome is not Outcome.REACHED_END:
        return StartMemory.UNKNOWN
    return StartMemory.LOST if is_sensitive_to_start(begin, seen.path) else StartMemory.KEPT
