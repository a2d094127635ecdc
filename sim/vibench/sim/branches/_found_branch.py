"""A branch with what is to be known of how it was found, and whether a motion lies on it. SI units."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..model.arrays import Floats
from ..model.drive import Harmonic
from ..model.specimen import Specimen
from ..motion.poincare import state_scales
from ..periodic.branch import Branch
from ..periodic.branch_following import DrivePath, parameter_value
from ..periodic.continuation import ArcEnd
from ..periodic.period_map import OrbitShape

INTERPOLATED = 0.06
"""A straight line between two points of a branch misses it by less than this part of its length: by as much
as the tangent may turn between them."""
SAME_MOTION = 1e-5
"""Over the state's scale."""
LENGTHS = 10.0
"""As many units long counts the parameter's range: as when a branch is followed."""


class BranchOrigin(StrEnum):
    """How a branch came to be known."""

    SEARCH = "a motion found from rest, between the stops or from a random state"
    SYMMETRY_BREAKING = "switched to where a symmetry breaks"
    PERIOD_DOUBLING = "switched to where a period doubles"
    PHASE_RESONANCE = "the phase resonance of the motion without contacts"
    FIRST_ORDER = "a solution of the first-order balance"


@dataclass(frozen=True, eq=False)
class FoundBranch:
    """A branch, how its motions repeat, how it was found, and what it cost."""

    branch: Branch
    shape: OrbitShape
    periods: int
    """Drive periods of a motion."""
    origin: BranchOrigin
    has_twin: bool
    """Another branch holds the mirror images of these motions."""
    elapsed_s: float = 0.0
    """To find and follow it."""

    @property
    def is_isolated(self) -> bool:
        """It closes on itself: no sweep leads there from outside."""
        return self.branch.begin is self.branch.end is ArcEnd.CLOSED


def lies_on(found: FoundBranch, specimen: Specimen, path: DrivePath, drive: Harmonic, states: Floats) -> bool:
    """Say whether any of some states at one drive, shape (n, 6), belongs to a branch."""
    branch, value = found.branch, parameter_value(path, drive)
    scales = state_scales(specimen, drive)
    along = branch.parameters
    reach = max(float(np.ptp(along)), 1e-9 * value)
    for k in np.flatnonzero((along[:-1] - value) * (along[1:] - value) <= 0.0):
        span = along[k + 1] - along[k]
        part = 0.0 if span == 0.0 else (value - along[k]) / span
        here, there = branch.states[k] / scales, branch.states[k + 1] / scales
        nearest = np.abs(here + part * (there - here) - states / scales).max(axis=1).min()
        length = float(np.linalg.norm(there - here)) + LENGTHS * abs(float(span)) / reach
        if nearest < INTERPOLATED * length + SAME_MOTION:
            return True
    return False


def known_among(
    known: Iterable[FoundBranch], specimen: Specimen, path: DrivePath, drive: Harmonic, states: Floats
) -> bool:
    """Say whether a motion, as one of its states or of its mirror's, lies on a known branch."""
    return any(lies_on(each, specimen, path, drive, states) for each in known)
