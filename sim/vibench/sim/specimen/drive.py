"""Drives: the base displacement as a function of time from zero. SI units."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .stops import Strict, require_positive

FEWEST_SAMPLES = 4
"""Smallest number of samples of a sampled drive: a not-a-knot cubic spline needs four points."""
SMALLEST_AMPLITUDE_M, LARGEST_AMPLITUDE_M = 1e-100, 1e3
"""Allowed base amplitudes [m]. Squares of smaller values underflow; larger values must be typing errors."""
LOWEST_FREQUENCY_HZ, HIGHEST_FREQUENCY_HZ = 1e-12, 1e12
"""Allowed frequencies [Hz]. At higher frequencies, powers of frequency and numbers of periods overflow."""


class Parameter(StrEnum):
    """Parameter along which a branch is followed."""

    FREQUENCY = "frequency"
    """Drive frequency [Hz]."""
    AMPLITUDE = "amplitude"
    """Drive amplitude [m]."""


ParameterWord = Literal["frequency", "amplitude"]


@dataclass(frozen=True)
class Harmonic(Strict):
    """Harmonic base displacement U = amplitude_m * sin(2 pi frequency_hz t + phase_rad)."""

    frequency_hz: float
    amplitude_m: float
    phase_rad: float = 0.0

    def __post_init__(self) -> None:
        _require_frequency("Drive frequency", self.frequency_hz)
        _require_amplitude(self.amplitude_m)
        if not math.isfinite(self.phase_rad):
            raise ValueError(f"Drive phase {self.phase_rad} rad is not allowed: it must be finite.")


@dataclass(frozen=True)
class _Sweep(Strict):
    """Sine sweep of constant displacement amplitude, up or down, that starts at phase zero."""

    start_hz: float
    stop_hz: float
    duration_s: float
    amplitude_m: float

    def __post_init__(self) -> None:
        _require_frequency("Sweep start", self.start_hz)
        _require_frequency("Sweep stop", self.stop_hz)
        require_positive("Sweep duration", self.duration_s, "s")
        _require_amplitude(self.amplitude_m)
        if self.start_hz == self.stop_hz:
            raise ValueError(
                f"A sweep from {self.start_hz} to {self.stop_hz} Hz is not allowed: for one frequency "
                "use Harmonic."
            )

    @property
    def highest_hz(self) -> float:
        """Highest frequency of the sweep [Hz]."""
        return max(self.start_hz, self.stop_hz)


@dataclass(frozen=True)
class LinearSweep(_Sweep):
    """Sine sweep of constant displacement amplitude whose frequency changes at a constant rate.

    The sweep goes up or down, starts at phase zero, and is defined from 0 to ``duration_s``.
    """

    def turns(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the phase [cycles] at each time: start t + (stop - start) t^2 / (2 duration)."""
        return (self.start_hz + 0.5 * (self.stop_hz - self.start_hz) / self.duration_s * time_s) * time_s

    def frequency_hz(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the frequency at each time, shape of ``time_s`` [Hz]."""
        return self.start_hz + (self.stop_hz - self.start_hz) / self.duration_s * time_s


@dataclass(frozen=True)
class LogarithmicSweep(_Sweep):
    """Sine sweep of constant displacement amplitude with a constant number of octaves per second.

    The sweep goes up or down, starts at phase zero, and is defined from 0 to ``duration_s``.
    """

    def turns(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the phase [cycles]: start (exp(g t) - 1) / g with g = ln(stop/start) / duration."""
        growth = math.log(self.stop_hz / self.start_hz) / self.duration_s
        return self.start_hz * np.expm1(growth * time_s) / growth

    def frequency_hz(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the frequency at each time, shape of ``time_s`` [Hz]."""
        growth = math.log(self.stop_hz / self.start_hz) / self.duration_s
        return self.start_hz * np.exp(growth * time_s)


@dataclass(frozen=True, eq=False)
class Sampled:
    """Measured or computed base displacement, interpolated by a cubic spline (C2, not-a-knot).

    The first sample is at time zero; the drive ends at the last sample.
    """

    displacement_m: NDArray[np.float64]
    """Samples of the displacement, shape (samples,) [m]."""
    sample_rate_hz: float

    def __post_init__(self) -> None:
        samples = np.array(self.displacement_m, dtype=np.float64)
        if samples.ndim != 1 or len(samples) < FEWEST_SAMPLES:
            raise ValueError(
                f"A sampled drive of shape {samples.shape} is not allowed: "
                f"give one row of {FEWEST_SAMPLES} samples or more."
            )
        require_positive("Sample rate of the drive", self.sample_rate_hz, "Hz")
        if not bool(np.all(np.isfinite(samples))):
            bad = int(np.flatnonzero(~np.isfinite(samples))[0])
            raise ValueError(
                f"Sample {bad} of the drive is {samples[bad]}: every displacement must be finite."
            )
        samples.flags.writeable = False
        object.__setattr__(self, "displacement_m", samples)

    @property
    def duration_s(self) -> float:
        """Time of the last sample, at which the drive ends [s]."""
        return (len(self.displacement_m) - 1) / self.sample_rate_hz


Sweep = LinearSweep | LogarithmicSweep
Drive = Harmonic | LinearSweep | LogarithmicSweep | Sampled


def _require_frequency(name: str, frequency_hz: float) -> None:
    if not LOWEST_FREQUENCY_HZ <= frequency_hz <= HIGHEST_FREQUENCY_HZ:
        raise ValueError(
            f"{name} {frequency_hz} Hz is not allowed: "
            f"it must lie between {LOWEST_FREQUENCY_HZ:g} and {HIGHEST_FREQUENCY_HZ:g} Hz."
        )


def _require_amplitude(amplitude_m: float) -> None:
    if amplitude_m != 0.0 and not SMALLEST_AMPLITUDE_M <= amplitude_m <= LARGEST_AMPLITUDE_M:
        raise ValueError(
            f"Drive amplitude {amplitude_m} m is not allowed: "
            f"it must be zero, or lie between {SMALLEST_AMPLITUDE_M:g} and {LARGEST_AMPLITUDE_M:g} m."
        )


WHOLE = 1e-9
"""Relative tolerance within which a window counts as a whole number of periods."""
