"""The phase-locked loop that follows a resonance, and the loop's estimate of the mode."""

from dataclasses import dataclass, field, replace
from math import exp, hypot, log, pi, radians

import numpy as np

from ..excitation.resonance_tracking import ResonanceTracking
from ..plan import LOOK_PERIODS
from .settling_controller import SettledState

_GAIN = 0.3
"""Fraction of the phase error that the loop corrects after each measurement (look)."""
_SLOW, _GROWTH, _LARGEST_GAIN = 0.75, 1.5, 4.0
"""If more than the fraction ``_SLOW`` of a phase error remains after a look (measurement), the gain is
multiplied by ``_GROWTH``, up to ``_LARGEST_GAIN``.
"""
_WIDER = np.linspace(-0.25, 0.25, 15)
"""Trial changes of ln(half-width) from one level to the next."""
_MUCH_WIDER = np.linspace(-1.0, 1.0, 57)
"""Trial changes of ln(half-width) for super- and subharmonics, whose first half-width is only an estimate."""
_SURE_RAD = radians(12.0)
"""Unexplained phase drift with the same weight in the fit as a change of the half-width by the factor e."""
_STEEPER = 0.5
"""Largest assumed relative change of ``bend_hz`` from one level to the next."""
_EXPLAINED_RAD = radians(3.0)
"""Rms of the unexplained phase drift above which the motion is assumed to have changed to another."""


@dataclass(frozen=True)
class LearntMode:
    """Properties of a mode, as estimated by the phase-locked loop."""

    narrowest_hz: float
    """Half-width in the first search (zero for a super- or subharmonic). This half-width is a lower bound,
    because contacts and hard springs only widen a resonance."""
    half_width_hz: float
    bend_hz: float = 0.0
    """Change of the resonance frequency [Hz] when the base level grows by the factor e; 0 if unknown."""
    steeper_hz: float = 0.0
    """Expected change of ``bend_hz`` from this base level to the next [Hz]."""


@dataclass(frozen=True)
class TrackedPlace:
    """State of the loop at the end of a base level, from which the next level starts."""

    frequency_hz: float
    base_m_per_s2: float
    mode: LearntMode | None = None
    """Estimate of the mode. None if the loop never locked, so that the next level starts with a search."""


