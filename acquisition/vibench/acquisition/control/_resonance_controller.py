"""Tracking a phase resonance from level to level: searched once, then followed by a phase-locked loop."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, exp, hypot, pi, radians, sqrt

import numpy as np

from ..excitation import ResonanceTracking
from ..plan import LOOK_PERIODS, RunState
from ..recording import Held, LockResult, ResonanceNote, Steadiness
from ._closed_loop_check import require_answer
from ._control_action import Controller
from ._mode_fit import Mode, fitted_mode
from ._phase_search import PhaseError, PhaseResonance, PhaseSearch
from ._record import recorded, recorded_and_judged
from ._settling_controller import SettledState, SettlingController
from ._sine_loop import SineLoop
from ._start import moved, started
from ._stroboscope import Periods

_LOOP_GAIN = 0.3
"""Part of the error of the phase that the phase-locked loop takes out at each look."""
_SLOW, _GROWTH, _LARGEST_GAIN = 0.75, 1.5, 4.0
"""An error that keeps more than this of itself in a look makes the gain grow by this factor, up to this."""
_LOST_RAD = pi / 4
"""An error of the phase beyond which the loop is no longer on the resonance."""
_CORRECTED = 0.5
"""Standard uncertainty of the correction for the phase that is left, as a share."""
_LEFT = 1.5
"""How far the motion may have to go still, over the tolerance of the phase in radians."""
_TOLD = 0.02
"""Spread of frequencies, over the half-width, from which on their errors tell another half-width."""
_LOOKS_LOCKED = 3
"""Looks in a row with phase and level where they should be, before it counts as locked."""
_BATCHES = 8
_FURTHEST = 1.5
"""Half-widths of the resonance between it and the furthest point of a flank."""


def track_resonance(loop: SineLoop, plan: ResonanceTracking) -> Controller[None]:
    """Lock on to the resonance at every level, record there, go on to the next level from there."""
    yield from started(loop, plan.start_hz, plan.held_levels[0])
    last = TrackedPlace(plan.start_hz, 0.0)
    for number in range(len(plan.accelerations_m_per_s2)):
        followed = (yield from _followed(loop, plan, number, last)) if last.half_width_hz else None
        last = followed or (yield from _searched(loop, plan, number, last))
    yield from loop.ramp_down()
    yield from loop.say()


@dataclass(frozen=True)
class TrackedPlace:
    """Where a level was left, and what the phase-locked loop needs to know of the mode."""

    frequency_hz: float
    half_width_hz: float
    """Zero as long as no level was found: the next one is searched for."""
    risen_hz: float = 0.0
    """From the level before."""


def _followed(
    loop: SineLoop, plan: ResonanceTracking, number: int, last: TrackedPlace
) -> Controller[TrackedPlace | None]:
    """Go to the next level under the phase-locked loop and record there; None far off the resonance."""
    controller = SettlingController(loop, plan.settling, plan.held_levels[number])
    law = PhaseLaw(plan, last.half_width_hz)
    looks, lock = yield from _locked(controller, plan, law, last)
    if lock is None:
        return None
    periods, half_width_hz = looks * LOOK_PERIODS, law.seen_half_width_hz
    segment = plan.segment(number, loop.setting.frequency_hz)
    found = yield from recorded_and_judged(controller, segment, plan.record_s, periods / loop.drive_hz)
    error = _phase_error(loop.periods, found, plan)
    if abs(error.error_deg) > plan.phase_tolerance_deg:
        lock = LockResult.LOST
    left_deg = hypot(error.uncertainty_deg, _sensor_phase_deg(plan, found), _CORRECTED * error.error_deg)
    resonance = PhaseResonance(
        found.drive_hz + radians(error.error_deg) * half_width_hz,
        radians(left_deg) * half_width_hz,
        -degrees(1.0) / half_width_hz,
    )
    _say(loop, plan, number, found, Tracked(resonance, None, lock, looks, periods))
    return TrackedPlace(found.frequency_hz, last.half_width_hz, found.frequency_hz - last.frequency_hz)


def _locked(
    controller: SettlingController, plan: ResonanceTracking, law: "PhaseLaw", last: TrackedPlace
) -> Controller[tuple[int, LockResult | None]]:
    """Hold phase and level at once; gives the looks it took, and how it ended: None far off the resonance.

    The frequency moves by ``g (tau / L (e[k] - e[k-1]) + e[k])`` half-widths, e the error of the phase in
    radians, L the time of a look and tau that in which the mode forgets: proportion and sum, whose zero lies
    on the mode's pole, so that the error falls by the share g at every look. Contacts make the phase fall
    more gently over the frequency: g grows as long as the error does not fall as it should. A bent resonance
    moves as the motion grows to its new level: what it moved by at the level before is added as fast as that.
    """
    loop, error_rad = controller.loop, 0.0
    moved(loop, last.frequency_hz, controller.level)
    tolerance_rad = radians(plan.phase_tolerance_deg)
    in_a_row, looks = 0, plan.most_periods // LOOK_PERIODS
    for look in range(1, looks + 1):
        now = loop.setting
        yield from loop.listen(RunState.SETTLING, LOOK_PERIODS / now.frequency_hz)
        base, seen = controller.measured(), controller.found(0.0)
        require_answer(loop.rig, now.frequency_hz, now.setting_vpp, base.amplitude)
        error_rad, left = law.see(now.frequency_hz, seen)
        is_on = abs(error_rad) <= tolerance_rad and left <= _LEFT * tolerance_rad and seen.held is Held.WITHIN
        in_a_row = in_a_row + 1 if is_on else 0
        if in_a_row == _LOOKS_LOCKED:
            return look, LockResult.LOCKED
        frequency_hz = law.next_hz(now.frequency_hz, last.risen_hz, look)
        loop.change(frequency_hz, controller.prompt_vpp(base, frequency_hz))
    return looks, None if abs(error_rad) > _LOST_RAD else LockResult.LOST


class PhaseLaw:
    """The law of the phase-locked loop."""

    def __init__(self, plan: ResonanceTracking, half_width_hz: float) -> None:
        self._plan = plan
        self._half_width_hz = half_width_hz
        self._before_rad = self._error_rad = 0.0
        self._motion = 0j
        self._gain = _LOOP_GAIN
        self._rested: list[tuple[float, float]] = []

    @property
    def seen_half_width_hz(self) -> float:
        """Half-width by the line through the newer half of frequencies and errors, or the one given [Hz].

        Where the frequency hardly moved the line tells nothing: the given one counts as points of its own.
        """
        frequency_hz, rested_rad = np.array(self._rested[len(self._rested) // 2 :]).T
        away_hz = frequency_hz - frequency_hz.mean()
        given = len(away_hz) * (_TOLD * self._half_width_hz) ** 2
        fallen = given / self._half_width_hz - float(away_hz @ rested_rad)
        if fallen <= 0.0:
            return self._half_width_hz * _LARGEST_GAIN / _LOOP_GAIN
        return max(self._half_width_hz, (given + float(away_hz @ away_hz)) / fallen)

    def see(self, frequency_hz: float, seen: SettledState) -> tuple[float, float]:
        """Take in a look; gives the error of the phase [rad] and what the motion has still to go, a share."""
        moved = self._plan.phase_of.motion(seen.transmissibility)
        off = float(np.angle(moved)) - radians(self._plan.phase_deg)
        error_rad = (off + pi) % (2 * pi) - pi
        # Nothing is known of what was before the first look but that it was another level.
        self._before_rad = self._error_rad if self._rested else error_rad
        self._error_rad = error_rad
        kept = exp(-1.0 / self._forgets(frequency_hz))
        rested_rad = (error_rad - kept * self._before_rad) / (1.0 - kept)
        self._rested.append((frequency_hz, rested_rad))
        motion = moved * seen.base.amplitude
        left = abs(motion - self._motion) * kept / (1.0 - kept) / max(abs(motion), 1e-300)
        self._motion = motion
        return error_rad, left

    def next_hz(self, frequency_hz: float, rise_hz: float, look: int) -> float:
        """Give the next frequency, within the plan's band; the resonance should rise by so much [Hz]."""
        error_rad, before_rad = self._error_rad, self._before_rad
        is_slow = error_rad * before_rad > 0 and abs(error_rad) > _SLOW * abs(before_rad)
        self._gain = min(self._gain * _GROWTH, _LARGEST_GAIN) if is_slow else _LOOP_GAIN
        wanted = self._gain * error_rad + _LOOP_GAIN * self._forgets(frequency_hz) * (error_rad - before_rad)
        widest_hz = self._plan.widest_step_hz
        kept = exp(-1.0 / self._forgets(frequency_hz))
        wanted_hz = wanted * self._half_width_hz + rise_hz * (1.0 - kept) * kept ** (look - 1)
        step_hz = min(max(wanted_hz, -widest_hz), widest_hz)
        return min(max(frequency_hz + step_hz, self._plan.low_hz), self._plan.high_hz)

    def _forgets(self, frequency_hz: float) -> float:
        """Give the looks in which the mode forgets."""
        return frequency_hz / (2 * pi * self._half_width_hz * LOOK_PERIODS)


