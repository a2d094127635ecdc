"""Tracking a mode's phase resonance from level to level.

A mode from a few points of its transmissibility: one resonance beside whatever else is near.

Finding the frequency at which a phase has a wanted value: secants inside a bracket that only narrows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import degrees, hypot, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from ..excitation import ResonanceTracking
from ..recording import LockResult, ResonanceNote, Steadiness
from ._control_action import Controller
from ._record import recorded
from ._settling_controller import SettledState, SettlingController
from ._sine_loop import SineLoop
from ._start import moved, started
from ._stroboscope import Periods

_UNKNOWNS = 8
"""Real numbers that are fitted: frequency, damping, and a complex polynomial of degree two."""


@dataclass(frozen=True)
class Mode:
    """A damped mode."""

    frequency_hz: float
    """Undamped natural frequency [Hz]."""
    frequency_u_hz: float
    """Standard uncertainty, from what the points leave [Hz]."""
    damping_ratio: float


def fitted_mode(frequency_hz: NDArray[np.float64], transmissibility: NDArray[np.complex128]) -> Mode | None:
    """Fit T (s^2 + a1 s + a2) = b0 + b1 s + b2 s^2 with real a and complex b; None with too few points.

    The polynomial on the right holds the mode's residue, the motion of the base itself and the flanks
    of other modes; a constant error of all phases only turns it. Levy's linear least squares, weighted
    once more by the denominator that it found.

    Parameters
    ----------
    frequency_hz, transmissibility
        Shape (points,), around the resonance.

    """
    if 2 * len(frequency_hz) <= _UNKNOWNS:
        return None
    middle_hz = float(np.mean(frequency_hz))
    s = np.asarray(1j * frequency_hz / middle_hz, dtype=np.complex128)
    weight = np.ones(len(s))
    solution, covariance = np.zeros(_UNKNOWNS), np.zeros((_UNKNOWNS, _UNKNOWNS))
    for _ in range(3):
        solution, covariance = _solved(s, transmissibility, weight)
        weight = 1 / np.abs(s**2 + solution[0] * s + solution[1])
    if solution[1] <= 0:
        return None
    natural = sqrt(float(solution[1]))
    return Mode(
        frequency_hz=middle_hz * natural,
        frequency_u_hz=middle_hz * sqrt(max(0.0, float(covariance[1, 1]))) / (2 * natural),
        damping_ratio=float(solution[0]) / (2 * natural),
    )


def _solved(
    s: NDArray[np.complex128], answer: NDArray[np.complex128], weight: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # a1 s T + a2 T - (b0 + b1 s + b2 s^2) = -s^2 T, real and imaginary parts apart.
    powers = np.stack([np.ones_like(s), s, s**2], axis=1)
    columns = np.concatenate([(s * answer)[:, None], answer[:, None], -powers, -1j * powers], axis=1)
    weighted = weight[:, None] * columns
    right = -weight * s**2 * answer
    matrix = np.concatenate([weighted.real, weighted.imag])
    target = np.concatenate([right.real, right.imag])
    solution = np.linalg.lstsq(matrix, target)[0]
    left = target - matrix @ solution
    variance = float(left @ left) / max(1, len(target) - _UNKNOWNS)
    return solution, variance * np.linalg.pinv(matrix.T @ matrix)


_NEAR_DEG = 35.0
"""Errors up to this are on the straight part of the phase: its slope is taken from them."""
_FEWEST = 2
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
        frequency_hz = np.array([each.frequency_hz for each in used])
        error_deg = np.array([each.error_deg for each in used])
        spread = float(np.var(frequency_hz))
        if spread == 0.0:
            return PhaseResonance(best.frequency_hz, float("inf"), 0.0)
        # The tangent of the error is a straight line through a mode, whose phase itself bends away from it.
        error = np.degrees(np.tan(np.radians(np.clip(error_deg, -_STEEPEST_DEG, _STEEPEST_DEG))))
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


_BATCHES = 8
_FURTHEST = 1.5
"""Half-widths of the resonance between it and the furthest point of a flank."""


def track_resonance(loop: SineLoop, plan: ResonanceTracking) -> Controller[None]:
    """Lock on to the resonance at every level, record there, go on to the next level from there."""
    yield from started(loop, plan.start_hz, plan.held_levels[0])
    frequency_hz = plan.start_hz
    for number in range(len(plan.accelerations_m_per_s2)):
        frequency_hz = yield from _tracked(loop, plan, number, frequency_hz)
    yield from loop.ramp_down()
    yield from loop.say()


def _tracked(loop: SineLoop, plan: ResonanceTracking, number: int, start_hz: float) -> Controller[float]:
    level = plan.held_levels[number]
    settling_controller = SettlingController(loop, plan.settling, level)
    search = PhaseSearch(plan.low_hz, plan.high_hz, plan.widest_step_hz)
    states: list[SettledState] = []
    frequency_hz, lock = start_hz, LockResult.LOST
    for _ in range(plan.most_tries):
        moved(loop, frequency_hz, level)
        states.append((yield from settling_controller.settled()))
        error = _phase_error(loop.periods, states[-1], plan.phase_deg)
        search.tries.append(error)
        if abs(error.error_deg) <= plan.phase_tolerance_deg and len(search.tries) > 1:
            lock = LockResult.LOCKED
            break
        next_hz = search.next_hz()
        if next_hz == frequency_hz:
            lock = LockResult.AT_THE_EDGE
            break
        frequency_hz = next_hz
    found = states[-1]
    resonance = search.resonance(plan.sensor_phase_deg)
    yield from recorded(settling_controller, found, plan.segment(number, found.frequency_hz), plan.record_s)
    mode = None
    if lock is LockResult.LOCKED:
        flanks = yield from _flanks(settling_controller, plan, resonance)
        mode = _mode([*states, *flanks], resonance)
    _say(loop, plan, number, found, Tracked(resonance, mode, lock, len(search.tries)))
    return found.frequency_hz


@dataclass(frozen=True)
class Tracked:
    """What was found of a mode at one level."""

    resonance: PhaseResonance
    mode: Mode | None
    lock: LockResult
    tries: int


def _flanks(
    settling_controller: SettlingController, plan: ResonanceTracking, resonance: PhaseResonance
) -> Controller[list[SettledState]]:
    """Measure on both sides, up to one and a half half-widths away."""
    found: list[SettledState] = []
    pairs = plan.flank_pairs
    for place in (*range(-pairs, 0), *range(1, pairs + 1)):
        frequency_hz = resonance.frequency_hz + _FURTHEST * resonance.half_width_hz * place / pairs
        if plan.low_hz <= frequency_hz <= plan.high_hz:
            moved(settling_controller.loop, frequency_hz, settling_controller.level)
            found.append((yield from settling_controller.settled()))
    return found


def _mode(states: Sequence[SettledState], resonance: PhaseResonance) -> Mode | None:
    """Fit the mode to all that was visited near it."""
    reach_hz = 1.1 * _FURTHEST * resonance.half_width_hz
    near = [each for each in states if abs(each.drive_hz - resonance.frequency_hz) <= reach_hz]
    return fitted_mode(
        np.array([each.drive_hz for each in near]), np.array([each.transmissibility for each in near])
    )


def _phase_error(periods: Periods, found: SettledState, wanted_deg: float) -> PhaseError:
    """Compare the phase of m0 over the base with the wanted one; batches of periods tell its uncertainty."""
    newer = periods.last(periods.count // 2)
    length = len(newer.base) // _BATCHES
    angle = float(np.angle(found.transmissibility))
    error_deg = (degrees(angle) - wanted_deg + 180) % 360 - 180
    if length == 0:
        return PhaseError(found.drive_hz, error_deg, 180.0)
    used = slice(len(newer.base) - length * _BATCHES, None)
    base = newer.base[used].reshape(_BATCHES, length).mean(axis=1)
    response = newer.response[used, 1].reshape(_BATCHES, length).mean(axis=1)
    ratios = response / base
    spread = float(np.std(np.angle(ratios * ratios.mean().conjugate()), ddof=1))
    return PhaseError(found.drive_hz, error_deg, degrees(spread) / sqrt(_BATCHES))


def _say(loop: SineLoop, plan: ResonanceTracking, number: int, found: SettledState, tracked: Tracked) -> None:
    is_told = tracked.lock is LockResult.LOCKED and found.judgement.steadiness is not Steadiness.UNSETTLED
    resonance, mode = (tracked.resonance, tracked.mode) if is_told else (None, None)
    loop.note(
        ResonanceNote(
            level=number,
            asked_m_per_s2=plan.accelerations_m_per_s2[number],
            frequency_hz=None if resonance is None else resonance.frequency_hz,
            frequency_u_hz=None if resonance is None else resonance.uncertainty_hz,
            at_hz=found.drive_hz,
            phase_deg=degrees(float(np.angle(found.transmissibility))),
            response_ii=found.response,
            base_m_per_s2=found.base.amplitude,
            base_u=found.base.uncertainty,
            held=found.held,
            motion=found.judgement.steadiness,
            tries=tracked.tries,
            lock=tracked.lock,
            mode_hz=None if mode is None else mode.frequency_hz,
            mode_u_hz=None if mode is None else mode.frequency_u_hz,
            damping_ratio=None if mode is None else mode.damping_ratio,
        )
    )
