"""Parameters of a specimen from a colliding motion, with bounds.

If the motion can be tracked with the described parameters, these are only refined. Otherwise start values are
found without a contact model: flights give m1, springs and dampers; impacts give gaps. Tracking refines all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import hypot, isfinite
from typing import ClassVar, TypeGuard

import numpy as np
from scipy.stats import t as student

from ..signals.arrays import Reals
from ..tables import Tabular, plus_minus, unit_of
from ._estimation import Estimate, estimate, search_start, searched_parameters
from ._filtering import LOSS_LIMIT, FilterState, motion_model, run_filter
from ._parameters import NEAR, PRIOR_SD, SEARCHES, Hidden, scale_of, value_of, with_values
from ._prepared_motion import PreparedMotion
from ._tracking import acquire
from ._tracking_model import TrackedSpecimen

_STRETCH_S = 1.2
"""Length of the part of the motion in which each restart searches for parameters [s]."""
_FEWEST_RESTARTS, _MOST_RESTARTS = 3, 4
"""Smallest and largest number of restarts; in a short motion, restarts differ only in start values."""
_TRIAL_S = 0.25
_TRIALS = 3
_FITTING_LEVEL = 1.6
"""The described parameters are only refined if a track's mean squared innovation is at most this."""
_GAP_SHIFTS = (-1.5, 1.5, -3.0, 3.0)
"""Shifts [standard deviations] of gaps found without a contact model, tried if tracking fails."""
_LARGEST_SD = 0.5
"""Largest standard deviation of a determined parameter, relative to that of the described value."""
_WIDE = 3.0
"""Standard deviation of the wide prior relative to that of the described value."""
_FAR = 3.0
"""Largest standard deviation of a determined parameter, relative to that of the narrow prior."""
_SETTLED = 1.0
"""Largest change of a value if the narrow prior is removed, in standard deviations of this prior."""
_ROUNDS = 3
_CONFIDENCE = 0.95
_Z = 1.96
_CLOCK_SD = {Hidden.K0: 5e-5, Hidden.K2: 5e-5, Hidden.M1: 5e-5}
"""Relative standard error of a squared frequency due to the unknown clock error of up to 50 ppm."""
_COARSE_HZ = 12_800.0
_GAPS = (Hidden.LOWER_GAP, Hidden.UPPER_GAP, Hidden.MEAN_GAP)
_COARSE_SD = {Hidden.C0: 5e-4, Hidden.C1: 1.5e-2, Hidden.C2: 1e-3, **dict.fromkeys(_GAPS, 2e-4)}
"""Relative systematic error at 12.8 kHz, at which a contact lasts about a sample; the error is proportional
to the squared sample interval."""
_ONE_SIDED_SD = {
    Hidden.LOWER_GAP: 4e-9,
    Hidden.UPPER_GAP: 4e-9,
    Hidden.FORCE: 0.02,
    Hidden.EXPONENT: 1.5e-3,
}
"""Systematic error [SI] if m1 strikes one stop only. On 15 random dwells, all gaps were 0.4 to 7 nm too
small, for an unknown reason."""
_STARTS_APART = 0.3
"""Shift of start values in prior standard deviations, so that their influence shows as scatter."""


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
    """Return a value with the half width of its bounds as text."""
    shown = plus_minus(value, half)
    return f"({shown}) {unit}".strip() if unit and "±" in shown else f"{shown} {unit}".strip()


@dataclass(frozen=True)
class FoundParameter:
    """One parameter found from collisions."""

    OWN_UNITS: ClassVar = dict.fromkeys(("value", "low", "high", "described"), "{0.unit}")

    what: Hidden
    value: float
    low: float
    high: float
    """95 % bounds from the scatter of restarts and the uncertainty of each restart."""
    described: float
    not_determined: str = ""
    """Reason why the value is missing; empty if there is a value."""

    @property
    def unit(self) -> str:
        """Unit of the value and its bounds, SI."""
        return unit_of(self.what)

    @property
    def is_determined(self) -> bool:
        """Return whether the parameter has a value and bounds."""
        return not self.not_determined

    @property
    def half_width(self) -> float:
        """Half width of the bounds."""
        return 0.5 * (self.high - self.low)

    @property
    def row(self) -> tuple[str, str, str]:
        """Name, value with 95 % bounds (or why it is not determined), and described value."""
        label, factor, unit = _SHOWN[self.what]
        reason = self.not_determined and f"not determined: {self.not_determined}"
        value = with_unit(factor * self.value, factor * self.half_width, unit)
        return label, reason or value, f"{factor * self.described:.6g} {unit}".strip()


@dataclass(frozen=True, eq=False)
class FoundSpecimen(Tabular):
    """Parameters found from collisions, and the specimen for tracking."""

    tracked: TrackedSpecimen
    parameters: tuple[FoundParameter, ...]
    restarts: int
    searched: bool
    """Whether parameters were searched for because tracking with the description failed."""


