"""A branch: periodic motions along a parameter, with stability and bifurcations. SI units."""

import itertools
import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..specimen.drive import Harmonic, Parameter
from ..specimen.specimen import Complex, Floats
from .continuation import ArcEnd
from .newton import NEUTRAL


class BifurcationKind(StrEnum):
    """Kind of an event on a branch: a bifurcation, or grazing."""

    FOLD = "fold"
    """The branch turns back, and a sweep jumps to another branch. One Floquet multiplier is +1."""
    SYMMETRY_BREAKING = "symmetry breaking"
    """Two motions, mirror images of each other, branch off here. One Floquet multiplier is +1."""
    PERIOD_DOUBLING = "period doubling"
    """A motion of twice the period branches off here. One Floquet multiplier is -1."""
    NEIMARK_SACKER = "Neimark-Sacker"
    """A quasi-periodic motion branches off here. A complex pair of multipliers crosses the unit circle."""
    GRAZING = "grazing"
    """A contact appears in the motion, or disappears, at zero approach speed."""


@dataclass(frozen=True, eq=False)
class BranchEvent:
    """A bifurcation or grazing point of a branch."""

    kind: BifurcationKind
    frequency_hz: float
    amplitude_m: float
    state: Floats
    """Displacements and velocities at time zero of the drive; initial state for a run, shape (2 n,)."""
    index: int
    """Index of the last point of the branch before the event."""

    def parameter(self, parameter: Parameter) -> float:
        """Return the frequency [Hz] or the amplitude [m] of the event."""
        return self.frequency_hz if parameter is Parameter.FREQUENCY else self.amplitude_m


@dataclass(frozen=True, eq=False)
class Branch:
    """Periodic motions along a parameter, in order along the branch; m points, n displacements."""

    parameter: Parameter
    frequencies_hz: Floats
    """Drive frequency of each point, shape (m,) [Hz]."""
    amplitudes_m: Floats
    """Drive amplitude of each point, shape (m,) [m]."""
    response_i: Floats
    """Largest magnitude, within a period, of every displacement (x, y, z) and of p, relative to the drive
    amplitude, shape (m, n + 1)."""
    response_ii: Floats
    """Amplitudes at the drive frequency of every displacement and of p, divided by A0, shape (m, n + 1)."""
    states: Floats
    """Displacements and velocities at time zero of the drive, shape (m, 2 n)."""
    multipliers: Complex
    """Floquet multipliers over one period of the motion, largest first, shape (m, 2 n)."""
    left_out: Floats
    """Estimated error of each point relative to the fundamental of p, shape (m,). In harmonic balance the
    error comes from neglected harmonics; in shooting, from closure and integration errors."""
    contacts: NDArray[np.int64]
    """Number of contacts that begin in a period of the motion, shape (m,)."""
    events: tuple[BranchEvent, ...]
    end: ArcEnd
    """Reason why the branch ends at its last point."""
    begin: ArcEnd | None = None
    """Reason why the branch ends at its first point; None if the branch was followed from there."""

    @property
    def is_stable(self) -> NDArray[np.bool_]:
        """Whether each motion is stable: all Floquet multipliers lie inside the unit circle, shape (m,)."""
        return np.asarray(np.abs(self.multipliers[:, 0]) < 1.0 - NEUTRAL)

    @property
    def parameters(self) -> Floats:
        """Values of the parameter at the points, shape (m,) [Hz, or m]."""
        return self.frequencies_hz if self.parameter is Parameter.FREQUENCY else self.amplitudes_m


POINTWISE = (
    "frequencies_hz",
    "amplitudes_m",
    "response_i",
    "response_ii",
    "states",
    "multipliers",
    "left_out",
    "contacts",
)
"""Fields of a branch that are arrays with one entry per point."""


# Bifurcations between two points of a branch, from Floquet multipliers.
#
# A test function changes sign where a multiplier passes -1 (product of mu + 1), or where a complex pair
# crosses the unit circle (product of mu_i mu_j - 1; Guckenheimer, Myers and Sturmfels, SIAM J. Numer. Anal.
# 34 (1997) 1). Grazing changes the number of contacts. The continuation itself detects folds.
#
# If a motion is its own mirror image half a period later, its monodromy matrix is the square of the matrix
# for half a period. For the half-period map, a multiplier -1 means symmetry breaking, and +1 means a fold.

COMPLEX_PART = 1e-6
"""Smallest imaginary part of a multiplier at a Neimark-Sacker point; excludes real pairs with product 1."""


