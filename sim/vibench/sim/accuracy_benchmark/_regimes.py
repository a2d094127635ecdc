"""The motions on which the trade is measured: one of each kind, named by how it is driven."""

from dataclasses import dataclass
from enum import StrEnum

from ..model import Harmonic, Specimen, gong2025


class Regime(StrEnum):
    """What a motion is like; what accuracy buys depends on it."""

    FREE = "no contact"
    PERIODIC = "periodic"
    CHAOTIC = "chaos"


@dataclass(frozen=True)
class Motion:
    """One motion of one model."""

    regime: Regime
    model: str
    """As `vibench.sim.model` spells it."""
    frequency_hz: float
    amplitude_m: float

    @property
    def specimen(self) -> Specimen:
        """The paper's, with this model's contact."""
        return gong2025(contact=self.model)

    @property
    def drive(self) -> Harmonic:
        """U = A0 sin(omega t)."""
        return Harmonic(self.frequency_hz, self.amplitude_m)

    @property
    def name(self) -> str:
        """How tables call it."""
        return f"{self.model}, {self.frequency_hz:g} Hz, {1e6 * self.amplitude_m:g} µm"


MOTIONS = (
    Motion(Regime.FREE, "hertz", 260.0, 1e-6),
    Motion(Regime.PERIODIC, "hertz", 130.0, 20e-6),
    Motion(Regime.PERIODIC, "linear_gap", 130.0, 20e-6),
    Motion(Regime.PERIODIC, "power:3", 150.0, 10e-6),
    Motion(Regime.PERIODIC, "power:7", 100.0, 5e-6),
    Motion(Regime.PERIODIC, "power:47", 100.0, 5e-6),
    Motion(Regime.CHAOTIC, "hertz", 260.0, 5e-6),
)
"""Kinds were found by scanning; `vibench.sim.accuracy_benchmark` refuses a periodic motion that is none."""