class PhaseLaw:
    """Control law of the phase-locked loop (decisions 0064 and 0074).

    A look is one measurement of the loop, of duration L [s]. During a look, the phase of the motion relative
    to the drive changes by ``d = 2 pi L (r - f - w e)``: f is the drive frequency, r the resonance, e the
    phase error [rad] and w the half-width of the mode. Hence ``r - f = w e + d / (2 pi L)``. The loop changes
    f by g (r - f), so that each look reduces the error by the fraction g. If the error falls too slowly, g is
    raised, but only for the term ``w e``. For harmonic n, L is replaced by n L, and r and w are the mode's
    values divided by n. For a subharmonic of order n, e is the error of n times its phase, r and w refer to
    the drive, and a look has n times as many drive periods.

    A resonance that depends on the amplitude (``bend_hz``) moves while the motion grows to a new level. The
    motion follows the base at the decay rate of the mode; r changes with the logarithm of the amplitude, at a
    rate known from earlier levels. The frequency is corrected for this change in advance.
    """

    def __init__(self, plan: ResonanceTracking, last: TrackedPlace, mode: LearntMode) -> None:
        self._plan = plan
        self._turns = plan.harmonic * plan.subharmonic * LOOK_PERIODS
        """Number of drive periods in a look (measurement), times n for harmonic n."""
        self._last = last
        self._mode = mode
        self._bend_hz = mode.bend_hz + mode.steeper_hz
        self._grown = last.base_m_per_s2
        """Base level at which a settled motion would have the present amplitude [m/s2]."""
        self._gain = _GAIN
        self._motion = 0j
        self._looks: list[tuple[float, float, float]] = []
        """Frequency [Hz], phase error [rad] and base level [m/s2] of each look (measurement)."""

    def see(self, frequency_hz: float, seen: SettledState) -> tuple[float, float]:
        """Add a look (measurement). Return its phase error [rad] and the remaining change of the motion."""
        moved = self._plan.motion(seen.harmonics)
        off = float(np.angle(moved)) - radians(self._plan.phase_deg)
        error_rad = (off + pi) % (2 * pi) - pi
        self._looks.append((frequency_hz, error_rad, seen.base.amplitude))
        kept = self._transient(frequency_hz)
        self._grown *= (seen.base.amplitude / self._grown) ** (1.0 - kept)
        motion = moved * seen.base.amplitude
        left = abs(motion - self._motion) * kept / (1.0 - kept) / max(abs(motion), 1e-300)
        self._motion = motion
        bends = abs(self._bend_hz * log(seen.base.amplitude / self._grown)) / self._mode.half_width_hz
        return error_rad, max(left, bends)

    def next_hz(self, frequency_hz: float, base: float) -> float:
        """Return the next frequency within the plan's range [Hz]; ``base`` is the next base level [m/s2]."""
        foreseen_hz = self._bend_hz * (1.0 - self._transient(frequency_hz)) * log(base / self._grown)
        widest_hz = self._plan.widest_step_hz
        step_hz = min(max(foreseen_hz + self._off_hz(frequency_hz), -widest_hz), widest_hz)
        return min(max(frequency_hz + step_hz, self._plan.low_hz), self._plan.high_hz)

    def learn(self, found: SettledState, error_rad: float) -> LearntMode:
        """Return the mode: the half-width that best explains the phase drift of all looks, and ``bend_hz``.

        If no half-width near the earlier one explains the drift, the specimen changed to another motion. The
        half-width is then kept, and ``bend_hz`` set to zero.
        """
        grown, bend_hz = log(found.base.amplitude / self._last.base_m_per_s2), self._mode.bend_hz
        if abs(grown) > self._plan.level_tolerance:
            bend_hz = (found.frequency_hz - self._last.frequency_hz) / grown
        frequency_hz, error, base = np.array(self._looks).T
        turned = 2 * pi * self._turns / frequency_hz.mean()

        def residual(width_hz: float) -> float:
            """Return the mean square of the phase drift that a given half-width leaves unexplained [rad2]."""
            levels, level = [], log(self._last.base_m_per_s2)
            for each in np.log(base):
                level += (1.0 - exp(-turned * width_hz)) * (each - level)
                levels.append(level - log(found.base.amplitude))
            rest_hz = found.frequency_hz + error_rad * width_hz + bend_hz * np.array(levels)
            away_hz = frequency_hz + width_hz * error - rest_hz
            drift = np.diff(error) + 0.5 * turned * (away_hz[1:] + away_hz[:-1])
            return float(np.mean(drift**2))

        wider = _WIDER if self._plan.is_fundamental else _MUCH_WIDER
        left = np.array([residual(self._mode.half_width_hz * exp(each)) for each in wider])
        best = int(np.argmin(left + (_SURE_RAD * wider) ** 2 / (len(base) - 1)))
        if left[best] > _EXPLAINED_RAD**2:
            return replace(self._mode, bend_hz=0.0, steeper_hz=0.0)
        width_hz = max(self._mode.narrowest_hz, self._mode.half_width_hz * exp(wider[best]))
        most_hz = _STEEPER * abs(bend_hz) if self._mode.bend_hz else 0.0
        steeper_hz = min(max(bend_hz - self._mode.bend_hz, -most_hz), most_hz)
        return LearntMode(self._mode.narrowest_hz, width_hz, bend_hz, steeper_hz)

    def _off_hz(self, frequency_hz: float) -> float:
        """From the newest two looks, return the frequency change that corrects the phase error [Hz]."""
        if not self._looks:
            return 0.0
        error_rad = self._looks[-1][1]
        # Before the first measurement only the level has changed: assume the same phase error as now.
        before_rad = self._looks[-2][1] if len(self._looks) > 1 else error_rad
        is_slow = error_rad * before_rad > 0 and abs(error_rad) > _SLOW * abs(before_rad)
        self._gain = min(self._gain * _GROWTH, _LARGEST_GAIN) if is_slow else _GAIN
        drifted_hz = (error_rad - before_rad) * frequency_hz / (2 * pi * self._turns)
        return self._gain * error_rad * self._mode.half_width_hz + _GAIN * drifted_hz

    def _transient(self, frequency_hz: float) -> float:
        """Return the fraction of a decaying transient that remains after one look (measurement)."""
        return exp(-2 * pi * self._mode.half_width_hz * self._turns / frequency_hz)


