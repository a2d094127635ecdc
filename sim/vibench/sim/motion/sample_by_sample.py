"""A specimen followed sample by sample of its base: what laying a model over a recording needs. SI units.

`integrate` answers more (impact times, samples anywhere, any end) and costs several times as much per
interval. Here every interval is whole, the state at its end is kept, and impacts are counted.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.cubic_run import CubicRun
from ..engine.run import RunRecord, most_impacts
from ..model.accuracy import Accuracy, AccuracyWord
from ..model.drive import Sampled
from ..model.specimen import Specimen
from ..model.stops import chosen
from .base_motion import sampled_motion
from .integrate import MAX_IMPACT_RATE_HZ, start_motion


@dataclass(frozen=True, eq=False)
class FollowedMotion:
    """States at the samples that were reached, and impacts between them."""

    states: NDArray[np.float64]
    """x, y, z, vx, vy, vz at every sample, absolute, shape (reached, 6) [m, m/s]."""
    impacts: NDArray[np.int64]
    """Contacts that began between a sample and the next, shape (reached - 1,)."""
    asked: int
    """Samples asked for; more than were reached when the motion became meaningless."""

    @property
    def reached_end(self) -> bool:
        """Whether there is a state for every sample asked for."""
        return len(self.states) == self.asked


def follow_samples(
    specimen: Specimen,
    drive: Sampled,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
    *,
    first: int = 0,
    last: int | None = None,
) -> FollowedMotion:
    """Follow a specimen from one sample of its base's displacement to another.

    Parameters
    ----------
    initial_state
        x, y, z, vx, vy, vz, absolute [m, m/s], shape (6,); at rest when None. May be in contact.
    first, last
        Samples at which the run begins and ends; the whole drive if absent. The samples around them
        still shape the spline.

    """
    accuracy = chosen(Accuracy, accuracy)
    base = sampled_motion(drive)
    pieces = base.pieces[first:last]
    run = CubicRun(specimen, base.interval, start_motion(initial_state), accuracy.tolerance)
    first_state = run.motion
    record = RunRecord(most_impacts(MAX_IMPACT_RATE_HZ, len(pieces) * base.interval))
    motions, impacts = run.follow(pieces, record)
    return FollowedMotion(np.vstack([first_state, motions]), impacts.astype(np.int64), len(pieces) + 1)
