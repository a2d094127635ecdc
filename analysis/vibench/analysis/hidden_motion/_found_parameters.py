"""What a colliding motion tells of a specimen: gaps, m1, springs, dampers, law, with bounds.

A description that the motion can be tracked with is only refined. One that it cannot is searched: m1, springs
and dampers from flights, the gaps from where impacts happen, both without a contact model, then everything
by tracking.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import ClassVar, TypeGuard

import numpy as np
from scipy.stats import t as student

from ..signals.arrays import Reals
from ..tables import Labelled, plus_minus, unit_of
from ._estimation import Estimate, estimate, search_start, searched_parameters
from ._filtering import LOSS_LIMIT, FilterState, motion_model, run_filter
from ._parameters import NEAR, PRIOR_SD, SEARCHES, Hidden, scale_of, value_of, with_values
from ._prepared_motion import PreparedMotion
from ._tracking import acquire
from ._tracking_model import TrackedSpecimen

_STRETCH_S = 1.2
"""Length of each restart."""
_FEWEST_RESTARTS, _MOST_RESTARTS = 3, 4
"""Of a short motion they overlap, and differ in where they begin to look."""
_TRIAL_S = 0.25
_TRIALS = 3
_FITTING_LEVEL = 1.6
"""Mean squared innovation of a description that is not searched but refined."""
_GAP_SHIFTS = (-1.5, 1.5, -3.0, 3.0)
"""Standard deviations by which gaps told without a contact model are moved where no track holds with them."""
_TOLD = 0.5
"""Standard deviation over that of a description above which the data say nothing that was not assumed."""
_WIDE = 3.0
"""Prior standard deviations of a description that are put in the place of a narrow prior."""
_FAR = 3.0
"""Standard deviation over the narrow prior's above which a parameter was hardly looked for."""
_SETTLED = 1.0
"""Narrow priors that a value may lie from where the filter looked for it."""
_ROUNDS = 3
_CONFIDENCE = 0.95
_Z = 1.96
_CLOCK_SD = {Hidden.K0: 5e-5, Hidden.K2: 5e-5, Hidden.M1: 5e-5}
"""Relative, of what follows a frequency squared: converters' clocks keep 50 parts in a million, which no
recording of its own can tell."""
_ONE_SIDED_SD = {
    Hidden.LOWER_GAP: 4e-9,
    Hidden.UPPER_GAP: 4e-9,
    Hidden.FORCE: 0.02,
    Hidden.EXPONENT: 1.5e-3,
}
"""Error [SI] that restarts share where m1 meets one stop alone: on 15 random dwells all gaps came out
smaller, by 0.4 to 7 nm, from a cause that was not found."""
_STARTS_APART = 0.3
"""Prior standard deviations by which restarts begin elsewhere: what is not forgotten shows as scatter."""


_SHOWN = {
    Hidden.LOWER_GAP: ("lower gap", 1e6, "µm"),
    Hidden.UPPER_GAP: ("upper gap", 1e6, "µm"),
    Hidden.MEAN_GAP: ("mean gap", 1e6, "µm"),
    Hidden.M1: ("m1", 1e3, "g"),
    Hidden.C1: ("c1", 1e3, "mN s/m"),
    Hidden.K0: ("k0", 1.0, "N/m"),
    Hidden.K2: ("k2", 1.0, "N/m"),
    Hidden.C0: ("c0", 1e3, "mN s/m"),
    Hidden.C2: ("c2", 1e3, "mN s/m"),
    Hidden.FORCE: ("contact force at 1 µm", 1.0, "N"),
    Hidden.EXPONENT: ("contact exponent", 1.0, ""),
    Hidden.LOSS: ("contact loss", 1.0, "s/m"),
}


def with_unit(value: float, half: float, unit: str) -> str:
    """Write a value with half the width of its bounds."""
    shown = plus_minus(value, half)
    return f"({shown}) {unit}".strip() if unit and "±" in shown else f"{shown} {unit}".strip()