def _searched(
    loop: SineLoop, plan: ResonanceTracking, number: int, last: TrackedPlace
) -> Controller[TrackedPlace]:
    """Search the resonance at one level in settled motion, and record there."""
    level = plan.held_levels[number]
    settling_controller = SettlingController(loop, plan.settling, level)
    search = PhaseSearch(plan.low_hz, plan.high_hz, plan.widest_step_hz)
    states: list[SettledState] = []
    frequency_hz, lock = last.frequency_hz, LockResult.LOST
    for _ in range(plan.most_tries):
        moved(loop, frequency_hz, level)
        states.append((yield from settling_controller.settled()))
        error = _phase_error(loop.periods, states[-1], plan)
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
    resonance = search.resonance(_sensor_phase_deg(plan, found))
    mode = None
    if lock is LockResult.LOCKED:
        flanks = yield from _flanks(settling_controller, plan, resonance)
        mode = _mode([*states, *flanks], resonance)
        # Back from the flanks before the recording: the next level begins where this one ends.
        moved(loop, found.frequency_hz, level)
        found = yield from settling_controller.settled()
    yield from recorded(settling_controller, found, plan.segment(number, found.frequency_hz), plan.record_s)
    periods = round(sum(each.waited_s * each.drive_hz for each in states))
    _say(loop, plan, number, found, Tracked(resonance, mode, lock, len(search.tries), periods))
    if lock is not LockResult.LOCKED:
        return TrackedPlace(found.frequency_hz, last.half_width_hz)
    width_hz = resonance.half_width_hz if mode is None else mode.damping_ratio * mode.frequency_hz
    # Contacts bend the flanks: the first width, found without them, is kept.
    return TrackedPlace(found.frequency_hz, last.half_width_hz or width_hz)


