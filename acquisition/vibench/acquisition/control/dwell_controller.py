"""A dwell at a level: settled first, then watched and corrected while it is recorded."""

from math import ceil

from ..excitation.held_dwell import HeldDwell
from ..excitation.held_sweep import HeldSweep
from ..excitation.steps import Segment
from ..plan import RunState
from ..recording import DwellNote, ExcursionNote, Held, LevelNote, SegmentLabel, SegmentNote, SweepNote
from .control_action import Controller, LevelControl, measured_level
from .feedback_channels import require_answer
from .settling_controller import SettledState, SettlingController
from .sine_loop import GainEstimator, SineLoop, followed, started, tracked


def hold_dwell(loop: SineLoop, plan: HeldDwell) -> Controller[None]:
    """Ramp up to the level, settle, record, ramp down."""
    settling_controller = SettlingController(loop, plan.settling, plan.base_level)
    yield from started(loop, plan.frequency_hz, plan.base_level)
    yield from settling_controller.settled()
    control = LevelControl(plan.base_level, loop.most_vpp, loop.least_vpp)
    target = plan.base_level.acceleration_at(plan.frequency_hz)
    pieces = ceil(plan.duration_s / plan.update_s * (1 - 1e-9))
    outside = 0
    loop.forget()
    for number in range(pieces):
        begun_s = number * plan.update_s
        piece_s = min(plan.update_s, plan.duration_s - begun_s)
        yield from loop.listen(RunState.RECORDING, piece_s, plan.segment)
        measured = measured_level(loop.periods.base)
        require_answer(loop.rig, plan.frequency_hz, loop.setting.setting_vpp, measured.amplitude)
        held = settling_controller.held(measured)
        outside += held is Held.OUTSIDE
        loop.note(
            LevelNote(
                at_s=begun_s + piece_s,
                base_m_per_s2=measured.amplitude,
                base_u=measured.uncertainty,
                setting_vpp=loop.setting.setting_vpp,
                level=held,
            )
        )
        # The figures of all pieces since the last change are one mean: chaos needs it long.
        next_vpp = control.next_vpp(loop.setting.setting_vpp, measured, target)
        if next_vpp != loop.setting.setting_vpp and number + 1 < pieces:
            loop.change(plan.frequency_hz, next_vpp)
    loop.note(DwellNote(segment=SegmentLabel.DWELL, looks=pieces, looks_outside=outside))
    yield from loop.ramp_down()
    yield from loop.say()


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


def hold_sweep(loop: SineLoop, plan: HeldSweep) -> Controller[None]:
    """Ramp up to the level, settle, sweep, ramp down."""
    level = plan.base_level
    yield from started(loop, plan.start_hz, level)
    yield from SettlingController(loop, plan.settling, level).settled()
    estimator = GainEstimator(plan.average_s)
    excursion: ExcursionNote | None = None
    steps = outside = 0
    for mean_hz, duration_s in plan.mean_steps():
        tracked(loop, mean_hz, level, estimator, duration_s)
        yield from loop.listen(RunState.RECORDING, duration_s, plan.segment)
        followed(loop, level, estimator)
        excursion = _judged(loop, excursion, mean_hz, estimator.level - 1, level.tolerance)
        steps += 1
        outside += excursion is not None
    if excursion is not None:
        loop.note(excursion)
    loop.note(
        SweepNote(segment=SegmentLabel.SWEEP, steps=steps, steps_outside=outside, average_s=plan.average_s)
    )
    yield from loop.ramp_down()
    yield from loop.say()


def _judged(
    loop: SineLoop, before: ExcursionNote | None, frequency_hz: float, deviation: float, tolerance: float
) -> ExcursionNote | None:
    """Begin, continue or end a stretch outside the tolerance."""
    if abs(deviation) <= tolerance:
        if before is not None:
            loop.note(before)
        return None
    begin_hz, worst = (frequency_hz, deviation) if before is None else (before.from_hz, before.worst)
    return ExcursionNote(
        from_hz=begin_hz, to_hz=frequency_hz, worst=max(worst, deviation, key=abs), level=Held.OUTSIDE
    )
