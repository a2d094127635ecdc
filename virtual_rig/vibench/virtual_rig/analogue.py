"""Interfaces between the simulated converter and the analogue world."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Coupling(StrEnum):
    """How an input is coupled."""

    AC = "AC"
    DC = "DC"


@dataclass(frozen=True)
class Input:
    """Configuration of one converter input in a task."""

    physical_channel: str
    """``"cDAQ1Mod1/ai0"``: name of the input at the converter, which the wiring maps to a signal."""
    range_v: float
    """Full scale, plus and minus [V]."""
    coupling: Coupling
    iepe_current_a: float = 0.0
    """Excitation current of an IEPE sensor [A]; a sensor that needs it gives no signal without it."""


class Sampler(Protocol):
    """A running conversion; returns consecutive samples."""

    def read(self, count: int) -> NDArray[np.float64]:
        """Return the next ``count`` samples, shape (inputs, count) [V], quantised and clipped."""

    def overloaded(self) -> NDArray[np.bool_]:
        """Return which inputs have clipped since the last call."""

    def close(self) -> None:
        """Stop converting."""


class AnalogueWorld(Protocol):
    """Everything between the generator's terminal and the converter's inputs, advancing in rig time."""

    @property
    def time_s(self) -> float:
        """Rig time: how far the world has been computed [s]."""

    def advance(self, duration_s: float) -> None:
        """Advance rig time without a conversion."""

    def sample(self, inputs: tuple[Input, ...], sample_rate_hz: float) -> Sampler:
        """Start a conversion now, at a rate that the converter supports (by its own clock)."""

    def play(self, physical_channel: str, volts: NDArray[np.float64], sample_rate_hz: float) -> None:
        """Append samples to the queue of an analogue output; an idle output starts now."""

    def silence(self, physical_channel: str) -> None:
        """Clear the queue and hold the output at zero."""
