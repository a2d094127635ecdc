"""Tracking a mode's phase resonance from level to level."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import degrees, sqrt

import numpy as np

from ..excitation import ResonanceTracking
from ._control_action import Conduct
from ._mode_fit import Mode, fitted_mode
from ._phase_search import PhaseError, PhaseResonance, PhaseSearch
from ._record import recorded
from ._settle import Settled, Settler, shortened
from ._sine_loop import SinePlay
from ._start import moved, started
from ._steadiness import Steadiness
from ._stroboscope import Periods

_BATCHES = 8
_FURTHEST = 1.5
"""Half-widths of the resonance between it and the furthest point of a flank."""


class Lock(StrEnum):
    """How a search for a resonance ended."""

    LOCKED = "locked"
    LOST = "not met within the tries"
    AT_THE_EDGE = "outside the range"


def track_resonance(play: SinePlay, plan: ResonanceTracking) -> Conduct[None]:
    """Lock on to the resonance at every level, record there, go on to the next level from there."""
    yield from started(play, plan.start_hz, plan.base_level(0))
    frequency_hz = plan.start_hz
    for number in range(len(plan.accelerations_m_per_s2)):
        frequency_hz = yield from _tracked(play, plan, number, frequency_hz)
    yield from play.ramp_down()
    yield from play.say()


def _tracked(play: SinePlay, plan: ResonanceTracking, number: int, start_hz: float) -> Conduct[float]:
    level = plan.base_level(number)
    settler = Settler(play, plan.settling, level)
    search = PhaseSearch(plan.low_hz, plan.high_hz, plan.widest_step_hz)
    visits: list[Settled] = []
    frequency_hz, lock = start_hz, Lock.LOST
    for _ in range(plan.most_tries):
        moved(play, frequency_hz, level)
        visits.append((yield from settler.settled()))
        error = _phase_error(play.periods, visits[-1], plan.phase_deg)
        search.tries.append(error)
        if abs(error.error_deg) <= plan.phase_tolerance_deg and len(search.tries) > 1:
            lock = Lock.LOCKED
            break
        next_hz = search.next_hz()
        if next_hz == frequency_hz:
            lock = Lock.AT_THE_EDGE
            break
        frequency_hz = next_hz
    found = visits[-1]
    resonance = search.resonance(plan.sensor_phase_deg)
    yield from recorded(settler, found, plan.segment(number, found.frequency_hz), plan.record_s)
    mode = None
    if lock is Lock.LOCKED:
        flanks = yield from _flanks(settler, plan, resonance)
        mode = _mode([*visits, *flanks], resonance)
    _say(play, plan, number, found, Tracked(resonance, mode, lock, len(search.tries)))
    return found.frequency_hz


@dataclass(frozen=True)
class Tracked:
    """What was found of a mode at one level."""

    resonance: PhaseResonance
    mode: Mode | None
    lock: Lock
    tries: int


def _flanks(settler: Settler, plan: ResonanceTracking, resonance: PhaseResonance) -> Conduct[list[Settled]]:
    """Measure on both sides, up to one and a half half-widths away."""
    found: list[Settled] = []
    pairs = plan.flank_pairs
    for place in (*range(-pairs, 0), *range(1, pairs + 1)):
        frequency_hz = resonance.frequency_hz + _FURTHEST * resonance.half_width_hz * place / pairs
        if plan.low_hz <= frequency_hz <= plan.high_hz:
            moved(settler.play, frequency_hz, settler.level)
            found.append((yield from settler.settled()))
    return found


def _mode(visits: Sequence[Settled], resonance: PhaseResonance) -> Mode | None:
    """Fit the mode to all that was visited near it."""
    reach_hz = 1.1 * _FURTHEST * resonance.half_width_hz
    near = [each for each in visits if abs(each.drive_hz - resonance.frequency_hz) <= reach_hz]
    return fitted_mode(
        np.array([each.drive_hz for each in near]), np.array([each.transmissibility for each in near])
    )


def _phase_error(periods: Periods, found: Settled, wanted_deg: float) -> PhaseError:
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


def _say(play: SinePlay, plan: ResonanceTracking, number: int, found: Settled, tracked: Tracked) -> None:
    is_told = tracked.lock is Lock.LOCKED and found.judgement.steadiness is not Steadiness.UNSETTLED
    said: dict[str, int | float | str | None] = {
        "level": number,
        "asked_m_per_s2": plan.accelerations_m_per_s2[number],
        "frequency_hz": shortened(tracked.resonance.frequency_hz) if is_told else None,
        "frequency_u_hz": shortened(tracked.resonance.uncertainty_hz) if is_told else None,
        "at_hz": shortened(found.drive_hz),
        "phase_deg": shortened(degrees(float(np.angle(found.transmissibility)))),
        "response_ii": shortened(found.response),
        "base_m_per_s2": shortened(found.base.amplitude),
        "base_u": shortened(found.base.uncertainty),
        "held": found.held.value,
        "motion": found.judgement.steadiness.value,
        "tries": tracked.tries,
        "lock": tracked.lock.value,
    }
    if is_told and tracked.mode is not None:
        said["mode_hz"] = shortened(tracked.mode.frequency_hz)
        said["mode_u_hz"] = shortened(tracked.mode.frequency_u_hz)
        said["damping_ratio"] = shortened(tracked.mode.damping_ratio)
    play.note("resonance", json.dumps(said))