@dataclass(frozen=True)
class FoundParameter:
    """One parameter as collisions tell it."""

    OWN_UNITS: ClassVar = dict.fromkeys(("value", "low", "high", "described"), "{0.unit}")

    what: Hidden
    value: float
    low: float
    high: float
    """Bounds of 95 %: restarts over parts of the motion, and what each of them claims."""
    described: float
    not_determined: str = ""
    """Why there is no value, in a sentence; empty where there is one."""

    @property
    def unit(self) -> str:
        """Unit of the values, SI."""
        return unit_of(self.what)

    @property
    def is_determined(self) -> bool:
        """Whether value and bounds mean something."""
        return not self.not_determined

    @property
    def half_width(self) -> float:
        """Half width of the bounds."""
        return 0.5 * (self.high - self.low)

    @property
    def row(self) -> tuple[str, str, str]:
        """Name, value with bounds of 95 % or why there is none, as described."""
        label, factor, unit = _SHOWN[self.what]
        said = self.not_determined and f"not determined: {self.not_determined}"
        value = with_unit(factor * self.value, factor * self.half_width, unit)
        return label, said or value, f"{factor * self.described:.6g} {unit}".strip()


@dataclass(frozen=True, eq=False)
class FoundSpecimen(Labelled):
    """What was found, and the specimen that the motion is tracked with."""

    tracked: TrackedSpecimen
    parameters: tuple[FoundParameter, ...]
    restarts: int
    searched: bool
    """Whether the description could not be tracked with."""


