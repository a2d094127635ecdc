"""Recording what has settled, and saying which level the base really had meanwhile."""

from dataclasses import dataclass

from ..excitation import Segment
from ..plan import RunState
from ..recording import Held, SegmentNote
from ._control_action import Controller
from ._level_control import MeasuredLevel, measured_level
from ._settling_controller import SettledState, SettlingController


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
    loop.note(
        SegmentNote(
            segment=segment.label,
            frequency_hz=found.frequency_hz,
            drive_hz=loop.drive_hz,
            base_m_per_s2=measured.amplitude,
            base_u=measured.uncertainty,
            level=result.held,
            response_ii=found.response,
            motion=found.judgement.steadiness,
            period=found.judgement.period,
        )
    )
    return result