def found_specimen(described: TrackedSpecimen, motion: PreparedMotion) -> FoundSpecimen:
    """Return the parameters that collisions determine, and the specimen for tracking."""
    if described.steepness == 0.0:
        return _undetermined(described, "the specimen is described without stops")
    if _can_be_tracked(described, motion):
        refined = _refine(described, motion, described, searched_parameters(described, NEAR))
        if isinstance(refined, FoundSpecimen):
            return refined
    stretches = _stretches(motion)
    start, near = search_start(described, motion, [first for first, _ in stretches])
    if isinstance(near, str):
        return _undetermined(described, near, searched=True)
    first_look = estimate(start, motion, near, *stretches[len(stretches) // 2])
    if isinstance(first_look, Estimate):
        start = first_look.tracked
    found = _refine(described, motion, start, near)
    for shift in () if isinstance(found, FoundSpecimen) else _GAP_SHIFTS:
        # Shift both gaps by the same number of standard deviations, because their errors are common.
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
        else replace(_undetermined(described, found, searched=True), tracked=start)
    )


def _is_held(answer: Estimate | str, motion: PreparedMotion) -> TypeGuard[Estimate]:
    """Return whether a search tracked the motion for at least half of the searched part."""
    enough_s = 0.5 * min(_STRETCH_S, motion.samples / motion.sample_rate_hz)
    return isinstance(answer, Estimate) and answer.followed_s > enough_s


def _refine(
    described: TrackedSpecimen, motion: PreparedMotion, start: TrackedSpecimen, near: Mapping[Hidden, float]
) -> FoundSpecimen | str:
    """Find parameters near start values; restart from the result until convergence."""
    wanted = tuple(near)
    for _ in range(_ROUNDS):
        good = _restarts(motion, start, near)
        if isinstance(good, str):
            return good
        independent = max(1.0, min(len(good), motion.samples / (_STRETCH_S * motion.sample_rate_hz)))
        found = combine(good, described, independent)
        narrow = np.array([near[each] * scale_of(start, each) for each in wanted])
        is_determined = (found.sd < _LARGEST_SD * found.assumed) & (found.sd < _FAR * narrow)
        is_beyond = is_determined & (found.beyond > _SETTLED * narrow)
        start = with_values(
            start, {each: float(found.values[n]) for n, each in enumerate(wanted) if is_determined[n]}
        )
        if not np.any(is_beyond):
            break
    shared = {} if all(map(isfinite, described.specimen.gaps_m)) else _ONE_SIDED_SD
    coarse = (_COARSE_HZ / motion.sample_rate_hz) ** 2

    def parameter(n: int, what: Hidden) -> FoundParameter:
        value, is_known = float(found.values[n]), bool(is_determined[n] and not is_beyond[n])
        why = "" if is_known else "this motion gives no narrower bounds than the description"
        relative = hypot(_CLOCK_SD.get(what, 0.0), coarse * _COARSE_SD.get(what, 0.0))
        half = hypot(found.half[n], _Z * shared.get(what, 0.0), _Z * relative * value)
        return FoundParameter(what, value, value - half, value + half, value_of(described, what), why)

    parameters = tuple(parameter(n, what) for n, what in enumerate(wanted))
    values = {each.what: each.value for each in parameters if each.is_determined}
    return FoundSpecimen(with_values(start, values), parameters, len(good), searched=False)


def _restarts(
    motion: PreparedMotion, start: TrackedSpecimen, near: Mapping[Hidden, float]
) -> list[Estimate] | str:
    """Search for parameters in several parts of a motion; return a reason if too few could be tracked."""
    stretches = _stretches(motion)
    good: list[Estimate] = []
    refused = ""
    for number, (first, stop) in enumerate(stretches):
        # If the shifted start values fail, try the unshifted values, then the result of the latest restart.
        for begin in (_apart(start, near, number), start, *(each.tracked for each in good[-1:])):
            answer = estimate(begin, motion, near, first, stop)
            if _is_held(answer, motion):
                good.append(answer)
                break
            refused = answer if isinstance(answer, str) else refused
    if 2 * len(good) <= len(stretches) and len(stretches) > 1:
        return (
            refused
            or f"only {len(good)} of {len(stretches)} parts of the motion could be tracked in the search"
        )
    if not good:
        return refused or "the track was lost repeatedly during the search for parameters"
    return good


@dataclass(frozen=True, eq=False)
class _CombinedEstimate:
    """Parameters that the motion determines without the prior; all arrays of shape (parameters,), SI."""

    values: Reals
    half: Reals
    """Half width of the bounds of each value."""
    sd: Reals
    """Larger of the filter's standard deviation and the scatter of restarts."""
    assumed: Reals
    """Standard deviation of the described values."""
    beyond: Reals
    """Change of each value if the narrow prior is removed."""


def combine(found: list[Estimate], described: TrackedSpecimen, independent: float) -> _CombinedEstimate:
    """Return the mean of restarts and its half width; the larger of scatter and claimed uncertainty counts.

    Restarts over the same samples are not independent: their scatter shows the influence of start values.
    A scatter above the claimed uncertainty shows a wrong model, and is itself uncertain for few restarts.
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
    looked = np.array([each.start_values + each.prior_sd * each.moved for each in found])
    beyond = np.abs(values.mean(axis=0) - looked.mean(axis=0))
    return _CombinedEstimate(values.mean(axis=0), half / np.sqrt(independent), sd, assumed, beyond)


def _without_prior(found: Estimate, centre: Reals, wide: Reals) -> tuple[Reals, Reals, Reals]:
    """Replace the narrow prior by a wide one; return values, and their claimed and likely variances.

    The filter needs a narrow prior to keep its track. With this prior, weakly determined parameters would
    stay at the description, with bounds as narrow as the prior. In units of the narrow prior, the information
    in the motion is J = P^-1 - 1.
    """
    size = len(found.wanted)
    inverse = np.linalg.inv(found.covariance)
    rates, directions = np.linalg.eigh(inverse - np.eye(size))
    information = (directions * np.maximum(rates, 0.0)) @ directions.T
    weak = np.diag((found.prior_sd / wide) ** 2)
    freed = np.linalg.inv(information + weak)
    pull = weak @ ((centre - found.start_values) / found.prior_sd)
    moved = freed @ (inverse @ found.moved + pull)
    variance = np.diag(freed)
    # For a well determined parameter, the random walk overstates the variance; for a weakly determined
    # parameter, the variance is right.
    wandering = found.wandered / (found.wandered + np.diag(found.covariance))
    part = np.array([SEARCHES[each].claimed for each in found.wanted])
    likely = variance * (1.0 - (1.0 - part**2) * wandering) + (found.wandered * variance * moved) ** 2
    scale = found.prior_sd**2
    return found.start_values + found.prior_sd * moved, variance * scale, likely * scale


def _undetermined(described: TrackedSpecimen, why: str, *, searched: bool = False) -> FoundSpecimen:
    nan, wanted = float("nan"), searched_parameters(described, PRIOR_SD)
    parameters = tuple(FoundParameter(each, nan, nan, nan, value_of(described, each), why) for each in wanted)
    return FoundSpecimen(described, parameters, 0, searched)


def without_values(found: FoundSpecimen, why: str) -> FoundSpecimen:
    """Return the parameters without their values, with ``why`` as the reason."""
    nan = float("nan")
    parameters = tuple(
        each if each.not_determined else replace(each, value=nan, low=nan, high=nan, not_determined=why)
        for each in found.parameters
    )
    return replace(found, parameters=parameters)


def _stretches(motion: PreparedMotion) -> list[tuple[int, int]]:
    """Return the first and last sample of each restart's part, spread evenly over the motion."""
    length = min(round(_STRETCH_S * motion.sample_rate_hz), motion.samples)
    number = min(_MOST_RESTARTS, max(_FEWEST_RESTARTS, motion.samples // length))
    firsts = np.linspace(0, motion.samples - length, number).astype(int)
    return [(int(each), int(each) + length) for each in firsts]


def _apart(start: TrackedSpecimen, near: Mapping[Hidden, float], number: int) -> TrackedSpecimen:
    """Return the shifted start values of a restart, in a fixed pattern of signs."""
    sign = {each: 1.0 if (number >> (place % 2)) % 2 else -1.0 for place, each in enumerate(near)}
    return with_values(
        start,
        {
            each: value_of(start, each) + _STARTS_APART * sd * sign[each] * scale_of(start, each)
            for each, sd in near.items()
        },
    )


def _can_be_tracked(tracked: TrackedSpecimen, motion: PreparedMotion) -> bool:
    """Return whether short parts of the motion can be tracked with the described parameters."""
    model = motion_model(tracked, motion)
    count = round(_TRIAL_S * motion.sample_rate_hz)
    firsts = np.linspace(0, max(0, motion.samples - 2 * count), _TRIALS).astype(int)
    good = 0
    for first in firsts:
        begun = acquire(model, motion, int(first))
        if isinstance(begun, FilterState):
            left = min(count, motion.samples - 1 - begun.sample)
            run = run_filter(model, motion, begun, left, loss_limit=LOSS_LIMIT)
            good += run.states.shape[0] == left and float(np.nanmean(run.nis)) < _FITTING_LEVEL
    return 2 * good > len(firsts)
