"""Recording what has settled, and saying which level the base really had meanwhile."""

from ..excitation import Segment
from ..plan import RunState
from ..recording import SegmentNote
from ._control_action import Controller
from ._level_control import measured_level
from ._settling_controller import SettledState, SettlingController


def recorded(
    settling_controller: SettlingController, found: SettledState, segment: Segment, duration_s: float
) -> Controller[None]:
    """Record a settled motion as a segment, and note the level that was achieved in it."""
    loop = settling_controller.loop
    loop.forget()
    yield from loop.listen(RunState.RECORDING, duration_s, segment)
    measured = measured_level(loop.periods.base)
    loop.note(
        SegmentNote(
            segment=segment.label,
            frequency_hz=found.frequency_hz,
            drive_hz=loop.drive_hz,
            base_m_per_s2=measured.amplitude,
            base_u=measured.uncertainty,
            level=settling_controller.held(measured),
            response_ii=found.response,
            motion=found.judgement.steadiness,
            period=found.judgement.period,
        )
    )