@dataclass(frozen=True)
class Tracked:
    """What was found of a mode at one level."""

    resonance: PhaseResonance
    mode: Mode | None
    lock: LockResult
    tries: int
    periods: int
    """Of the drive, until then."""


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


def _sensor_phase_deg(plan: ResonanceTracking, found: SettledState) -> float:
    """Give what both sensors' phases and sensitivities leave open of the phase [degrees]."""
    # Of a difference of motions the phase also turns with their ratio; of a single one it does not.
    turned = plan.phase_of.motion(found.transmissibility) - found.transmissibility
    size = max(abs(plan.phase_of.motion(found.transmissibility)), plan.sensor_gain)
    return hypot(plan.sensor_phase_deg, degrees(plan.sensor_gain * abs(turned) / size))


def _phase_error(periods: Periods, found: SettledState, plan: ResonanceTracking) -> PhaseError:
    """Compare the phase of m0 against the base with the wanted one; batches tell its uncertainty."""
    newer = periods.last(periods.count // 2)
    length = len(newer.base) // _BATCHES
    angle = float(np.angle(plan.phase_of.motion(found.transmissibility)))
    error_deg = (degrees(angle) - plan.phase_deg + 180) % 360 - 180
    if length == 0:
        return PhaseError(found.drive_hz, error_deg, 180.0)
    used = slice(len(newer.base) - length * _BATCHES, None)
    base = newer.base[used].reshape(_BATCHES, length).mean(axis=1)
    response = newer.response[used, 1].reshape(_BATCHES, length).mean(axis=1)
    ratios = response / base
    turn = found.transmissibility / ratios.mean()
    ratios = np.array([plan.phase_of.motion(complex(each * turn)) for each in ratios])
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
            phase_deg=degrees(float(np.angle(plan.phase_of.motion(found.transmissibility)))),
            response_ii=found.response,
            base_m_per_s2=found.base.amplitude,
            base_u=found.base.uncertainty,
            held=found.held,
            motion=found.judgement.steadiness,
            tries=tracked.tries,
            periods=tracked.periods,
            lock=tracked.lock,
            mode_hz=None if mode is None else mode.frequency_hz,
            mode_u_hz=None if mode is None else mode.frequency_u_hz,
            damping_ratio=None if mode is None else mode.damping_ratio,
        )
    )
