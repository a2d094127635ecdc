"""Tracking a mode's phase resonance from level to level."""

import json
from enum import StrEnum
from math import degrees, sqrt

import numpy as np

from ..excitation.resonance_tracking import ResonanceTracking
from .move import Conduct
from .phase_search import PhaseError, PhaseResonance, PhaseSearch
from .record import recorded
from .settle import Settled, Settler, shortened
from .sine_play import SinePlay
from .start import moved, started
from .steadiness import Steadiness
from .stroboscope import Periods

_BATCHES = 8


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
    frequency_hz, lock = start_hz, Lock.LOST
    found: Settled
    for _ in range(plan.most_tries):
        moved(play, frequency_hz, level)
        found = yield from settler.settled()
        search.tries.append(_phase_error(play.periods, found, plan.phase_deg))
        error = search.tries[-1]
        if abs(error.error_deg) <= plan.phase_tolerance_deg and len(search.tries) > 1:
            lock = Lock.LOCKED
            break
        next_hz = search.next_hz()
        if next_hz == frequency_hz:
            lock = Lock.AT_THE_EDGE
            break
        frequency_hz = next_hz
    resonance = search.resonance(plan.sensor_phase_deg)
    yield from recorded(settler, found, plan.segment(number, found.frequency_hz), plan.record_s)
    _say(play, plan, number, found, resonance, lock, len(search.tries))
    return found.frequency_hz


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


def _say(
    play: SinePlay,
    plan: ResonanceTracking,
    number: int,
    found: Settled,
    resonance: PhaseResonance,
    lock: Lock,
    tries: int,
) -> None:
    is_told = lock is Lock.LOCKED and found.judgement.steadiness is not Steadiness.UNSETTLED
    said = {
        "level": number,
        "asked_m_per_s2": plan.accelerations_m_per_s2[number],
        "frequency_hz": shortened(resonance.frequency_hz) if is_told else None,
        "frequency_u_hz": shortened(resonance.uncertainty_hz) if is_told else None,
        "at_hz": shortened(found.drive_hz),
        "base_m_per_s2": shortened(found.base.amplitude),
        "base_u": shortened(found.base.uncertainty),
        "held": found.held.value,
        "response_ii": shortened(found.response),
        "phase_deg": shortened(degrees(float(np.angle(found.transmissibility)))),
        "motion": found.judgement.steadiness.value,
        "period": found.judgement.period,
        "tries": tries,
        "lock": lock.value,
    }
    play.note("resonance", json.dumps(said))
