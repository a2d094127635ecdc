"""Phase of a generator, steady or swept, as a function of the generator's own time.

Phase is in cycles, time in seconds of the generator's clock. Frequencies are integer microhertz, the
instrument's resolution. Whole seconds thus give an exact fraction of a cycle, and the phase does not drift
over hours (like a DDS accumulator that never overflows).
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float64]

MICROHERTZ = 1e-6
UHZ_PER_HZ = 1_000_000
CURVATURE_TOLERANCE_CYCLES = 1e-6
"""Largest deviation of the phase from a straight line within a piece."""
FINEST_SPLIT = 256
"""Maximum number of pieces per interval; only sweeps above about 1e9 Hz/s would need more."""
NO_TIMES: Samples = np.empty(0)


@dataclass(frozen=True)
class SteadyPhase:
    """Phase of a signal with constant frequency."""

    frequency_uhz: int
    offset: float
    """Phase at time zero [cycles, 0 <= offset < 1]."""

    @classmethod
    def with_phase(cls, frequency_uhz: int, phase: float, time_s: float) -> "SteadyPhase":
        """Return the course with a given phase at a given time."""
        since_zero = cls(frequency_uhz, 0.0).phase(time_s)
        return cls(frequency_uhz, (phase - since_zero) % 1.0)

    def phase(self, time_s: float) -> float:
        """Return the phase at one instant, from 0 to below 1 [cycles]."""
        return float(self._fractions(np.asarray([time_s]))[0])

    def _fractions(self, time_s: Samples) -> Samples:
        whole = np.floor(time_s)
        exact = (self.frequency_uhz % UHZ_PER_HZ) * whole.astype(np.int64) % UHZ_PER_HZ
        within = self.frequency_uhz * MICROHERTZ * (time_s - whole)
        return _fraction(self.offset + exact * MICROHERTZ + within)

    def stretches(self, edges_s: Samples) -> tuple[Samples, Samples]:
        """Return the phase at the start of each interval between edges, and its increase [cycles]."""
        return self._fractions(edges_s[:-1]), self.frequency_uhz * MICROHERTZ * np.diff(edges_s)

    def breakpoints(self, begin_s: float, end_s: float, interval_s: float) -> Samples:  # noqa: ARG002
        """Return no times, because the phase is linear in time."""
        return NO_TIMES


class Spacing(StrEnum):
    """Spacing of frequencies in a sweep."""

    LINEAR = "LINear"
    LOGARITHMIC = "LOGarithmic"


@dataclass(frozen=True)
class SweptPhase:
    """One triggered sweep and a hold at the stop frequency; the start frequency before and after these."""

    start_hz: float
    stop_hz: float
    sweep_s: float
    hold_s: float
    spacing: Spacing
    begin_s: float
    """Time of the trigger [s]; ``math.inf`` while waiting for it."""
    anchor_s: float
    offset: float
    """Phase at the time ``anchor_s`` [cycles]."""

    def phase(self, time_s: float) -> float:
        """Return the phase at one instant, from 0 to below 1 [cycles]."""
        return float(_fraction(self._cycles(np.asarray([time_s])))[0])

    def _cycles(self, time_s: Samples) -> Samples:
        before = self._since_zero(np.asarray([self.anchor_s]))[0]
        return np.asarray(self.offset + self._since_zero(time_s) - before)

    def _since_zero(self, time_s: Samples) -> Samples:
        after_s = np.maximum(time_s - self.begin_s, 0.0)
        swept = self._cycles_within(np.minimum(after_s, self.sweep_s))
        held_s = np.clip(after_s - self.sweep_s, 0.0, self.hold_s)
        back_s = np.maximum(after_s - self.sweep_s - self.hold_s, 0.0)
        waited_s = np.minimum(time_s, self.begin_s) + back_s
        return np.asarray(self.start_hz * waited_s + swept + self.stop_hz * held_s)

    def _cycles_within(self, time_s: Samples) -> Samples:
        """Return the integral of the frequency since the start of the sweep [cycles]."""
        if self.spacing is Spacing.LINEAR or self.start_hz == self.stop_hz:
            rate = (self.stop_hz - self.start_hz) / self.sweep_s
            return np.asarray(time_s * (self.start_hz + 0.5 * rate * time_s))
        growth = np.log(self.stop_hz / self.start_hz) / self.sweep_s
        return np.asarray(self.start_hz * np.expm1(growth * time_s) / growth)

    def stretches(self, edges_s: Samples) -> tuple[Samples, Samples]:
        """Return the phase at the start of each interval between edges, and its increase [cycles]."""
        cycles = self._cycles(edges_s)
        return _fraction(cycles[:-1]), np.diff(cycles)

    def breakpoints(self, begin_s: float, end_s: float, interval_s: float) -> Samples:
        """Return start and end of sweep and hold, and times in the sweep where the phase is curved."""
        end_of_sweep_s = self.begin_s + self.sweep_s
        corners = np.array([self.begin_s, end_of_sweep_s, end_of_sweep_s + self.hold_s])
        corners = corners[(corners > begin_s) & (corners < end_s)]
        first_s, last_s = max(begin_s, self.begin_s), min(end_s, end_of_sweep_s)
        steepest = abs(self.stop_hz - self.start_hz) / self.sweep_s
        if self.spacing is Spacing.LOGARITHMIC:
            growth = abs(np.log(self.stop_hz / self.start_hz)) / self.sweep_s
            steepest = max(self.start_hz, self.stop_hz) * growth
        if first_s >= last_s or steepest * interval_s**2 <= 8 * CURVATURE_TOLERANCE_CYCLES:
            return corners
        step_s = max(np.sqrt(8 * CURVATURE_TOLERANCE_CYCLES / steepest), interval_s / FINEST_SPLIT)
        first = int(np.floor((first_s - self.begin_s) / step_s)) + 1
        last = int(np.ceil((last_s - self.begin_s) / step_s)) - 1
        times = self.begin_s + step_s * np.arange(first, last + 1)
        return np.concatenate((corners, times[(times > first_s) & (times < last_s)]))


PhaseCourse = SteadyPhase | SweptPhase


def _fraction(cycles: Samples) -> Samples:
    """Return the fractional part, strictly below one (a tiny negative number would round up to one)."""
    fraction = cycles - np.floor(cycles)
    return np.asarray(np.where(fraction >= 1.0, 0.0, fraction))
