"""What happens to a periodic motion between two points of a branch, read off its Floquet multipliers.

Each test is a real number that changes sign: a multiplier passes -1 (product of mu + 1), a pair passes the
unit circle (product of mu_i mu_j - 1; Guckenheimer, Myers and Sturmfels, SIAM J. Numer. Anal. 34 (1997) 1),
another contact begins or ends (their number). Folds are found by the continuation itself.

A motion that mirrors itself after half a period has the square of a half-period map as its monodromy:
there -1 of the half map means that the symmetry breaks, and +1 is a fold.
"""

import itertools
import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from ..model.arrays import Complex, Vector
from .branch import NEUTRAL, BifurcationKind

COMPLEX_PART = 1e-6
"""A pair with less imaginary part than this is a real pair of product one: no motion is born there."""


class Symmetry(StrEnum):
    """Whether the multipliers are those of the half-period map of a self-mirrored motion."""

    MIRRORED = "mirrored"
    NONE = "none"


@dataclass(frozen=True, eq=False)
class OrbitSigns:
    """What decides about events at one point of a branch."""

    multipliers: Complex
    """Of the half map if mirrored, else of the period; shape (2 n,)."""
    contacts: int
    """Crossings of the stops in a period."""
    symmetry: Symmetry
    apart: Vector = field(default_factory=lambda: np.zeros(0))
    """How far the motion is from a simpler one that such a branch may join, shape (6,); empty for none."""
    joins: BifurcationKind | None = None
    """What happens on the simpler one's branch where they are one."""
    grazing_distance: float = math.inf
    """How far a contact is from beginning or ending, over the gap or the gap times 2 pi f."""

    @property
    def over_period(self) -> Complex:
        """Floquet multipliers over the whole period, largest first."""
        return self.multipliers**2 if self.symmetry is Symmetry.MIRRORED else self.multipliers

    @property
    def flip(self) -> float:
        """Changes sign where a multiplier passes -1."""
        return float(np.prod(self.multipliers + 1.0).real)

    @property
    def torus(self) -> float:
        """Changes sign where a complex pair passes the unit circle; one that lies on it counts as inside."""
        pairs = itertools.combinations(self.multipliers, 2)
        beyond = np.array([a * b - 1.0 for a, b in pairs])
        beyond[np.abs(beyond) < NEUTRAL] = -NEUTRAL
        return float(np.prod(beyond).real)

    @property
    def has_pair_on_circle(self) -> bool:
        """The pair of product closest to one is complex."""
        pairs = list(itertools.combinations(self.multipliers, 2))
        first, _ = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
        return bool(abs(first.imag) > COMPLEX_PART)


def bifurcations_between(before: OrbitSigns, after: OrbitSigns) -> list[BifurcationKind]:
    """Name what happens between two neighbouring points; folds apart."""
    found = []
    if before.contacts != after.contacts:
        found.append(BifurcationKind.GRAZING)
    if before.flip * after.flip < 0.0:
        is_mirrored = before.symmetry is Symmetry.MIRRORED
        found.append(BifurcationKind.SYMMETRY_BREAKING if is_mirrored else BifurcationKind.PERIOD_DOUBLING)
    if before.torus * after.torus < 0.0 and (before.has_pair_on_circle or after.has_pair_on_circle):
        found.append(BifurcationKind.NEIMARK_SACKER)
    return found


NEAR_SIMPLER = 0.5
"""A motion this close to a simpler one, over the gap, may pass through it within a step."""
IS_SIMPLER = 1e-7
"""A motion this close to a simpler one, over the gap, is that one: what is between them is rounding."""


def is_joined(before: OrbitSigns, after: OrbitSigns) -> bool:
    """Say whether a motion passed through a simpler one between two neighbouring points: its twin follows."""
    if before.joins is None or before.apart.size == 0:
        return False
    turned = float(before.apart @ after.apart) <= 0.0
    apart = [float(np.linalg.norm(each.apart)) for each in (before, after)]
    return turned and apart[0] > IS_SIMPLER and max(apart) < NEAR_SIMPLER


def sign_of(kind: BifurcationKind, here: OrbitSigns, before: OrbitSigns) -> float:
    """Give the number whose change of sign is the happening."""
    match kind:
        case BifurcationKind.GRAZING:
            return 1.0 if here.contacts == before.contacts else -1.0
        case BifurcationKind.NEIMARK_SACKER:
            return here.torus
        case _:
            return here.flip
