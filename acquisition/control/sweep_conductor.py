"""A sweep at a level: every step's setting follows from what the base did in the steps before."""

import json
from dataclasses import dataclass

from ..excitation.held_sweep import HeldSweep
from ..run.state import RunState
from .level_control import Held, LevelControl, MeasuredLevel, measured_level
from .move import Conduct
from .settle import Settler, shortened
from .sine_play import SinePlay
from .start import moved, started


@dataclass
class _Excursion:
    """A stretch of the sweep in which the level was not held."""

    begin_hz: float
    end_hz: float
    worst: float
    """Largest deviation, as a share, with its sign."""


def hold_sweep(play: SinePlay, plan: HeldSweep) -> Conduct[None]:
    """Ramp up to the level, settle, sweep, ramp down."""
    level = plan.base_level
    control = LevelControl(level, play.most_vpp)
    yield from started(play, plan.start_hz, level)
    yield from Settler(play, plan.settling, level).settled()
    excursion: _Excursion | None = None
    steps = outside = 0
    for mean_hz, duration_s in plan.mean_steps():
        moved(play, mean_hz, level)
        yield from play.listen(RunState.RECORDING, duration_s, plan.segment)
        target = level.acceleration_at(mean_hz)
        # The last half: the first one answers the step before.
        seen = play.periods.base
        measured = measured_level(seen[len(seen) // 2 :]) if len(seen) else MeasuredLevel(target, target)
        steps += 1
        excursion = _followed(play, excursion, mean_hz, measured, level.tolerance, target)
        outside += excursion is not None
        _correct(play, control, measured, target)
    if excursion is not None:
        _say(play, excursion)
    play.note("achieved", json.dumps({"segment": "sweep", "steps": steps, "steps_outside": outside}))
    yield from play.ramp_down()
    yield from play.say()


def _correct(play: SinePlay, control: LevelControl, measured: MeasuredLevel, target: float) -> None:
    """Correct the setting for the next step; a few periods tell no uncertainty, so every error counts."""
    certain = MeasuredLevel(measured.amplitude, 0.0)
    next_vpp = control.next_vpp(play.played.setting_vpp, certain, target)
    play.change(play.played.frequency_hz, next_vpp)


def _followed(
    play: SinePlay,
    before: _Excursion | None,
    frequency_hz: float,
    measured: MeasuredLevel,
    tolerance: float,
    target: float,
) -> _Excursion | None:
    """Begin, continue or end a stretch outside the tolerance."""
    if measured.held(target, tolerance) is Held.WITHIN:
        if before is not None:
            _say(play, before)
        return None
    deviation = measured.amplitude / target - 1
    if before is None:
        return _Excursion(frequency_hz, frequency_hz, deviation)
    worst = max(before.worst, deviation, key=abs)
    return _Excursion(before.begin_hz, frequency_hz, worst)


def _say(play: SinePlay, excursion: _Excursion) -> None:
    said = {
        "from_hz": shortened(excursion.begin_hz),
        "to_hz": shortened(excursion.end_hz),
        "worst": shortened(excursion.worst),
        "level": Held.OUTSIDE.value,
    }
    play.note("level", json.dumps(said))
