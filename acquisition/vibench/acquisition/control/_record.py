"""Recording what has settled, and saying which level the base really had meanwhile."""

import json
from dataclasses import dataclass

from ..excitation import Segment
from ..plan import RunState
from ._control_action import Controller
from ._level_control import Held, MeasuredLevel, measured_level
from ._settling_controller import SettledState, SettlingController, shortened


@dataclass(frozen=True)
class Recorded:
    """The base over a recorded stretch."""

    base: MeasuredLevel
    """Acceleration of its fundamental [m/s2]."""
    held: Held


def recorded(
    settling_controller: SettlingController, found: SettledState, segment: Segment, duration_s: float
) -> Controller[Recorded]:
    """Record a settled motion as a segment, and note the level that was achieved in it."""
    loop = settling_controller.loop
    loop.forget()
    yield from loop.listen(RunState.RECORDING, duration_s, segment)
    measured = measured_level(loop.periods.base)
    result = Recorded(measured, settling_controller.held(measured))
    said = {
        "segment": segment.label,
        "frequency_hz": found.frequency_hz,
        "drive_hz": loop.drive_hz,
        "base_m_per_s2": shortened(measured.amplitude),
        "base_u": shortened(measured.uncertainty),
        "level": result.held.value,
        "response_ii": shortened(found.response),
        "motion": found.judgement.steadiness.value,
        "period": found.judgement.period,
    }
    loop.note("achieved", json.dumps(said))
    return result
