"""How the drive changes along a branch: one number, and its frequency and amplitude. SI units."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

from scipy.interpolate import PchipInterpolator

from .branch import Parameter


class DrivePath(Protocol):
    """A curve in the plane of drive frequency and amplitude."""

    @property
    def parameter(self) -> Parameter:
        """What the number along the path is."""
        ...

    def drive(self, value: float) -> tuple[float, float]:
        """Frequency [Hz] and amplitude [m] at a value of the parameter."""
        ...

    def slopes(self, value: float) -> tuple[float, float]:
        """Give the derivatives of both by the parameter."""
        ...


@dataclass(frozen=True)
class FrequencyPath:
    """Along frequency, at one amplitude or at one that depends on frequency as it was recorded."""

    amplitudes_m: tuple[float, ...]
    """One for every frequency; a single one is held throughout."""
    frequencies_hz: tuple[float, ...] = ()
    """Ascending; between them the amplitude is a monotone cubic, outside of them that of the nearest."""

    def __post_init__(self) -> None:
        given = max(1, len(self.frequencies_hz))
        ascending = all(before < after for before, after in pairwise(self.frequencies_hz))
        if len(self.amplitudes_m) != given or given == 1 != len(self.amplitudes_m) or not ascending:
            msg = (
                f"{len(self.amplitudes_m)} amplitudes at {len(self.frequencies_hz)} frequencies are not "
                "allowed: one amplitude alone, or one for each of two or more ascending frequencies."
            )
            raise ValueError(msg)
        for amplitude in self.amplitudes_m:
            _refuse_unless_positive("amplitude", amplitude, "m")

    @property
    def parameter(self) -> Parameter:
        """Frequency."""
        return Parameter.FREQUENCY

    def drive(self, value: float) -> tuple[float, float]:
        """Frequency [Hz] and amplitude [m]."""
        if len(self.amplitudes_m) == 1:
            return value, self.amplitudes_m[0]
        return value, float(self._curve(self._inside(value)))

    def slopes(self, value: float) -> tuple[float, float]:
        """1, and the amplitude's slope [m/Hz]."""
        if len(self.amplitudes_m) == 1 or self._inside(value) != value:
            return 1.0, 0.0
        return 1.0, float(self._curve(value, 1))

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(self.frequencies_hz, self.amplitudes_m)

    def _inside(self, value: float) -> float:
        return min(max(value, self.frequencies_hz[0]), self.frequencies_hz[-1])


@dataclass(frozen=True)
class AmplitudePath:
    """Along the amplitude, at one frequency."""

    frequency_hz: float

    def __post_init__(self) -> None:
        _refuse_unless_positive("frequency", self.frequency_hz, "Hz")

    @property
    def parameter(self) -> Parameter:
        """Amplitude."""
        return Parameter.AMPLITUDE

    def drive(self, value: float) -> tuple[float, float]:
        """Frequency [Hz] and amplitude [m]."""
        return self.frequency_hz, value

    def slopes(self, value: float) -> tuple[float, float]:  # noqa: ARG002 - the same everywhere
        """0 and 1."""
        return 0.0, 1.0


def path_from(parameter: Parameter, frequency_hz: float, amplitude_m: float) -> DrivePath:
    """Hold the one and change the other."""
    if parameter is Parameter.FREQUENCY:
        return FrequencyPath((amplitude_m,))
    return AmplitudePath(frequency_hz)


def _refuse_unless_positive(name: str, value: float, unit: str) -> None:
    if not 0.0 < value < math.inf:
        msg = f"A drive {name} of {value} {unit} is not allowed: it must be positive and finite."
        raise ValueError(msg)
