"""Parameters of a specimen from a colliding motion, with bounds.

If the motion can be tracked with the described parameters, they are only refined. Otherwise start values are
found without a contact model: flights give m1, springs and dampers; impacts give gaps. Tracking refines all.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import hypot, isfinite
from typing import ClassVar, TypeGuard

import numpy as np
from scipy.stats import t as student

from ..signals import Reals
from ..tables import Tabular, unit_of, with_unit
from . import _contact_free as contact_free
from ._prepared_motion import PreparedMotion
from ._tracking import LOSS_LIMIT, FilterState, MotionModel, acquire, motion_model, move_filter, run_filter
from ._tracking_model import (
    NEAR,
    PRIOR_SD,
    SEARCHES,
    STATES,
    Hidden,
    StepTables,
    TrackedSpecimen,
    indentation_m,
    scale_of,
    step_tables,
    value_of,
    with_values,
)

_WANDER = 0.02
"""Random walk of parameters per block, relative to their prior sd; prevents overconfidence of the filter."""
REBUILT_S = 0.05
"""Interval at which the filter's tables are updated to the current parameters [s]."""
_LOST = (
    f"during the search for parameters, each track was lost within {REBUILT_S:g} s, so parameters that are "
    "not searched for (m0, m2, k1, kind of contact) may be described wrongly"
)
_SCHEDULE = ((0.1, 3.0), (math.inf, 1.0))
"""Pairs: a length of tracked motion [s], and the factor on the velocity variance up to this length."""
_LEAST_OF_START = 0.05
"""Lower limit of a parameter relative to its start value; only the loss may be negative."""
_FURTHEST = 8.0
"""Deviation of a parameter from its start value [prior standard deviations] at which the search stops."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters estimated from part of a motion."""

    tracked: TrackedSpecimen
    wanted: tuple[Hidden, ...]
    start_values: Reals
    """Start values of the parameter search, shape (parameters,), SI."""
    prior_sd: Reals
    """Prior standard deviations of the parameters, shape (parameters,)."""
    moved: Reals
    """Deviations from the start values in prior standard deviations, shape (parameters,)."""
    covariance: Reals
    """Covariance of the parameters in units of the prior, shape (parameters, parameters)."""
    wandered: float
    """Variance that the random walk added to each parameter, in units of the prior."""
    followed_s: float
    innovation_level: float
    """Mean squared normalised innovation at the end of the motion, with the true noise; 1 for a good fit."""


