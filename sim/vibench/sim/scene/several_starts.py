"""Motions of a scene from nearly equal starts. SI units.

After transient chaos, chance determines which motion is reached, and when: starts that differ by a millionth
of the gap give random samples. They are followed in rounds until all have settled, chaos is known to last, or
the budget is used up.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..engine.run import Watch
from ..specimen.drive import Harmonic
from ..specimen.outcome import Outcome
from ..specimen.specimen import Specimen
from ..specimen.state import Floats, Y, Z
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
"""Largest change of the start: displacements over the gap, velocities over the gap times 2 pi f."""
SEED = 2025
PARTED = 0.01
"""Relative difference of displacements at which two starts have diverged: ten thousand times their initial
difference."""
TOUCHING = 0.999
"""Ratio of abs(p) to the gap above which m1 may be in contact."""
LEAST_SIZE = 1e-3
"""Smallest size of a motion in the test for divergence, over the gap."""
LEAST_S = 1e-3
"""Smallest assumed cost of following and observing a start [s]."""
TOO_FEW = 4
"""Fewest useful starts."""
LASTING_S = 300.0
"""Mean lifetime above which chaos counts as lasting [s]: ten times the length of the paper's runs."""


@dataclass(frozen=True, eq=False)
class ReachedMotion:
    """Motion reached from one start."""

    run: FollowedRun
    """Run at its end."""
    motion: MotionKind
    period: int | None
    responses_m: Floats
    """Largest x, drive-frequency amplitude of x, and the same for p [m], shape (4,)."""
    scatter: WindowScatter | None
    """Scatter of the largest x between windows, if the motion does not repeat."""
    wandered_until_s: float
    """Last time at which the motion changed from period to period [s]."""
    growth: Growth
    """Growth of a small perturbation; empty if the motion repeats."""


def pushes(specimen: Specimen, drive: Harmonic, count: int, seed: int) -> Floats:
    """Return random small changes of a start, shape (count, 6), in proportion to gap or drive amplitude."""
    gap_m = min(specimen.gaps_m)
    length_m = gap_m if 0.0 < gap_m < math.inf else drive.amplitude_m
    scale = PUSH * length_m * np.repeat([1.0, 2.0 * math.pi * drive.frequency_hz], 3)
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 6)) * scale