_NEAR_DEG = 35.0
"""Largest phase error on the straight part of the phase curve, from which the slope is taken [degrees]."""
_FEWEST = 2
_NEAREST = 3
"""Number of measurements nearest to the resonance that determine a frequency-dependent slope of the phase."""
_STEEPEST_DEG = 85.0
"""Upper limit on phase errors in the fit, because the tangent of 90 degrees is infinite [degrees]."""
_BEND = 0.15
"""Largest relative difference between the phase slopes on the straight part and at the resonance."""


@dataclass(frozen=True)
class PhaseError:
    """Phase minus target phase at one frequency [degrees], with the standard uncertainty due to scatter."""

    frequency_hz: float
    error_deg: float
    uncertainty_deg: float


@dataclass(frozen=True)
class PhaseResonance:
    """Frequency of a phase resonance, and slope of the phase there."""

    frequency_hz: float
    uncertainty_hz: float
    """Standard uncertainty of the frequency, including the phase uncertainty of the sensors [Hz]."""
    slope_deg_per_hz: float

    @property
    def half_width_hz(self) -> float:
        """Half of the half-power bandwidth (damping ratio times frequency), from the phase slope [Hz]."""
        return 180 / (pi * abs(self.slope_deg_per_hz)) if self.slope_deg_per_hz else 0.0


@dataclass
class PhaseSearch:
    """Search for the frequency at which a phase that falls with frequency crosses its target."""

    low_hz: float
    high_hz: float
    widest_step_hz: float
    """Largest frequency step while the resonance is not bracketed [Hz]."""
    tries: list[PhaseError] = field(default_factory=list)
    is_mode: bool = True
    """Whether the phase follows a linear mode. If not, only the nearest measurements determine the slope."""

    def next_hz(self) -> float:
        """Return the next frequency at which to measure [Hz]; requires at least one earlier measurement."""
        last = self.tries[-1]
        if len(self.tries) == 1:
            step_hz = 0.5 * self.widest_step_hz
            return self._clip(last.frequency_hz + (step_hz if last.error_deg > 0 else -step_hz))
        below = [each for each in self.tries if each.error_deg > 0]
        above = [each for each in self.tries if each.error_deg <= 0]
        if below and above:
            low = max(below, key=lambda each: each.frequency_hz)
            high = min(above, key=lambda each: each.frequency_hz)
            if low.frequency_hz < high.frequency_hz:
                # Keep the zero of the secant away from both ends of the bracket, so that the bracket shrinks.
                share = low.error_deg / (low.error_deg - high.error_deg)
                edge = 0.05
                return low.frequency_hz + min(max(share, edge), 1 - edge) * (
                    high.frequency_hz - low.frequency_hz
                )
        return self._clip(self._outwards(last))

    def resonance(self, sensor_phase_deg: float) -> PhaseResonance:
        """Return the resonance: the zero of a line fitted to the phases measured near it.

        ``sensor_phase_deg`` is the standard uncertainty of the error common to these phases [degrees].
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
        # Near a mode, the tangent of the phase error, not the phase error itself, is linear in frequency.
        error = np.degrees(np.tan(np.radians(np.clip(error_deg, -_STEEPEST_DEG, _STEEPEST_DEG))))
        if np.ptp(frequency_hz) == 0.0 or np.ptp(error) == 0.0:
            # All frequencies are equal, or all phase errors are too large: the zero is undetermined.
            return PhaseResonance(best.frequency_hz, float("inf"), 0.0)
        # The tangent magnifies errors of the phase by 1 / cos^2, so each measurement has the weight cos^4.
        weight = np.cos(np.radians(error_deg)) ** 4
        away_hz = frequency_hz - float(weight @ frequency_hz / weight.sum())
        slope = float((weight * away_hz) @ error / ((weight * away_hz) @ away_hz))
        # Extrapolate from the best measurement, because other modes bend the line and so shift its zero.
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

    def _clip(self, frequency_hz: float) -> float:
        return min(max(frequency_hz, self.low_hz), self.high_hz)