class _Search:
    """Search for parameters.

    ``relative_sd`` has the prior standard deviation of each wanted parameter relative to ``start``.
    """

    def __init__(
        self, start: TrackedSpecimen, motion: PreparedMotion, relative_sd: Mapping[Hidden, float]
    ) -> None:
        self._described, self._motion, self._wanted = start, motion, tuple(relative_sd)
        wanted = self._wanted
        self._nominal = np.array([value_of(start, each) for each in wanted])
        scale = np.array([scale_of(start, each) for each in wanted])
        self._prior_sd = np.array(list(relative_sd.values())) * scale
        self._deviation = np.array([SEARCHES[each].step for each in wanted]) * scale
        self._least = np.where(np.array(wanted) == Hidden.LOSS, -np.inf, _LEAST_OF_START * self._nominal)
        # Forces and gaps differ by six powers of ten, so the covariance is in units of the prior.
        self._values, self._covariance = self._nominal.copy(), np.eye(len(wanted))
        self._followed, self._level = 0, math.nan

    def track(self, first: int, stop: int) -> Estimate | str:
        """Estimate parameters from the motion between two samples; restart after every loss of the track.

        On failure, return the reason as a sentence.
        """
        rate = self._motion.sample_rate_hz
        block = round(REBUILT_S * rate)
        at: FilterState | None = None
        looked, why = first, ""
        while looked + block < stop:
            model = motion_model(self._current(), self._motion)
            if at is None:
                inflated = replace(model, velocity_variance=self._inflation() * model.velocity_variance)
                begun = acquire(inflated, self._motion, looked)
                match begun:
                    case str():
                        # Report the first failure: the last failure only means that the record ended.
                        why, looked = why or begun, looked + block
                        continue
                    case FilterState():
                        at = self._with_parameters(begun)
            before = at.sample
            is_kept = self._block(model, at, min(block, stop - 1 - at.sample))
            if is_kept:
                self._values = np.maximum(self._values + at.state[STATES:] * self._prior_sd, self._least)
                self._covariance = at.covariance[STATES:, STATES:].copy()
                self._followed += at.sample - before
                at.state[STATES:] = 0.0
                looked = at.sample
                if np.any(np.abs(self._values - self._nominal) > _FURTHEST * self._prior_sd):
                    return self._ran_away()
            else:
                self._covariance = np.diag(np.minimum(4.0 * np.diag(self._covariance), 1.0))
                looked, at = at.sample, None
                why = why or _LOST
        if not self._followed:
            return why or "the motion was too short to begin a track"
        return Estimate(
            self._current(),
            self._wanted,
            self._nominal,
            self._prior_sd,
            (self._values - self._nominal) / self._prior_sd,
            self._covariance,
            _WANDER**2 * self._followed / block,
            self._followed / rate,
            self._level,
        )

    def _current(self) -> TrackedSpecimen:
        return with_values(self._described, dict(zip(self._wanted, map(float, self._values), strict=True)))

    def _inflation(self) -> float:
        followed_s = self._followed / self._motion.sample_rate_hz
        return next(factor for until_s, factor in _SCHEDULE if followed_s < until_s)

    def _with_parameters(self, begun: FilterState) -> FilterState:
        size = STATES + len(self._wanted)
        covariance = np.zeros((size, size))
        covariance[:STATES, :STATES] = begun.covariance
        covariance[STATES:, STATES:] = self._covariance
        return FilterState(
            begun.sample, np.concatenate([begun.state, np.zeros(len(self._wanted))]), covariance
        )

    def _variants(self) -> list[StepTables]:
        current = self._current()
        raised = [
            with_values(current, {each: float(self._values[n] + self._deviation[n])})
            for n, each in enumerate(self._wanted)
        ]
        rate, coupling = self._motion.sample_rate_hz, self._motion.coupling_rad_per_s
        return [step_tables(each, rate, coupling) for each in (current, *raised)]

    def _block(self, model: MotionModel, at: FilterState, count: int) -> bool:
        """Filter the next ``count`` samples; return False if the track was lost."""
        size = STATES + len(self._wanted)
        noise = np.zeros((size, size))
        noise[:STATES, :STATES] = model.step_noise
        at.covariance[STATES:, STATES:] += _WANDER**2 * np.eye(len(self._wanted))
        inflation = self._inflation()
        at.innovation_level = 1.0
        done = move_filter(
            self._variants(),
            self._motion,
            at,
            count,
            noise=noise,
            velocity_variance=inflation * model.velocity_variance,
            loss_limit=LOSS_LIMIT,
            deviations=self._deviation / self._prior_sd,
        )
        self._level = at.innovation_level if inflation == 1.0 else self._level
        return bool(done == count)

    def _ran_away(self) -> str:
        worst = int(np.argmax(np.abs(self._values - self._nominal) / self._prior_sd))
        what = self._wanted[worst].value
        return (
            f"the search for {what} ended at {self._values[worst]:.3g}, far from the described "
            f"{self._nominal[worst]:.3g}, so other parameters of the specimen do not fit this recording"
        )


# Start values without a contact model, if the motion cannot be tracked with the description. Flights give m1,
# springs and dampers; positions at impacts give the gaps; speeds at impacts give the loss.

_TELLING_LOSS = 0.15
"""Smallest loss [s/m] that speeds at impacts determine more accurately than the description does."""
_LAW_UNKNOWN = 0.3
"""Relative error of a penetration depth computed with the described contact law."""
_FREE_S = 3.0


def search_start(
    described: TrackedSpecimen, motion: PreparedMotion, firsts: list[int]
) -> tuple[TrackedSpecimen, Mapping[Hidden, float] | str]:
    """Return start values found without a contact model, and their prior, or else the reason."""
    rate = motion.sample_rate_hz
    fitted, sds = contact_free.free_numbers(described, motion, firsts)
    count = min(round(_FREE_S * rate), motion.samples)
    first = (motion.samples - count) // 2
    free = contact_free.free_motion(motion_model(fitted, motion), motion.part(first, first + count))
    gaps = contact_free.free_gaps(free.impacts)
    if not any(gaps):
        gaps = _gaps_by_law(fitted, free.impacts)
    if not any(gaps):
        count = free.impacts.samples.size
        seen = f"the {count} impacts found do not determine a gap" if count else "no impacts were found"
        return fitted, (
            f"{seen} without a contact model, so m1 hardly reached its stops, or stayed at one stop, or "
            "the linear parameters of the specimen are wrong; fit these parameters to weak noise first"
        )
    sides = dict(zip((Hidden.LOWER_GAP, Hidden.UPPER_GAP), gaps, strict=True))
    known: dict[Hidden, contact_free.FreeGap] = {
        side: gap for side, gap in sides.items() if gap is not None and isfinite(value_of(described, side))
    }
    start = with_values(fitted, {side: gap.value_m for side, gap in known.items()})
    loss = contact_free.free_loss(free.impacts)
    if loss is not None and loss > _TELLING_LOSS:
        start = with_values(start, {Hidden.LOSS: loss})
    near = {**NEAR, Hidden.FORCE: 0.25, Hidden.EXPONENT: 0.05, Hidden.LOSS: 0.1}
    near |= {side: gap.sd_m / gap.value_m for side, gap in known.items()}
    near |= {
        each: max(SEARCHES[each].least_sd, 3.0 * float(sd))
        for each, sd in zip(contact_free.FITTED, sds, strict=True)
    }
    return start, searched_parameters(described, near)


