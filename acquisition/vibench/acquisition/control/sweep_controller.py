"""A sweep at a level: every step's setting follows from what the base did in the steps before."""

from ..excitation.held_sweep import HeldSweep
from ..plan import RunState
from ..recording import ExcursionNote, Held, SegmentLabel, SweepNote
from .control_action import Controller
from .settling_controller import SettlingController
from .sine_loop import GainEstimator, SineLoop, followed, started, tracked


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
