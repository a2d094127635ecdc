"""Estimate gaps, m1, springs, dampers and contact law while the motion is tracked.

The parameters are constant states of the filter. At first the filter assumes a larger velocity noise, so that
it keeps the track even with wrong parameters. After 0.1 s of tracked motion it uses the true noise.
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
"""Random walk of parameters per block, relative to their prior sd; avoids overconfidence of the filter."""
REBUILT_S = 0.05
"""Interval at which the filter's tables are updated to the current parameters [s]."""
_LOST = (
    f"during the search for parameters, each track was lost within {REBUILT_S:g} s, so values that are not "
    "searched (m0, m2, k1, kind of contact) may be described wrongly"
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
    """Mean squared normalised innovation at the end of the motion, with the true noise; 1 if good."""


def estimate(
    start: TrackedSpecimen,
    motion: PreparedMotion,
    relative_sd: Mapping[Hidden, float],
    first: int,
    stop: int,
) -> Estimate | str:
    """Estimate parameters from the motion between two samples; on failure, return the reason as a sentence.

    ``relative_sd`` has the prior standard deviation of each wanted parameter relative to ``start``.
    """
    return _Search(start, motion, relative_sd).track(first, stop)


class _Search:
    """State of a search for parameters."""

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
        # The covariance is in units of the prior, because forces and gaps differ by six powers of ten.
        self._values, self._covariance = self._nominal.copy(), np.eye(len(wanted))
        self._followed, self._level = 0, math.nan

    def track(self, first: int, stop: int) -> Estimate | str:
        """Track from ``first`` to ``stop`` and return the estimate; restart after every loss of the track."""
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
                        # Report why the first start failed: the last one fails only because the record ends.
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
        """Filter ``count`` samples; return False if the track was lost."""
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


# Start values without a contact model, if the motion cannot be tracked with the description: m1, springs and
# dampers follow from the flights, gaps from the positions of impacts, the loss from speeds at impacts.

_TELLING_LOSS = 0.15
"""Smallest loss [s/m] that speeds at impacts determine more accurately than the description does."""
_LAW_UNKNOWN = 0.3
"""Relative error of a penetration depth computed with the described contact law."""
_FREE_S = 3.0


def search_start(
    described: TrackedSpecimen, motion: PreparedMotion, firsts: list[int]
) -> tuple[TrackedSpecimen, Mapping[Hidden, float] | str]:
    """Return start values found without a contact model, and their prior; without a prior, the reason."""
    rate = motion.sample_rate_hz
    fitted, sds = free_numbers(described, motion, firsts)
    count = min(round(_FREE_S * rate), motion.samples)
    first = (motion.samples - count) // 2
    free = free_motion(motion_model(fitted, motion), motion.part(first, first + count))
    gaps = free_gaps(free.impacts)
    if not any(gaps):
        gaps = _gaps_by_law(fitted, free.impacts)
    if not any(gaps):
        count = free.impacts.samples.size
        seen = f"the {count} impacts found do not determine a gap" if count else "no impacts were found"
        return fitted, (
            f"{seen} without a contact model, so m1 hardly reached its stops, or stayed at one of them, or "
            "the linear parameters of the specimen are wrong; fit them to weak noise first"
        )
    sides = dict(zip((Hidden.LOWER_GAP, Hidden.UPPER_GAP), gaps, strict=True))
    known: dict[Hidden, FreeGap] = {
        side: gap for side, gap in sides.items() if gap is not None and isfinite(value_of(described, side))
    }
    start = with_values(fitted, {side: gap.value_m for side, gap in known.items()})
    loss = free_loss(free.impacts)
    if loss is not None and loss > _TELLING_LOSS:
        start = with_values(start, {Hidden.LOSS: loss})
    near = {**NEAR, Hidden.FORCE: 0.25, Hidden.EXPONENT: 0.05, Hidden.LOSS: 0.1}
    near |= {side: gap.sd_m / gap.value_m for side, gap in known.items()}
    near |= {
        each: max(SEARCHES[each].least_sd, 3.0 * float(sd)) for each, sd in zip(FITTED, sds, strict=True)
    }
    return start, searched_parameters(described, near)


def searched_parameters(described: TrackedSpecimen, near: Mapping[Hidden, float]) -> dict[Hidden, float]:
    """Return ``near`` without the gap of a side for which no stop is described."""
    return {each: sd for each, sd in near.items() if isfinite(value_of(described, each))}


def _gaps_by_law(described: TrackedSpecimen, impacts: FreeImpacts) -> tuple[FreeGap | None, FreeGap | None]:
    """Return the gaps from impacts of similar strength: |p| minus the depth that the described law gives."""

    def gap(side: float) -> FreeGap | None:
        here = impacts.sides == side
        if int(here.sum()) < FEWEST_IMPACTS:
            return None
        depth_m = indentation_m(described, float(np.median(impacts.rate_before[here])))
        value_m = float(np.median(np.abs(impacts.p[here]))) - depth_m
        return FreeGap(value_m, _LAW_UNKNOWN * depth_m, int(here.sum()))

    return gap(-1.0), gap(1.0)
