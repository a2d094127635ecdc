"""Hertz contact with energy loss. SI units."""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from .stops import LawWord, Reference, Stops, Strict, number_in, require_positive


@dataclass(frozen=True)
class HuntCrossley(Strict):
    """Hertz contact with energy loss: F = stiffness * penetration^(3/2) * (1 + loss * penetration rate).

    Hunt and Crossley, J. Appl. Mech. 42 (1975) 440, eq. 8, with lambda = loss * stiffness. If no other force
    acts, the separation speed is below 1/loss at any approach speed, so the force is never negative. If
    springs pull m1 off the stop faster than 1/loss, the force becomes negative (tensile).
    """

    OWN_UNITS: ClassVar = {"stiffness": "N m-1.5", "loss": "s m-1"}

    stiffness: float
    """Contact stiffness [N/m^1.5]."""
    loss: float
    """Loss factor [s/m], about 3/2 (1 - restitution) / approach speed for small losses. Zero gives Hertz."""
    kind: Literal["hunt_crossley"] = "hunt_crossley"

    def __post_init__(self) -> None:
        require_positive("Contact stiffness", self.stiffness, "N/m^1.5")
        if not 0.0 <= self.loss < math.inf:
            raise ValueError(
                f"Contact loss {self.loss} s/m is not allowed: it must be zero or positive, and finite."
            )

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops(contact_stiffness=float(self.stiffness), loss=float(self.loss))


def _parse(detail: str, reference: Reference) -> HuntCrossley:
    return HuntCrossley(reference.stiffness, number_in(detail))


HUNT_CROSSLEY = LawWord(
    "hunt_crossley:s/m", "Hertz contact with a loss that grows with the speed", "hunt_crossley:2", _parse
)