def is_sensitive_to_start(begin: FollowedRun, path: Sequence[Stretch]) -> bool:
    """Return whether a run from a slightly different start diverges from a motion.

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
    twin = begin.pushed(pushes(begin.specimen, begin.drive, 1, SEED)[0])
    for stretch in path:
        beside = twin.follow(stretch.end_s, samples=stretch.samples)
        pressed = _pressed(begin.specimen, beside.states) & _pressed(begin.specimen, stretch.states)
        apart_m = np.abs(beside.states[~pressed, :3] - stretch.states[~pressed, :3]).max(initial=0.0)
        if not apart_m < PARTED * size_m:
            return True
    return False


def _pressed(specimen: Specimen, states: Floats) -> NDArray[np.bool_]:
    """Return whether m1 may touch a stop in each state, shape (n, 6); batches extrapolate such states."""
    lower_m, upper_m = (TOUCHING * gap_m for gap_m in specimen.gaps_m)
    p = states[:, Y] - states[:, Z]
    return np.asarray((p >= upper_m) | (p <= -lower_m))


@dataclass(frozen=True)
class Draw:
    """Number, seed and cost limit of the starts."""

    clear: int = CLEAR
    """Number of starts, including the requested one, if they all settle on one motion or chaos lasts."""
    fewest: int = FEWEST
    """Number of starts in other cases."""
    most: int = MOST
    """Number of starts if they reach several motions."""
    seed: int = SEED
    budget_s: float = math.inf
    """Limit of the nominal cost of all starts [s]."""


NOT_CARRIED = Growth(np.empty(0), 0.0)
MORE_S = 1.0
"""Margin added to the remaining total time of all starts [s]."""


class SeveralStarts:
    """Additional starts and their motions.

    Each start is followed at most as long as the scene's duration allows.
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
        # Additional time with a tangent vector, to classify non-repeating motions.
        self._judging_s = min(FEWEST_NEUTRAL * pace.forgetting_s, max(0.0, longest_s - self._window_s))
        self._last_s = max(0.0, longest_s - self._window_s - self._judging_s)
        first_s = longest_s if isinstance(scene.duration, FixedDuration) else pace.settling_s
        # Length of the first round; each later round is twice as long.
        self._first_s = min(first_s, self._last_s)
        changes = pushes(begin.specimen, begin.drive, draw.most - 1, draw.seed)
        self._waiting = [begin.pushed(change) for change in changes]
        self._under_way: list[StatesAlone] = []
        self._reached = [requested]

    @property
    def reached(self) -> tuple[ReachedMotion, ...]:
        """Return the motions of the starts, the requested one first."""
        return tuple(self._reached)

    @property
    def followed_s(self) -> float:
        """Return the total simulated time of all starts [s]."""
        return sum(each.run.time_s for each in self.reached)

    @property
    def escape(self) -> EscapeRate | None:
        """Return the rate at which chaos dies out; None if no motion was irregular for long enough.

        A motion that is still irregular after the expected transient counts as chaotic from then on, until it
        settles. If it has neither settled nor been found chaotic, the time needed to detect repetition is
        subtracted, because it may have left chaos already.
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
        """Follow and observe as many starts as needed, within the budget."""
        run, budget_s = self._reached[0].run, self._draw.budget_s
        each_s = run.cost_s * min(1.0, self._first_s / run.time_s)
        if budget_s < (TOO_FEW - 1) * each_s:
            return
        spent_s = self._follow_some(self._draw.clear - 1, budget_s, each_s)
        if not self._is_clear:
            more = self._draw.fewest - self._draw.clear
            spent_s += self._follow_some(more, budget_s - spent_s, each_s)
        if any(each.period is not None for each in self.reached) and len(motions_among(self.reached)) > 1:
            # The cost of one start determines how many more the budget allows.
            each_s = spent_s / (len(self.reached) - 1)
            more = self._draw.most - self._draw.fewest
            self._follow_some(more, budget_s - spent_s, each_s)

    @property
    def _is_clear(self) -> bool:
        """Return whether all starts reached one motion that is periodic or lasting chaos."""
        settled = all(each.period is not None for each in self._reached)
        return len(motions_among(self._reached)) == 1 and (settled or self._is_lasting)

    def _follow_some(self, wanted: int, budget_s: float, each_s: float) -> float:
        """Follow and observe up to ``wanted`` more starts within a budget; return their cost [s]."""
        count = math.floor(min(float(wanted), max(0.0, budget_s) / max(each_s, LEAST_S)))
        self._under_way = [StatesAlone(run, self._pace) for run in self._waiting[:count]]
        self._waiting = self._waiting[count:]
        self._follow_rounds(budget_s)
        found = [self._observed(each) for each in self._under_way]
        self._under_way = []
        self._reached += [each for each in found if each.run.outcome is Outcome.REACHED_END]
        return sum(each.run.cost_s for each in found)

    @property
    def _cost_s(self) -> float:
        return sum(each.run.cost_s for each in self._under_way)

    @property
    def _is_lasting(self) -> bool:
        """Return whether chaos lasts: no start has settled, and the bound on its lifetime is long enough."""
        escape = self.escape
        return not self._has_settled and escape is not None and escape.lifetime_above_s > LASTING_S

    @property
    def _has_settled(self) -> bool:
        """Return whether any start has reached a repeating motion."""
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
                continue  # Use the remaining budget of other starts.
            if reach_s >= self._last_s:
                return
            lasting_s = reach_s + self._lasting_after_s / len(left)
            reach_s = min(2.0 * reach_s, lasting_s, self._last_s)

    @property
    def _lasting_after_s(self) -> float:
        """Return the simulated time still needed to prove that chaos lasts, if no start settles [s]."""
        escape = self.escape
        if escape is None or self._has_settled:
            return math.inf
        return max(0.0, escape.chaotic_s * (LASTING_S / escape.lifetime_above_s - 1.0)) + MORE_S

    def _observed(self, other: StatesAlone) -> ReachedMotion:
        run = other.run
        if other.repeats is not None:
            period, kind = other.repeats.period, MotionKind.PERIODIC
            begins, end_s = run.apart(), run.time_s + other.repeats.period / self._pace.frequency_hz
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
"""Chaotic motions are different if their windows differ by this multiple of the 95 % limit of the scatter."""


CLEAREST = (MotionKind.PERIODIC, MotionKind.QUASI_PERIODIC, MotionKind.CHAOTIC)
"""Kinds of motion in the order of preference for the start that represents a motion."""


def motions_among(reached: Sequence[ReachedMotion]) -> list[list[ReachedMotion]]:
    """Return the starts grouped by motion; the start that represents a motion is first in its group."""
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
    """Return the kind of a motion reached from several starts.

    In weak or bursting chaos, perturbations of most starts do not grow during the observation. If one start
    proves growth, the total growth of all starts decides.
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
    """Return whether two starts reached the same motion or its symmetric partner.

    Motions are compared by period and all four responses; by responses alone if one start settled too late to
    be classified. For non-repeating motions only Response I is compared, within the scatter between windows;
    chaotic motions that differ by less count as one. Weak chaos may appear undecided or quasi-periodic from
    some starts: if the kinds of two motions differ, the smaller scatter is used.
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
"""Kinds of motion that may still change to another motion."""
FEWEST_DRAWS = 3
"""Fewest starts on a motion for an estimate of its scatter."""

ErrorOf = Callable[[ReachedMotion], float | None]
"""Function that returns the relative error of the responses of a motion; None if unknown."""


def ensemble_of(
    several: SeveralStarts, amplitude_m: float, forgetting_s: float, error_of: ErrorOf
) -> Ensemble:
    """Return the motions reached from all starts, with their shares.

    Parameters
    ----------
    several
        Starts that have been followed and observed.
    amplitude_m
        Drive amplitude.
    forgetting_s
        Time in which the slowest mode without contact decays by e.
    error_of
        Function for the relative error of the responses of a start.
    """
    reached, escape = several.reached, several.escape
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
    """Return the number of starts of each motion, and whether the motion is final.

    If there are several chaotic motions, even lasting chaos is not final: one chaotic motion can change to
    another, and the escape rate counts only changes to periodic motions.
    """
    is_one_chaos = kinds.count(MotionKind.CHAOTIC) == 1
    return [
        Count(count, kind not in PENDING and (kind is not MotionKind.CHAOTIC or is_one_chaos))
        for kind, count in zip(kinds, starts, strict=True)
    ]


def lasting(motion: MotionKind, escape: EscapeRate | None) -> MotionKind:
    """Return the kind of a motion; chaos is "chaotic so far" if it died out from a start or may not last."""
    if motion is not MotionKind.CHAOTIC:
        return motion
    lasts = escape is not None and escape.escapes == 0 and escape.lifetime_above_s > LASTING_S
    return motion if lasts else MotionKind.CHAOTIC_SO_FAR


def _responses(group: Sequence[ReachedMotion], amplitude_m: float) -> dict[str, float]:
    """Return the responses of the first start if the motion repeats, otherwise the mean over starts."""
    shown = group[:1] if group[0].period is not None else group
    means = np.mean([each.responses_m for each in shown], axis=0) / amplitude_m
    return dict(
        zip(("response_i", "response_ii", "relative_i", "relative_ii"), map(float, means), strict=True)
    )


def _error(group: Sequence[ReachedMotion], error_of: ErrorOf) -> float | None:
    """Return the 95 % limit of the relative difference between one more run and the mean of a group."""
    if group[0].period is not None:
        return error_of(group[0])
    if len(group) < FEWEST_DRAWS:
        # The largest error is used, because some starts of bursting chaos contain no burst.
        known = [each for each in map(error_of, group) if each is not None]
        return max(known, default=None)
    widened = math.sqrt(1.0 + 1.0 / len(group)) * student_quantile(len(group) - 1, COVERED)
    return widened * (_deviation([each.responses_m[0] for each in group]) or 0.0)


def _deviation(values: Sequence[float]) -> float | None:
    """Return the standard deviation over the mean; None for a single value."""
    return float(np.std(values, ddof=1) / np.mean(values)) if len(values) > 1 else None


ALONE = 0.5
"""Share of the budget for following chaos further; the rest is for other starts."""


def memory_of(scene: Scene, begin: FollowedRun, seen: SceneRun, motion: LinearMotion) -> StartMemory:
    """Return whether the start determines which motion is reached.

    Parameters
    ----------
    scene
        Requested scene.
    begin
        The motion at its start.
    seen
        Findings at the end of the run.
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