def searched_parameters(described: TrackedSpecimen, near: Mapping[Hidden, float]) -> dict[Hidden, float]:
    """Return ``near`` without the gap on a side for which no stop is described."""
    return {each: sd for each, sd in near.items() if isfinite(value_of(described, each))}


def _gaps_by_law(
    described: TrackedSpecimen, impacts: contact_free.FreeImpacts
) -> tuple[contact_free.FreeGap | None, contact_free.FreeGap | None]:
    """Return the gaps from impacts of similar strength: |p| minus the depth that the described law gives."""

    def gap(side: float) -> contact_free.FreeGap | None:
        here = impacts.sides == side
        if int(here.sum()) < contact_free.FEWEST_IMPACTS:
            return None
        depth_m = indentation_m(described, float(np.median(impacts.rate_before[here])))
        value_m = float(np.median(np.abs(impacts.p[here]))) - depth_m
        return contact_free.FreeGap(value_m, _LAW_UNKNOWN * depth_m, int(here.sum()))

    return gap(-1.0), gap(1.0)


_STRETCH_S = 1.2
"""Length of the part of the motion in which each restart searches for parameters [s]."""
_FEWEST_RESTARTS, _MOST_RESTARTS = 3, 4
"""Smallest and largest number of restarts; in a short motion, restarts differ only in start values."""
_TRIAL_S = 0.25
_TRIALS = 3
_FITTING_LEVEL = 1.6
"""If a track's mean squared innovation is at most this, the described parameters are only refined."""
_GAP_SHIFTS = (-1.5, 1.5, -3.0, 3.0)
"""Shifts [standard deviations] of gaps found without a contact model, tried if tracking fails."""
_LARGEST_SD = 0.5
"""Largest standard deviation of a determined parameter, in standard deviations of the described value."""
_WIDE = 3.0
"""Standard deviation of the wide prior, in standard deviations of the described value."""
_FAR = 3.0
"""Largest standard deviation of a determined parameter, in standard deviations of the narrow prior."""
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
"""Shift of start values in prior standard deviations; the influence of start values shows as scatter."""


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
    first_look = _Search(start, motion, near).track(*stretches[len(stretches) // 2])
    if isinstance(first_look, Estimate):
        start = first_look.tracked
    found = _refine(described, motion, start, near)
    for shift in () if isinstance(found, FoundSpecimen) else _GAP_SHIFTS:
        # Shift both gaps by the same number of standard deviations, because both have the same error.
        gaps = (each for each in (Hidden.LOWER_GAP, Hidden.UPPER_GAP) if each in near)
        moved = with_values(start, {each: value_of(start, each) * (1 + shift * near[each]) for each in gaps})
        looks = (_Search(moved, motion, near).track(*each) for each in stretches[:2])
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
        # If the shifted values fail, start from the unshifted values, then from the latest result.
        for begin in (_apart(start, near, number), start, *(each.tracked for each in good[-1:])):
            answer = _Search(begin, motion, near).track(first, stop)
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
    """Return the mean of restarts and its bounds, from the larger of scatter and claimed uncertainty.

    Restarts over the same samples are not independent: their scatter shows the influence of start values.
    A scatter above the claimed uncertainty shows a wrong model; for few restarts, it is itself uncertain.
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
    # Because of the random walk, the variance of a well determined parameter is too large; the variance of a
    # weakly determined parameter is right.
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
            known = run.nis[~np.isnan(run.nis)]
            good += run.states.shape[0] == left and float(np.sum(known)) < _FITTING_LEVEL * known.size
    return 2 * good > len(firsts)
