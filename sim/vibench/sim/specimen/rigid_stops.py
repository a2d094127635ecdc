"""Rigid stops with a coefficient of restitution. SI units."""

from dataclasses import dataclass
from typing import Literal

from .stops import LawWord, Reference, Stops, Strict, number_in


@dataclass(frozen=True)
class RigidStops(Strict):
    """Rigid stops: m1 and m2 separate at ``restitution`` times the approach speed (Newton's law)."""

    restitution: float
    """Coefficient of restitution: 0 (the masses stay together) to 1 (no energy is lost)."""
    kind: Literal["rigid"] = "rigid"

    def __post_init__(self) -> None:
        if not 0.0 <= self.restitution <= 1.0:
            raise ValueError(f"Restitution {self.restitution} is not allowed: it must lie in [0, 1].")

    @property
    def stops(self) -> Stops:
        """Parameters of the law for the engine."""
        return Stops(restitution=float(self.restitution))


def _parse(detail: str, _reference: Reference) -> RigidStops:
    return RigidStops(number_in(detail))


RIGID = LawWord("rigid:0..1", "rigid stops with a coefficient of restitution", "rigid:0.8", _parse)
