"""The sockets of the virtual rig: where a simulated converter and the analogue world are wired together."""

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
    """One converter input as a task has configured it."""

    physical_channel: str
    """``"cDAQ1Mod1/ai0"``: the name the converter uses, which the wiring maps to a signal."""
    range_v: float
    """Full scale, plus and minus [V]."""
    coupling: Coupling
    iepe_current_a: float = 0.0
    """Excitation current of an IEPE sensor [A]; a sensor that needs it and gets none shows nothing."""


class Sampler(Protocol):
    """A running conversion: hands out the next samples in the order of time."""

    def read(self, count: int) -> NDArray[np.float64]:
        """Next ``count`` samples, shape (inputs, count) [V], quantised and clipped at the range."""

    def overloaded(self) -> NDArray[np.bool_]:
        """Which inputs have clipped since the last call."""

    def close(self) -> None:
        """Stop converting."""


class AnalogueWorld(Protocol):
    """Everything between the generator's terminal and the converter's inputs, advancing in rig time."""

    @property
    def time_s(self) -> float:
        """Rig time: how far the world has been computed [s]."""

    def advance(self, duration_s: float) -> None:
        """Let rig time pass while nobody samples."""

    def sample(self, inputs: tuple[Input, ...], sample_rate_hz: float) -> Sampler:
        """Begin a conversion now, at a rate the converter supports (on the converter's own clock)."""

    def play(self, physical_channel: str, volts: NDArray[np.float64], sample_rate_hz: float) -> None:
        """Queue samples of an analogue output behind what it still has to play; they start now if idle."""

    def unplayed(self, physical_channel: str) -> int:
        """How many queued samples of that output have not been played yet."""

    def silence(self, physical_channel: str) -> None:
        """Drop what is queued and hold that output at zero."""
