"""Gaps, m1, springs, dampers and contact law, found while the motion is tracked: a filter with parameters.

The parameters are states that do not change. The filter begins with the channels' noise taken as many times
larger, so that a wrong parameter costs the track little, and the noise is brought down while they are found.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from ..signals.arrays import Reals
from ._contact_free import (
    FEWEST_IMPACTS,
    FITTED,
    FreeGap,
    FreeImpacts,
    free_gaps,
    free_loss,
    free_motion,
    free_numbers,
)
from ._filtering import LOSS_LIMIT, FilterState, MotionModel, motion_model, move_filter
from ._parameters import NEAR, SEARCHES, Hidden, scale_of, value_of, with_values
from ._prepared_motion import PreparedMotion
from ._tracking import acquire
from ._tracking_model import STATES, StepTables, TrackedSpecimen, indentation_m, step_tables

_WANDER = 0.02
"""Of the prior standard deviation, in every block: a parameter that is sure of itself too early moves on."""
REBUILT_S = 0.05
"""After this length of motion the tables are those of the parameters found so far."""
_LOST = (
    f"each track was lost within {REBUILT_S:g} s while the numbers were looked for, so that what is taken as "
    "described (m0, m2, k1, the kind of contact) may be otherwise"
)
_SCHEDULE = ((0.1, 3.0), (math.inf, 1.0))
"""Length of tracked motion, and the factor of the velocity's variance until then."""
_LEAST_OF_START = 0.05
"""No parameter falls below this part of what it began with: none of them can be negative, but the loss,
whose error goes both ways around none."""
_FURTHEST = 8.0
"""Prior standard deviations from the description at which the search is given up."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters at the end of a stretch of motion."""

    tracked: TrackedSpecimen
    wanted: tuple[Hidden, ...]
    begun_at: Reals
    """Where the search began, shape (parameters,), SI."""
    prior_sd: Reals
    """How far from there they were looked for, shape (parameters,)."""
    moved: Reals
    """How far from there they are, in prior standard deviations, shape (parameters,)."""
    covariance: Reals
    """As the filter claims it, in prior standard deviations, shape (parameters, parameters)."""
    wandered: float
    """Variance that was added to each parameter on the way, in the same units."""
    followed_s: float
    innovation_level: float
    """Mean squared normalised innovation of the last part, at the channels' own noise; 1 for a good model."""


def estimate(
    start: TrackedSpecimen,
    motion: PreparedMotion,
    relative_sd: Mapping[Hidden, float],
    first: int,
    stop: int,
) -> Estimate | str:
    """Find parameters between two samples of a motion; a sentence where they are not told.

    ``relative_sd`` names them, and says how far from ``start`` they may be.
    """
    return _Search(start, motion, relative_sd).over(first, stop)


class _Search:
    """Parameters on their way."""

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
        # In units of the prior standard deviations: forces and gaps differ by six powers of ten.
        self._values, self._covariance = self._nominal.copy(), np.eye(len(wanted))
        self._followed, self._level = 0, math.nan

    def over(self, first: int, stop: int) -> Estimate | str:
        """Track from one sample to another, and begin again after every loss."""
        rate = self._motion.sample_rate_hz
        block = round(REBUILT_S * rate)
        at: FilterState | None = None
        looked, why = first, ""
        while looked + block < stop:
            model = motion_model(self._current(), self._motion)
            if at is None:
                begun = acquire(self._inflated(model), self._motion, looked)
                match begun:
                    case str():
                        # The first reason: the last one is that the motion ends.
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
            return why or "the motion was too short to begin a track in"
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

    def _inflated(self, model: MotionModel) -> MotionModel:
        return replace(model, velocity_variance=self._inflation() * model.velocity_variance)

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
        """Filter some samples; says whether the track held."""
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
            f"{what} ran to {self._values[worst]:.3g}, far from the {self._nominal[worst]:.3g} described, so "
            "the specimen's other numbers do not fit this recording"
        )


# Where a search begins that cannot begin at the description: without a contact model.
#
# m1, springs and dampers from flights, gaps and loss from where impacts happen and how fast they end.

_TELLING_LOSS = 0.15
"""Loss [s/m] from which speeds without a contact model tell more than a description."""
_LAW_UNKNOWN = 0.3
"""Part of a depth by the described law, which may be another."""
_FREE_S = 3.0


def search_start(
    described: TrackedSpecimen, motion: PreparedMotion, firsts: list[int]
) -> tuple[TrackedSpecimen, Mapping[Hidden, float] | str]:
    """Find a start without a contact model, and how far from it to look; a sentence where there is none."""
    rate = motion.sample_rate_hz
    numbers = free_numbers(described, motion, firsts)
    count = min(round(_FREE_S * rate), motion.samples)
    first = (motion.samples - count) // 2
    told = free_motion(motion_model(numbers.tracked, motion), motion.part(first, first + count))
    gaps = free_gaps(told.impacts)
    if not any(gaps):
        gaps = _gaps_by_law(numbers.tracked, told.impacts)
    if not any(gaps):
        count = told.impacts.samples.size
        seen = f"{count} impacts that were found tell no gap" if count else "no impacts were found"
        return numbers.tracked, (
            f"{seen} without a contact model, so m1 hardly reached its stops in this motion or stayed at one "
            "of them, or the specimen's linear numbers are wrong; fit them to weak noise first"
        )
    sides = dict(zip((Hidden.LOWER_GAP, Hidden.UPPER_GAP), gaps, strict=True))
    known: dict[Hidden, FreeGap] = {
        side: gap for side, gap in sides.items() if gap is not None and isfinite(value_of(described, side))
    }
    start = with_values(numbers.tracked, {side: gap.value_m for side, gap in known.items()})
    loss = free_loss(told.impacts)
    if loss is not None and loss > _TELLING_LOSS:
        start = with_values(start, {Hidden.LOSS: loss})
    near = {**NEAR, Hidden.FORCE: 0.25, Hidden.EXPONENT: 0.05, Hidden.LOSS: 0.1}
    near |= {side: gap.sd_m / gap.value_m for side, gap in known.items()}
    near |= {
        each: max(SEARCHES[each].least_sd, 3.0 * float(sd))
        for each, sd in zip(FITTED, numbers.sd, strict=True)
    }
    return start, searched_parameters(described, near)


def searched_parameters(described: TrackedSpecimen, near: Mapping[Hidden, float]) -> dict[Hidden, float]:
    """Leave out the gap of a side on which no stop is described."""
    return {each: sd for each, sd in near.items() if isfinite(value_of(described, each))}


def _gaps_by_law(described: TrackedSpecimen, impacts: FreeImpacts) -> tuple[FreeGap | None, FreeGap | None]:
    """Return gaps where impacts are all alike: |p| there, less the depth that the described law has."""

    def gap(side: float) -> FreeGap | None:
        here = impacts.sides == side
        if int(here.sum()) < FEWEST_IMPACTS:
            return None
        depth_m = indentation_m(described, float(np.median(impacts.rate_before[here])))
        value_m = float(np.median(np.abs(impacts.p[here]))) - depth_m
        return FreeGap(value_m, _LAW_UNKNOWN * depth_m, int(here.sum()))

    return gap(-1.0), gap(1.0)
