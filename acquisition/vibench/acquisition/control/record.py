"""Recording what has settled, and saying which level the base really had meanwhile."""

from ..excitation.steps import Segment
from ..plan import RunState
from ..recording import SegmentNote
from .control_action import Controller
from .level_control import measured_level
from .settling_controller import SettledState, SettlingController


def recorded(
    settling_controller: SettlingController, found: SettledState, segment: Segment, duration_s: float
) -> Controller[None]:
    """Record a settled motion as a segment, and note the level that was achieved in it."""
    yield from _listened(settling_controller, segment, duration_s)
    _note(settling_controller, found, segment)


def recorded_and_judged(
    settling_controller: SettlingController, segment: Segment, duration_s: float, waited_s: float
) -> Controller[SettledState]:
    """Record a motion as a segment, long enough to judge it by that."""
    shortest_s = (settling_controller.rule.periods + 2) / settling_controller.loop.motion_hz
    duration_s = max(duration_s, shortest_s)
    yield from _listened(settling_controller, segment, duration_s)
    found = settling_controller.found(waited_s)
    _note(settling_controller, found, segment)
    return found


def _listened(
    settling_controller: SettlingController, segment: Segment, duration_s: float
) -> Controller[None]:
    settling_controller.loop.forget()
    yield from settling_controller.loop.listen(RunState.RECORDING, duration_s, segment)


def _note(settling_controller: SettlingController, found: SettledState, segment: Segment) -> None:
    loop = settling_controller.loop
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
