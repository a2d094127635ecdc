"""A sweep at a level: every step's setting follows from what the base did in the steps before."""

import json
from dataclasses import dataclass

from ..excitation import HeldSweep
from ..plan import RunState
from ._control_action import Controller
from ._gain_estimator import GainEstimator
from ._level_control import Held
from ._settle import SettlingController, shortened
from ._sine_loop import SineLoop
from ._start import followed, started, tracked


@dataclass(frozen=True)
class _Excursion:
    """A stretch of the sweep in which the level was not held."""

    begin_hz: float
    end_hz: float
    worst: float
    """Largest deviation, as a share, with its sign."""


def hold_sweep(play: SineLoop, plan: HeldSweep) -> Controller[None]:
    """Ramp up to the level, settle, sweep, ramp down."""
    level = plan.base_level
    yield from started(play, plan.start_hz, level)
    yield from SettlingController(play, plan.settling, level).settled()
    track = GainEstimator(plan.average_s)
    excursion: _Excursion | None = None
    steps = outside = 0
    for mean_hz, duration_s in plan.mean_steps():
        tracked(play, mean_hz, level, track, duration_s)
        yield from play.listen(RunState.RECORDING, duration_s, plan.segment)
        followed(play, level, track)
        excursion = _judged(play, excursion, mean_hz, track.level - 1, level.tolerance)
        steps += 1
        outside += excursion is not None
    if excursion is not None:
        _say(play, excursion)
    said = {"segment": "sweep", "steps": steps, "steps_outside": outside, "average_s": plan.average_s}
    play.note("achieved", json.dumps(said))
    yield from play.ramp_down()
    yield from play.say()


def _judged(
    play: SineLoop, before: _Excursion | None, frequency_hz: float, deviation: float, tolerance: float
) -> _Excursion | None:
    """Begin, continue or end a stretch outside the tolerance."""
    if abs(deviation) <= tolerance:
        if before is not None:
            _say(play, before)
        return None
    if before is None:
        return _Excursion(frequency_hz, frequency_hz, deviation)
    return _Excursion(before.begin_hz, frequency_hz, max(before.worst, deviation, key=abs))


def _say(play: SineLoop, excursion: _Excursion) -> None:
    said = {
        "from_hz": shortened(excursion.begin_hz),
        "to_hz": shortened(excursion.end_hz),
        "worst": shortened(excursion.worst),
        "level": Held.OUTSIDE.value,
    }
    play.note("level", json.dumps(said))
