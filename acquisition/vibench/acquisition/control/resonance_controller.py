"""Track a phase resonance from level to level: find it by a search, then follow it by a phase-locked loop."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, hypot, isfinite, pi, radians, sqrt

import numpy as np
from numpy.typing import NDArray

from ..excitation.plan import BaseLevel
from ..excitation.resonance_tracking import ResonanceTracking
from ..plan import LOOK_PERIODS, RunState, needed_vpp
from ..recording import Hold, LockResult, ResonanceNote, Steadiness
from ..rig import OnTable
from .control_action import Controller
from .phase_law import LearntMode, PhaseError, PhaseLaw, PhaseResonance, PhaseSearch, TrackedPlace
from .settling_controller import SettledState, SettlingController, record_and_judge, record_settled
from .sine_loop import SineLoop, move, start
from .steadiness import ORDERS, Periods

_UNKNOWNS = 8
"""Number of real unknowns in the fit: frequency, damping, and a complex polynomial of degree two."""
_SURE = 2.0
"""Smallest accepted quotient of a damping ratio and its standard uncertainty."""


@dataclass(frozen=True)
class Mode:
    """A damped mode, as fitted to measured transmissibilities."""

    frequency_hz: float
    """Undamped natural frequency of the mode [Hz]."""
    frequency_u_hz: float
    """Standard uncertainty of the frequency, from the residuals of the fit [Hz]."""
    damping_ratio: float


def fit_mode(frequency_hz: NDArray[np.float64], transmissibility: NDArray[np.complex128]) -> Mode | None:
    """Fit one mode: T (s^2 + a1 s + a2) = b0 + b1 s + b2 s^2, with real a and complex b.

    Return None for too few points, a damping within its uncertainty, or a frequency outside the points.

    The polynomial on the right contains the residue of the mode, the base motion itself and the flanks of
    other modes. An error common to all phases only rotates this polynomial. The method is Levy's linear least
    squares, with the equations reweighted by the fitted denominator.

    Parameters
    ----------
    frequency_hz, transmissibility
        Frequencies [Hz] and complex transmissibilities T around the resonance, each of shape (points,).
    """
    if 2 * len(frequency_hz) <= _UNKNOWNS:
        return None
    middle_hz = float(np.mean(frequency_hz))
    s = np.asarray(1j * frequency_hz / middle_hz, dtype=np.complex128)
    weight = np.ones(len(s))
    solution, covariance = np.zeros(_UNKNOWNS), np.zeros((_UNKNOWNS, _UNKNOWNS))
    for _ in range(3):
        solution, covariance = _solve(s, transmissibility, weight)
        weight = 1 / np.abs(s**2 + solution[0] * s + solution[1])
    if solution[1] <= 0 or solution[0] <= _SURE * sqrt(max(0.0, float(covariance[0, 0]))):
        return None
    natural = sqrt(float(solution[1]))
    if not min(frequency_hz) <= middle_hz * natural <= max(frequency_hz):
        return None
    return Mode(
        frequency_hz=middle_hz * natural,
        frequency_u_hz=middle_hz * sqrt(max(0.0, float(covariance[1, 1]))) / (2 * natural),
        damping_ratio=float(solution[0]) / (2 * natural),
    )


def _solve(
    s: NDArray[np.complex128], answer: NDArray[np.complex128], weight: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # Solve a1 s T + a2 T - (b0 + b1 s + b2 s^2) = -s^2 T as two equations: real part and imaginary part.
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


_LOST_RAD = pi / 4
"""Phase error above which the loop has lost the resonance."""
_CORRECTED = 0.5
"""Relative standard uncertainty of the frequency correction for the remaining phase error."""
_LEFT, _LEFT_TO_CREEP = 1.5, 0.5
"""Allowed remaining change of a locked motion, in phase tolerances; second value: for other harmonics."""
_LOOKS_LOCKED = 3
"""Number of consecutive measurements (looks) within tolerance after which the loop counts as locked."""
_FINEST = 2e-6
"""Smallest relative frequency step of a search; if a smaller step is needed, the phase jumps."""
_BATCHES = 8
_KNOWN = 4.0
"""Ratio of an amplitude to its standard error above which the phase of the motion is well defined."""
_FURTHEST = 1.5
"""Largest distance of a flank point from the resonance, in half-widths."""


def track_resonance(loop: SineLoop, plan: ResonanceTracking) -> Controller[None]:
    """Lock on to the resonance at every level and record there; start each level where the last ended."""
    loop.drives = plan.subharmonic
    if not plan.is_fundamental:
        # The tracked order may be 1 % of the motion: judge this order, not the whole motion.
        loop.settling_order = plan.harmonic
    yield from start(loop, plan.start_hz, plan.held_levels[0])
    last = TrackedPlace(plan.start_hz, plan.accelerations_m_per_s2[0])
    for number in range(len(plan.accelerations_m_per_s2)):
        followed = (yield from _go_on(loop, plan, number, last, last.mode)) if last.mode else None
        last = followed or (yield from _search(loop, plan, number, last))
    yield from loop.ramp_down()


def _go_on(
    loop: SineLoop, plan: ResonanceTracking, number: int, last: TrackedPlace, mode: LearntMode
) -> Controller[TrackedPlace | None]:
    """Follow the resonance to the next level and record there; return None if the loop lost the resonance."""
    level, law = plan.held_levels[number], PhaseLaw(plan, last, mode)
    change = _first_change(loop, level, last)
    begin_hz = law.next_hz(last.frequency_hz, last.base_m_per_s2 * change)
    loop.change(begin_hz, loop.bounded_vpp(loop.setting.setting_vpp * change))
    controller = SettlingController(loop, plan.settling, level)
    looks, lock = yield from _lock(controller, plan, law)
    if lock is None:
        return None
    periods = looks * LOOK_PERIODS * loop.drives
    segment = plan.segment(number, loop.setting.frequency_hz)
    found = yield from record_and_judge(controller, segment, plan.record_s, periods / loop.drive_hz)
    error = _phase_error(loop.periods, found, plan)
    is_steady = found.held is Hold.WITHIN and found.judgement.steadiness is Steadiness.PERIODIC
    is_met = abs(error.error_deg) <= plan.phase_tolerance_deg and (lock is LockResult.LOCKED or is_steady)
    is_met = is_met and _is_there(plan, found)
    lock = LockResult.LOCKED if is_met else LockResult.LOST
    mode = law.learn(found, radians(error.error_deg))
    left_deg = hypot(error.uncertainty_deg, _open_phase_deg(plan, found), _CORRECTED * error.error_deg)
    resonance = PhaseResonance(
        found.drive_hz + radians(error.error_deg) * mode.half_width_hz,
        radians(left_deg) * mode.half_width_hz,
        -degrees(1.0) / mode.half_width_hz,
    )
    _say(loop, plan, number, found, resonance, lock, tries=looks, periods=periods)
    return TrackedPlace(found.frequency_hz, found.base.amplitude, mode)


def _lock(
    controller: SettlingController, plan: ResonanceTracking, law: PhaseLaw
) -> Controller[tuple[int, LockResult | None]]:
    """Control phase and level. Return the number of looks (measurements), and the result or None."""
    loop, error_rad = controller.loop, 0.0
    tolerance_rad = radians(plan.phase_tolerance_deg)
    most_left = tolerance_rad * (_LEFT if plan.is_fundamental else _LEFT_TO_CREEP)
    in_a_row, looks = 0, plan.most_periods // (LOOK_PERIODS * loop.drives)
    for look in range(1, looks + 1):
        now = loop.setting
        yield from loop.listen(RunState.SETTLING, LOOK_PERIODS / loop.motion_hz)
        base, seen = controller.mean_level(), controller.settled_state(0.0)
        loop.require_answer(base.amplitude)
        error_rad, left = law.see(now.frequency_hz, seen)
        is_on = abs(error_rad) <= tolerance_rad and left <= most_left and seen.held is Hold.WITHIN
        in_a_row = in_a_row + 1 if is_on else 0
        if in_a_row == _LOOKS_LOCKED:
            return look, LockResult.LOCKED
        setting_vpp = controller.prompt_vpp(base)
        frequency_hz = law.next_hz(now.frequency_hz, base.amplitude * setting_vpp / now.setting_vpp)
        loop.change(frequency_hz, setting_vpp)
    return looks, None if abs(error_rad) > _LOST_RAD else LockResult.LOST


def _first_change(loop: SineLoop, level: BaseLevel, last: TrackedPlace) -> float:
    """Return the factor of the first change of the setting towards a new level.

    A specimen reduces the motion of a light table, but only after the specimen's own motion has grown. Until
    then the base follows the whole change of the setting, so the first change must be smaller.
    """
    bare_vpp = needed_vpp(loop.rig, last.base_m_per_s2, last.frequency_hz, OnTable.NOTHING)
    share = min(1.0, bare_vpp / loop.setting.setting_vpp)
    change = (level.acceleration_at(last.frequency_hz) / last.base_m_per_s2) ** share
    return float(min(max(change, 1 / level.most_change), level.most_change))


def _search(
    loop: SineLoop, plan: ResonanceTracking, number: int, last: TrackedPlace
) -> Controller[TrackedPlace]:
    level, rule = plan.held_levels[number], plan.settling
    if not plan.is_fundamental:
        # Super- and subharmonics settle slowly; early measurements would give a wrong phase slope.
        settled = 0.5 * radians(plan.phase_tolerance_deg) / plan.subharmonic
        rule = rule.model_copy(update={"tolerance": min(rule.tolerance, settled)})
    controller = SettlingController(loop, rule, level)
    search = PhaseSearch(plan.low_hz, plan.high_hz, plan.widest_step_hz, is_mode=plan.is_fundamental)
    states: list[SettledState] = []
    frequency_hz, lock = last.frequency_hz, LockResult.LOST
    for _ in range(plan.most_tries):
        move(loop, frequency_hz, level)
        states.append((yield from controller.settle()))
        error = _phase_error(loop.periods, states[-1], plan)
        search.tries.append(error)
        # The phase is random if the harmonic is only noise, and drifts while the motion settles.
        rests = plan.is_fundamental or states[-1].judgement.steadiness is Steadiness.PERIODIC
        is_known = rests and error.uncertainty_deg <= plan.phase_tolerance_deg
        if not any(_is_there(plan, each) for each in states[-2:]):
            lock = LockResult.ABSENT
            break
        if abs(error.error_deg) <= plan.phase_tolerance_deg and is_known and len(search.tries) > 1:
            lock = LockResult.LOCKED
            break
        next_hz = search.next_hz()
        if plan.low_hz < next_hz < plan.high_hz:
            # Convert the frequency from the converter's clock, which measured it, to the generator's clock.
            next_hz *= states[-1].frequency_hz / states[-1].drive_hz
        if next_hz == frequency_hz:
            lock = LockResult.AT_THE_EDGE
            break
        if not plan.is_fundamental and abs(next_hz - frequency_hz) < _FINEST * frequency_hz:
            lock = LockResult.BETWEEN_MOTIONS
            break
        frequency_hz = next_hz
    found = states[-1]
    resonance = search.resonance(_open_phase_deg(plan, found))
    mode = None
    if lock is LockResult.LOCKED and plan.is_fundamental:
        flanks = yield from _flanks(controller, plan, resonance)
        mode = _mode([*states, *flanks], resonance)
        # Return to the resonance for the recording; the search at the next level starts from this resonance.
        move(loop, found.frequency_hz, level)
        found = yield from controller.settle()
    yield from record_settled(controller, found, plan.segment(number, found.frequency_hz), plan.record_s)
    periods = round(sum(each.waited_s * each.drive_hz for each in states))
    _say(loop, plan, number, found, resonance, lock, tries=len(search.tries), periods=periods, mode=mode)
    if lock is not LockResult.LOCKED:
        return TrackedPlace(found.frequency_hz, found.base.amplitude, last.mode)
    width_hz = resonance.half_width_hz if mode is None else mode.damping_ratio * mode.frequency_hz
    # Contacts bend the flanks of the peak, so keep the width of the first level, measured without contacts. A
    # super- or subharmonic has no lower bound: its width depends on the distance to the first contact.
    narrowest_hz = width_hz if plan.is_fundamental else 0.0
    learnt = last.mode or LearntMode(narrowest_hz, width_hz)
    return TrackedPlace(found.frequency_hz, found.base.amplitude, learnt)


def _flanks(
    controller: SettlingController, plan: ResonanceTracking, resonance: PhaseResonance
) -> Controller[list[SettledState]]:
    """Return settled states below and above the resonance, up to `_FURTHEST` half-widths away."""
    found: list[SettledState] = []
    pairs = plan.flank_pairs
    for place in (*range(-pairs, 0), *range(1, pairs + 1)):
        frequency_hz = resonance.frequency_hz + _FURTHEST * resonance.half_width_hz * place / pairs
        if plan.low_hz <= frequency_hz <= plan.high_hz:
            move(controller.loop, frequency_hz, controller.level)
            found.append((yield from controller.settle()))
    return found


def _mode(states: Sequence[SettledState], resonance: PhaseResonance) -> Mode | None:
    reach_hz = 1.1 * _FURTHEST * resonance.half_width_hz
    near = [each for each in states if abs(each.drive_hz - resonance.frequency_hz) <= reach_hz]
    return fit_mode(
        np.array([each.drive_hz for each in near]), np.array([each.transmissibility for each in near])
    )


def _is_there(plan: ResonanceTracking, found: SettledState) -> bool:
    """Return whether this can be the tracked motion; a subharmonic does not repeat after one drive period."""
    return plan.subharmonic == 1 or found.judgement.period != 1


def _open_phase_deg(plan: ResonanceTracking, found: SettledState) -> float:
    """Return the uncertainty of the phase due to both sensors' phases and sensitivities [degrees].

    For a super- or subharmonic, add the possible remaining change of the motion. A subharmonic settles so
    slowly that its change per look is not detected, so at least the settling tolerance is added.
    """
    if not plan.is_fundamental:
        remaining = found.judgement.remaining if isfinite(found.judgement.remaining) else 1.0
        if plan.subharmonic > 1:
            remaining = max(remaining, plan.settling.tolerance)
        return plan.subharmonic * hypot(plan.harmonic * plan.sensor_phase_deg, degrees(remaining))
    # The phase of the relative motion also depends on the ratio of the sensitivities of the two sensors.
    turned = plan.motion(found.harmonics) - found.transmissibility
    size = max(abs(plan.motion(found.harmonics)), plan.sensor_gain)
    return hypot(plan.sensor_phase_deg, degrees(plan.sensor_gain * abs(turned) / size))


def _phase_error(periods: Periods, found: SettledState, plan: ResonanceTracking) -> PhaseError:
    """Return the phase of m0 relative to the base, minus its target, and its uncertainty from batch means."""
    count = periods.count // 2
    newer = periods.last(count if plan.is_fundamental else min(count, plan.settling.periods))
    length = len(newer.base) // _BATCHES
    angle = float(np.angle(plan.motion(found.harmonics)))
    error_deg = (degrees(angle) - plan.phase_deg + 180) % 360 - 180
    if length == 0:
        return PhaseError(found.drive_hz, error_deg, 180.0)
    used = slice(len(newer.base) - length * _BATCHES, None)
    base = newer.base[used].reshape(_BATCHES, length).mean(axis=1)
    response = newer.response[used, 1:].reshape(_BATCHES, length, -1).mean(axis=1)
    # From the phase of each harmonic, subtract its order times the base phase. Then rotate and scale the
    # batches so that their mean equals ``found.harmonics``.
    away = np.angle(base * base.mean().conjugate())
    orders = np.arange(1, ORDERS) / plan.subharmonic
    ratios = response / np.exp(1j * np.outer(away, orders)) / np.abs(base)[:, None]
    ratios *= np.array(found.harmonics) / ratios.mean(axis=0)
    ratios = np.array([plan.motion(each) for each in ratios])
    if abs(ratios.mean()) <= _KNOWN * float(np.std(ratios, ddof=1)) / sqrt(_BATCHES):
        # The phase of pure noise has a bounded spread, which would give too small an uncertainty.
        return PhaseError(found.drive_hz, error_deg, 180.0)
    spread = float(np.std(np.angle(ratios * ratios.mean().conjugate()), ddof=1))
    return PhaseError(found.drive_hz, error_deg, degrees(spread) / sqrt(_BATCHES))


def _say(
    loop: SineLoop,
    plan: ResonanceTracking,
    number: int,
    found: SettledState,
    resonance: PhaseResonance,
    lock: LockResult,
    *,
    tries: int,
    periods: int,
    mode: Mode | None = None,
) -> None:
    """Write a note with the result at one level; the measurement took ``periods`` periods of the drive."""
    if lock is LockResult.LOCKED and found.judgement.steadiness is Steadiness.UNSETTLED:
        lock = LockResult.LOST
    is_locked = lock is LockResult.LOCKED
    mode = mode if is_locked else None
    base_m = found.base.amplitude / (2 * pi * found.drive_hz) ** 2
    loop.note(
        ResonanceNote(
            level=number,
            asked_m_per_s2=plan.accelerations_m_per_s2[number],
            frequency_hz=resonance.frequency_hz if is_locked else None,
            frequency_u_hz=resonance.uncertainty_hz if is_locked else None,
            at_hz=found.drive_hz,
            phase_deg=degrees(float(np.angle(plan.motion(found.harmonics)))),
            response_ii=found.response,
            base_m_per_s2=found.base.amplitude,
            base_u=found.base.uncertainty,
            held=found.held,
            motion=found.judgement.steadiness,
            tries=tries,
            periods=periods,
            lock=lock,
            mode_hz=None if mode is None else mode.frequency_hz,
            mode_u_hz=None if mode is None else mode.frequency_u_hz,
            damping_ratio=None if mode is None else mode.damping_ratio,
            harmonic=plan.harmonic,
            subharmonic=plan.subharmonic,
            harmonic_m=None if plan.is_fundamental else abs(plan.motion(found.harmonics)) * base_m,
        )
    )