class OrbitShape(StrEnum):
    """Symmetry of a periodic motion."""

    MIRRORED = "mirrored"
    """The motion is mirrored half a period later; needs equal gaps and an odd number of drive periods."""
    REPEATED = "repeated"
    """The motion repeats after a whole number of drive periods."""


OrbitShapeWord = Literal["mirrored", "repeated"]


@dataclass(frozen=True, eq=False)
class OrbitSigns:
    """Data for the detection of bifurcations at one point of a branch."""

    multipliers: Complex
    """Floquet multipliers over half a period if the motion is mirrored, else over a period; shape (2 n,)."""
    contacts: int
    """Number of contacts that begin in a period of the motion."""
    shape: OrbitShape
    apart: Floats = field(default_factory=lambda: np.zeros(0))
    """Closure error over half the period (zero for a simpler motion), shape (6,); empty if not defined."""
    joins: BifurcationKind | None = None
    """Bifurcation where this branch meets a branch whose motions are mirrored or have half the period."""
    grazing_distance: float = math.inf
    """Distance from grazing: (distance to the stop) / gap or, at a contact, (dp/dt) / (gap * 2 pi f)."""

    @property
    def over_period(self) -> Complex:
        """Floquet multipliers over the whole period, largest first."""
        return self.multipliers**2 if self.shape is OrbitShape.MIRRORED else self.multipliers

    @property
    def flip(self) -> float:
        """Test function that changes sign where a multiplier passes -1."""
        return float(np.prod(self.multipliers + 1.0).real)

    @property
    def torus(self) -> float:
        """Test function that changes sign where a complex pair crosses the unit circle."""
        pairs = itertools.combinations(self.multipliers, 2)
        beyond = np.array([a * b - 1.0 for a, b in pairs])
        beyond[np.abs(beyond) < NEUTRAL] = -NEUTRAL
        return float(np.prod(beyond).real)

    @property
    def has_pair_on_circle(self) -> bool:
        """Whether the two Floquet multipliers with the product closest to 1 are a complex pair."""
        pairs = list(itertools.combinations(self.multipliers, 2))
        first, _ = min(pairs, key=lambda pair: abs(pair[0] * pair[1] - 1.0))
        return bool(abs(first.imag) > COMPLEX_PART)


@dataclass(frozen=True, eq=False)
class OrbitReport:
    """Periodic motion at one drive, with its stability and responses."""

    drive: Harmonic
    state: Floats
    """Displacements (x, y, z) and velocities at time zero of the drive, shape (2 n,)."""
    signs: OrbitSigns
    response_i: Floats
    """Largest magnitude of every displacement and of p, relative to the drive amplitude, shape (n + 1,)."""
    response_ii: Floats
    """Amplitude of every displacement and of p at the drive frequency, relative to A0, shape (n + 1,)."""
    error: float
    """Error of the motion relative to the fundamental of p, as in `Branch.left_out`."""


def bifurcations_between(before: OrbitSigns, after: OrbitSigns) -> list[BifurcationKind]:
    """Return the bifurcations between two neighbouring points of a branch, except folds."""
    found = []
    if before.contacts != after.contacts:
        found.append(BifurcationKind.GRAZING)
    if before.flip * after.flip < 0.0:
        is_mirrored = before.shape is OrbitShape.MIRRORED
        found.append(BifurcationKind.SYMMETRY_BREAKING if is_mirrored else BifurcationKind.PERIOD_DOUBLING)
    if before.torus * after.torus < 0.0 and (before.has_pair_on_circle or after.has_pair_on_circle):
        found.append(BifurcationKind.NEIMARK_SACKER)
    return found


NEAR_SIMPLER = 0.5
"""Largest distance [gaps] of a simpler motion from the two neighbouring points of the branch."""
IS_SIMPLER = 1e-7
"""Distance [gaps] from a simpler motion below which the two motions differ only by rounding."""


def is_joined(before: OrbitSigns, after: OrbitSigns) -> bool:
    """Return whether a branch has passed its end: a motion that is mirrored or has half the period."""
    if before.joins is None or before.apart.size == 0:
        return False
    turned = float(before.apart @ after.apart) <= 0.0
    apart = [float(np.linalg.norm(each.apart)) for each in (before, after)]
    return turned and apart[0] > IS_SIMPLER and max(apart) < NEAR_SIMPLER


def sign_of(kind: BifurcationKind, here: OrbitSigns, before: OrbitSigns) -> float:
    """Return the value of the test function for a kind of event; the function changes sign at the event."""
    match kind:
        case BifurcationKind.GRAZING:
            return 1.0 if here.contacts == before.contacts else -1.0
        case BifurcationKind.NEIMARK_SACKER:
            return here.torus
        case _:
            return here.flip
