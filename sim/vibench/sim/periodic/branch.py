"""A branch: periodic motions along a parameter, their stability and special points. SI units."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..model.arrays import Complex, Floats
from .continuation import ArcEnd

NEUTRAL = 1e-9
"""A multiplier no further outside the unit circle than this lies on it, but for rounding: as all do without
damping, where distances neither grow nor fall."""


class Parameter(StrEnum):
    """What changes along a branch."""

    FREQUENCY = "frequency"
    """Drive frequency [Hz]."""
    AMPLITUDE = "amplitude"
    """Drive amplitude [m]."""


ParameterWord = Literal["frequency", "amplitude"]


class BifurcationKind(StrEnum):
    """What a special point of a branch is."""

    FOLD = "fold"
    """The branch turns back: a swept response jumps here. One multiplier is +1."""
    SYMMETRY_BREAKING = "symmetry breaking"
    """Two motions that are each other's mirror images leave the symmetric one. One multiplier is +1."""
    PERIOD_DOUBLING = "period doubling"
    """A motion of twice the period leaves. One multiplier is -1."""
    NEIMARK_SACKER = "Neimark-Sacker"
    """A quasi-periodic motion leaves. A complex pair of multipliers crosses the unit circle."""
    GRAZING = "grazing"
    """A contact begins or ends at zero speed."""


@dataclass(frozen=True, eq=False)
class BranchEvent:
    """A special point."""

    kind: BifurcationKind
    frequency_hz: float
    amplitude_m: float
    state: Floats
    """Displacements and velocities at the drive's time zero, shape (2 n,): to go on from there."""
    index: int
    """It lies after this point of the branch, and before the next."""

    def parameter(self, parameter: Parameter) -> float:
        """Frequency [Hz] or amplitude [m]."""
        return self.frequency_hz if parameter is Parameter.FREQUENCY else self.amplitude_m


@dataclass(frozen=True, eq=False)
class Branch:
    """Periodic motions in the order in which the branch runs through them; m points, n displacements."""

    parameter: Parameter
    frequencies_hz: Floats
    """Shape (m,)."""
    amplitudes_m: Floats
    """Drive amplitude, shape (m,)."""
    response_i: Floats
    """Largest magnitude over a period of every displacement (x, y, z) and of p, over the drive amplitude,
    shape (m, n + 1)."""
    response_ii: Floats
    """Amplitude of the component at the drive frequency, likewise."""
    states: Floats
    """Displacements and velocities at the drive's time zero, shape (m, 2 n)."""
    multipliers: Complex
    """Floquet multipliers over one period of the motion, largest first, shape (m, 2 n)."""
    left_out: Floats
    """Error estimate of each point as part of the fundamental of p, shape (m,): of a balance by the harmonics
    left out, of a shot motion by how far it is from coming back."""
    contacts: NDArray[np.int64]
    """Contacts that begin in a period of the motion, shape (m,)."""
    events: tuple[BranchEvent, ...]
    end: ArcEnd
    """Why the branch was left at its last point."""
    begin: ArcEnd | None = None
    """Why it was left at its first, where it was followed both ways; None where it was begun there."""

    @property
    def is_stable(self) -> NDArray[np.bool_]:
        """No multiplier outside the unit circle, shape (m,)."""
        return np.asarray(np.abs(self.multipliers[:, 0]) < 1.0 + NEUTRAL)

    @property
    def parameters(self) -> Floats:
        """The one that changes, shape (m,)."""
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
"""Fields of a branch with one row a point."""