def found_specimen(described: TrackedSpecimen, motion: PreparedMotion) -> FoundSpecimen:
    """Find the parameters that collisions tell."""
    if described.steepness == 0.0:
        return _nothing(described, "the specimen is described without stops")
    if _can_be_tracked(described, motion):
        refined = _refine(described, motion, described, searched_parameters(described, NEAR))
        if isinstance(refined, FoundSpecimen):
            return refined
    stretches = _stretches(motion)
    start, near = search_start(described, motion, [first for first, _ in stretches])
    if isinstance(near, str):
        return _nothing(described, near, searched=True)
    first_look = estimate(start, motion, near, *stretches[len(stretches) // 2])
    if isinstance(first_look, Estimate):
        start = first_look.tracked
    found = _refine(described, motion, start, near)
    for shift in () if isinstance(found, FoundSpecimen) else _GAP_SHIFTS:
        # Move both gaps by the same number of standard deviations: without a contact model they err together.
        gaps = (each for each in (Hidden.LOWER_GAP, Hidden.UPPER_GAP) if each in near)
        moved = with_values(start, {each: value_of(start, each) * (1 + shift * near[each]) for each in gaps})
        looks = (estimate(moved, motion, near, *each) for each in stretches[:2])
        held = next((each for each in looks if _is_held(each, motion)), None)
        again = found if held is None else _refine(described, motion, held.tracked, near)
        if isinstance(again, FoundSpecimen):
            found = again
            break
    return (
        replace(found, searched=True)
        if isinstance(found, FoundSpecimen)
        else replace(_nothing(described, found, searched=True), tracked=start)
    )


def _is_held(answer: Estimate | str, motion: PreparedMotion) -> TypeGuard[Estimate]:
    """Whether a search over a stretch kept its track for half of it."""
    enough_s = 0.5 * min(_STRETCH_S, motion.samples / motion.sample_rate_hz)
    return isinstance(answer, Estimate) and answer.followed_s > enough_s


def _refine(
    described: TrackedSpecimen, motion: PreparedMotion, start: TrackedSpecimen, near: Mapping[Hidden, float]
) -> FoundSpecimen | str:
    """Find parameters near a start, and again from the result while it moves."""
    wanted = tuple(near)
    for _ in range(_ROUNDS):
        good = _restarts(motion, start, near)
        if isinstance(good, str):
            return good
        independent = max(1.0, min(len(good), motion.samples / (_STRETCH_S * motion.sample_rate_hz)))
        found = combine(good, described, independent)
        narrow = np.array([near[each] * scale_of(start, each) for each in wanted])
        is_told = (found.sd < _TOLD * found.assumed) & (found.sd < _FAR * narrow)
        is_beyond = is_told & (found.beyond > _SETTLED * narrow)
        start = with_values(
            start, {each: float(found.values[n]) for n, each in enumerate(wanted) if is_told[n]}
        )
        if not np.any(is_beyond):
            break
    shared = {} if all(map(isfinite, described.specimen.gaps_m)) else _ONE_SIDED_SD
    parameters = tuple(
        _parameter(
            what,
            found.values[n],
            float(np.hypot(found.half[n], _Z * shared.get(what, 0.0))),
            value_of(described, what),
            is_told=bool(is_told[n] and not is_beyond[n]),
        )
        for n, what in enumerate(wanted)
    )
    told = {each.what: each.value for each in parameters if each.is_determined}
    return FoundSpecimen(with_values(start, told), parameters, len(good), searched=False)


def _restarts(
    motion: PreparedMotion, start: TrackedSpecimen, near: Mapping[Hidden, float]
) -> list[Estimate] | str:
    """Search several parts of a motion from different beginnings; a sentence where too few held."""
    stretches = _stretches(motion)
    good: list[Estimate] = []
    refused = ""
    for number, (first, stop) in enumerate(stretches):
        # What does not hold from a start elsewhere is tried from the start itself, and from what was found.
        for begin in (_apart(start, near, number), start, *(each.tracked for each in good[-1:])):
            answer = estimate(begin, motion, near, first, stop)
            if _is_held(answer, motion):
                good.append(answer)
                break
            refused = answer if isinstance(answer, str) else refused
    if 2 * len(good) <= len(stretches) and len(stretches) > 1:
        return (
            refused
            or f"only {len(good)} of {len(stretches)} restarts over parts of the motion held their track"
        )
    if not good:
        return refused or "the track was lost again and again while the parameters were looked for"
    return good


@dataclass(frozen=True, eq=False)
class _Combined:
    """Parameters as the motion alone tells them; all of shape (parameters,), SI."""

    values: Reals
    half: Reals
    """Half the width of the bounds."""
    sd: Reals
    """Standard deviation as the filter claims it, or the scatter."""
    assumed: Reals
    """Standard deviation of a description."""
    beyond: Reals
    """How far the values lie from where the filter looked."""


def combine(found: list[Estimate], described: TrackedSpecimen, independent: float) -> _Combined:
    """Return the mean of restarts, and half the width of its bounds: from the larger of scatter and claims.

    Restarts over the same samples are not independent: their scatter tells what they have not forgotten.
    Scatter beyond what is claimed tells of a model that does not fit, and a few values tell it badly.
    """
    wanted = found[0].wanted
    centre = np.array([value_of(described, each) for each in wanted])
    assumed = np.array([PRIOR_SD[each] * scale_of(described, each) for each in wanted])
    freed = [_without_prior(each, centre, _WIDE * assumed) for each in found]
    values = np.array([each[0] for each in freed])
    claimed = np.sqrt(np.mean([each[1] for each in freed], axis=0))
    half = _Z * np.sqrt(np.mean([each[2] for each in freed], axis=0))
    sd = claimed
    if len(found) > 1:
        scatter = values.std(axis=0, ddof=1)
        few = float(student.ppf(0.5 + 0.5 * _CONFIDENCE, len(found) - 1))
        half = np.maximum(half, np.where(scatter > claimed, few, _Z) * scatter)
        sd = np.maximum(claimed, scatter)
    looked = np.array([each.begun_at + each.prior_sd * each.moved for each in found])
    beyond = np.abs(values.mean(axis=0) - looked.mean(axis=0))
    return _Combined(values.mean(axis=0), half / np.sqrt(independent), sd, assumed, beyond)


def _without_prior(found: Estimate, centre: Reals, wide: Reals) -> tuple[Reals, Reals, Reals]:
    """Take back that parameters were looked for near the start alone: values, claimed and likely variances.

    The filter weighs the motion against a narrow prior, without which it loses its track. What a motion tells
    weakly would stay where the description put it, with bounds as narrow as the prior. In units of that
    prior the motion's own information is J = P^-1 - 1; with a wide prior in its place nothing is held back.
    """
    size = len(found.wanted)
    inverse = np.linalg.inv(found.covariance)
    rates, directions = np.linalg.eigh(inverse - np.eye(size))
    information = (directions * np.maximum(rates, 0.0)) @ directions.T
    weak = np.diag((found.prior_sd / wide) ** 2)
    freed = np.linalg.inv(information + weak)
    pull = weak @ ((centre - found.begun_at) / found.prior_sd)
    moved = freed @ (inverse @ found.moved + pull)
    variance = np.diag(freed)
    # A parameter that wanders is better known than it claims once wandering is all that it does not know;
    # one that is hardly determined states honest bounds, which wandering would widen.
    wandering = found.wandered / (found.wandered + np.diag(found.covariance))
    part = np.array([SEARCHES[each].claimed for each in found.wanted])
    likely = variance * (1.0 - (1.0 - part**2) * wandering) + (found.wandered * variance * moved) ** 2
    scale = found.prior_sd**2
    return found.begun_at + found.prior_sd * moved, variance * scale, likely * scale


def _parameter(what: Hidden, value: float, half: float, described: float, *, is_told: bool) -> FoundParameter:
    why = "" if is_told else "told by this motion no better than was assumed"
    half = float(np.hypot(half, _Z * _CLOCK_SD.get(what, 0.0) * value))
    return FoundParameter(what, float(value), float(value - half), float(value + half), described, why)


def _nothing(described: TrackedSpecimen, why: str, *, searched: bool = False) -> FoundSpecimen:
    nan, wanted = float("nan"), searched_parameters(described, PRIOR_SD)
    parameters = tuple(FoundParameter(each, nan, nan, nan, value_of(described, each), why) for each in wanted)
    return FoundSpecimen(described, parameters, 0, searched)


def without_values(found: FoundSpecimen, why: str) -> FoundSpecimen:
    """Return what was found without its values, of which ``why`` says that they are not the specimen's."""
    nan = float("nan")
    parameters = tuple(
        each if each.not_determined else replace(each, value=nan, low=nan, high=nan, not_determined=why)
        for each in found.parameters
    )
    return replace(found, parameters=parameters)


def _stretches(motion: PreparedMotion) -> list[tuple[int, int]]:
    """Spread the restarts evenly over the motion."""
    length = min(round(_STRETCH_S * motion.sample_rate_hz), motion.samples)
    number = min(_MOST_RESTARTS, max(_FEWEST_RESTARTS, motion.samples // length))
    firsts = np.linspace(0, motion.samples - length, number).astype(int)
    return [(int(each), int(each) + length) for each in firsts]


def _apart(start: TrackedSpecimen, near: Mapping[Hidden, float], number: int) -> TrackedSpecimen:
    """Begin each restart elsewhere, in a fixed pattern of signs."""
    sign = {each: 1.0 if (number >> (place % 2)) % 2 else -1.0 for place, each in enumerate(near)}
    return with_values(
        start,
        {
            each: value_of(start, each) + _STARTS_APART * sd * sign[each] * scale_of(start, each)
            for each, sd in near.items()
        },
    )


def _can_be_tracked(tracked: TrackedSpecimen, motion: PreparedMotion) -> bool:
    """Try short stretches with the numbers as they are."""
    model = motion_model(tracked, motion)
    count = round(_TRIAL_S * motion.sample_rate_hz)
    firsts = np.linspace(0, max(0, motion.samples - 2 * count), _TRIALS).astype(int)
    good = 0
    for first in firsts:
        begun = acquire(model, motion, int(first))
        match begun:
            case FilterState():
                left = min(count, motion.samples - 1 - begun.sample)
                run = run_filter(model, motion, begun, left, loss_limit=LOSS_LIMIT)
                good += run.states.shape[0] == left and float(np.nanmean(run.squared)) < _FITTING_LEVEL
            case str():
                pass
    return 2 * good > len(firsts)
