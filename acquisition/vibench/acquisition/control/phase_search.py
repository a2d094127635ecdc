"""Finding the frequency at which a phase has a wanted value: secants inside a bracket that only narrows."""

from dataclasses import dataclass, field
from math import hypot, pi

import numpy as np

_NEAR_DEG = 35.0
"""Errors up to this are on the straight part of the phase: its slope is taken from them."""
_FEWEST = 2
_NEAREST = 3
"""Tries from which a slope is taken that changes from place to place."""
_STEEPEST_DEG = 85.0
"""Errors beyond are taken for this: the tangent of a right angle has no end."""
_BEND = 0.15
"""How far the slope over that part is off the one at the resonance, at most."""


@dataclass(frozen=True)
class PhaseError:
    """Phase minus the wanted one at a frequency [degrees], with its standard uncertainty by chance."""

    frequency_hz: float
    error_deg: float
    uncertainty_deg: float


@dataclass(frozen=True)
class PhaseResonance:
    """Where the phase is met."""

    frequency_hz: float
    uncertainty_hz: float
    """Standard uncertainty, that of the sensors' phases included [Hz]."""
    slope_deg_per_hz: float

    @property
    def half_width_hz(self) -> float:
        """Half of the half-power width: damping ratio times frequency, from the slope of the phase [Hz]."""
        return 180 / (pi * abs(self.slope_deg_per_hz)) if self.slope_deg_per_hz else 0.0


@dataclass
class PhaseSearch:
    """Seeks a falling phase's crossing: motion lags more and more as the frequency rises through a mode."""

    low_hz: float
    high_hz: float
    widest_step_hz: float
    """What one step takes at most while the resonance is not bracketed [Hz]."""
    tries: list[PhaseError] = field(default_factory=list)
    is_mode: bool = True
    """Whether the phase goes as that of a linear mode; of another its slope is known close by alone."""

    def next_hz(self) -> float:
        """Give the next frequency to try, after at least one."""
        last = self.tries[-1]
        if len(self.tries) == 1:
            step_hz = 0.5 * self.widest_step_hz
            return self._bounded(last.frequency_hz + (step_hz if last.error_deg > 0 else -step_hz))
        below = [each for each in self.tries if each.error_deg > 0]
        above = [each for each in self.tries if each.error_deg <= 0]
        if below and above:
            low = max(below, key=lambda each: each.frequency_hz)
            high = min(above, key=lambda each: each.frequency_hz)
            if low.frequency_hz < high.frequency_hz:
                return _between(low, high)
        return self._bounded(self._outwards(last))

    def resonance(self, sensor_phase_deg: float) -> PhaseResonance:
        """Draw a line through the tries near the resonance; it crosses zero there.

        Parameters
        ----------
        sensor_phase_deg
            Standard uncertainty of the phase that all tries share [degrees].

        """
        nearest = sorted(self.tries, key=lambda each: abs(each.error_deg))
        near = [each for each in nearest if abs(each.error_deg) <= _NEAR_DEG]
        used = near if len(near) >= _FEWEST else nearest[:_FEWEST]
        best = nearest[0]
        if not self.is_mode:
            away = sorted(self.tries, key=lambda each: abs(each.frequency_hz - best.frequency_hz))
            used = away[:_NEAREST]
        frequency_hz = np.array([each.frequency_hz for each in used])
        error_deg = np.array([each.error_deg for each in used])
        # The tangent of the error is a straight line through a mode, whose phase itself bends away from it.
        error = np.degrees(np.tan(np.radians(np.clip(error_deg, -_STEEPEST_DEG, _STEEPEST_DEG))))
        if np.ptp(frequency_hz) == 0.0 or np.ptp(error) == 0.0:
            # All at one frequency, or all beyond a right angle: nothing tells where it is crossed.
            return PhaseResonance(best.frequency_hz, float("inf"), 0.0)
        # A given phase moves the tangent the more, the further out it is.
        weight = np.cos(np.radians(error_deg)) ** 4
        away_hz = frequency_hz - float(weight @ frequency_hz / weight.sum())
        slope = float((weight * away_hz) @ error / ((weight * away_hz) @ away_hz))
        # From the best try, not from the line's own crossing: other modes bend it further out.
        crossing_hz = best.frequency_hz - best.error_deg / slope
        uncertainty_deg = hypot(best.uncertainty_deg, sensor_phase_deg, _BEND * best.error_deg)
        return PhaseResonance(crossing_hz, uncertainty_deg / abs(slope), slope)

    def _outwards(self, last: PhaseError) -> float:
        before = self.tries[-2]
        widest_hz = self.widest_step_hz
        rise = last.frequency_hz - before.frequency_hz
        slope = (last.error_deg - before.error_deg) / rise if rise else 0.0
        step_hz = -last.error_deg / slope if slope < 0 else (widest_hz if last.error_deg > 0 else -widest_hz)
        return last.frequency_hz + min(max(step_hz, -widest_hz), widest_hz)

    def _bounded(self, frequency_hz: float) -> float:
        return min(max(frequency_hz, self.low_hz), self.high_hz)


def _between(low: PhaseError, high: PhaseError) -> float:
    """Cross the secant, kept away from both ends so that the bracket shrinks from either side."""
    share = low.error_deg / (low.error_deg - high.error_deg)
    edge = 0.05
    return low.frequency_hz + min(max(share, edge), 1 - edge) * (high.frequency_hz - low.frequency_hz)
