"""Where a search begins that cannot begin at the description: without a contact model.

m1, springs and dampers from flights, gaps and loss from where impacts happen and how fast they end.
"""

from collections.abc import Mapping
from math import isfinite

import numpy as np

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
from ._filtering import motion_model
from ._parameters import Hidden, value_of, with_values
from ._prepared_motion import PreparedMotion
from ._tracking_model import TrackedSpecimen, indentation_m

NEAR = {
    Hidden.LOWER_GAP: 0.004,
    Hidden.UPPER_GAP: 0.004,
    Hidden.M1: 1e-3,
    Hidden.C1: 0.05,
    Hidden.K0: 1e-4,
    Hidden.K2: 1e-4,
    Hidden.C0: 0.01,
    Hidden.C2: 0.01,
    Hidden.FORCE: 0.1,
    Hidden.EXPONENT: 0.03,
    Hidden.LOSS: 0.03,
}
"""How far from a description that can be tracked its parameters are looked for, relative."""
_LEAST_SD = {
    Hidden.M1: 1e-3,
    Hidden.C1: 0.03,
    Hidden.K0: 3e-4,
    Hidden.K2: 3e-4,
    Hidden.C0: 0.03,
    Hidden.C2: 0.03,
}
_TELLING_LOSS = 0.15
"""Loss [s/m] from which speeds without a contact model tell more than a description."""
_LAW_UNKNOWN = 0.3
"""Of a depth by the described law, which may be another."""
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
    near |= {each: max(_LEAST_SD[each], 3.0 * float(sd)) for each, sd in zip(FITTED, numbers.sd, strict=True)}
    return start, looked_for(described, near)


def looked_for(described: TrackedSpecimen, near: Mapping[Hidden, float]) -> dict[Hidden, float]:
    """Leave out the gap of a side on which no stop is described."""
    return {each: sd for each, sd in near.items() if isfinite(value_of(described, each))}


def _gaps_by_law(described: TrackedSpecimen, impacts: FreeImpacts) -> tuple[FreeGap | None, FreeGap | None]:
    """Give gaps where impacts are all alike: |p| there, less the depth that the described law has."""

    def gap(side: float) -> FreeGap | None:
        here = impacts.sides == side
        if int(here.sum()) < FEWEST_IMPACTS:
            return None
        depth_m = indentation_m(described, float(np.median(impacts.rate_before[here])))
        value_m = float(np.median(np.abs(impacts.p[here]))) - depth_m
        return FreeGap(value_m, _LAW_UNKNOWN * depth_m, int(here.sum()))

    return gap(-1.0), gap(1.0)
