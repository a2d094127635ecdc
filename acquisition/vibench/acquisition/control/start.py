"""From one sine to the next: the first one ramped up, the others reached without a kick."""

from math import ceil

import numpy as np

from ..excitation.feedback import BaseLevel
from ..excitation.settled_sine import GLIDE_TONE_S
from ..plan import RunState, needed_vpp
from ..rig import OnTable
from .closed_loop_check import require_answer
from .control_action import Controller
from .gain_estimator import GainEstimator
from .sine_loop import SineLoop

_GLIDE_MEMORY_S = 0.5
"""Over which a glide averages the base's answer [s]."""


def started(loop: SineLoop, frequency_hz: float, level: BaseLevel | None) -> Controller[None]:
    """Ramp up at a frequency: to the level, as the rig's model has it, or to the plan's setting."""
    setting_vpp = loop.most_vpp
    if level is not None:
        guess_vpp = _bare_vpp(loop, level, frequency_hz)
        setting_vpp = loop.bounded_vpp(guess_vpp)
    loop.change(frequency_hz, setting_vpp)
    yield from loop.listen_to_silence()
    yield from loop.ramp_up()


def glided(loop: SineLoop, frequency_hz: float, level: BaseLevel | None, step_hz: float) -> Controller[None]:
    """Go to another frequency through others at most ``step_hz`` apart: a large step would be a kick."""
    begin_hz = loop.setting.frequency_hz
    tones = max(1, ceil(abs(frequency_hz - begin_hz) / step_hz * (1 - 1e-9)))
    estimator = GainEstimator(_GLIDE_MEMORY_S)
    for tone in range(1, tones):
        tracked(loop, begin_hz + (frequency_hz - begin_hz) * tone / tones, level, estimator, GLIDE_TONE_S)
        yield from loop.listen(RunState.SETTLING, GLIDE_TONE_S)
        followed(loop, level, estimator)
    tracked(loop, frequency_hz, level, estimator, GLIDE_TONE_S)


def moved(loop: SineLoop, frequency_hz: float, level: BaseLevel | None) -> None:
    """Play another frequency: the setting follows the rig's model from where it is."""
    setting_vpp = loop.setting.setting_vpp
    if level is not None:
        setting_vpp *= _bare_vpp(loop, level, frequency_hz)
        setting_vpp /= _modelled_vpp(loop, level)
    _change(loop, frequency_hz, setting_vpp, level)


def tracked(
    loop: SineLoop, frequency_hz: float, level: BaseLevel | None, estimator: GainEstimator, duration_s: float
) -> None:
    """Play another frequency for ``duration_s``, at the setting that the track foresees for its middle."""
    if level is None or not estimator.is_known:
        moved(loop, frequency_hz, level)
        return
    modelled_vpp = _bare_vpp(loop, level, frequency_hz)
    gain = estimator.gain_at(loop.elapsed_s + 0.5 * duration_s)
    _change(loop, frequency_hz, modelled_vpp / gain, level)


def followed(loop: SineLoop, level: BaseLevel | None, estimator: GainEstimator) -> None:
    """Take what was just heard into the track."""
    if level is None:
        return
    now = loop.setting
    if loop.periods.count:
        acceleration = abs(complex(np.mean(loop.periods.base)))
        require_answer(loop.rig, now.frequency_hz, now.setting_vpp, acceleration)
    target = level.acceleration_at(now.frequency_hz)
    modelled = target * now.setting_vpp / _modelled_vpp(loop, level)
    estimator.add(loop.elapsed_s, loop.periods.base, modelled, target)


def _modelled_vpp(loop: SineLoop, level: BaseLevel) -> float:
    """Give the setting that the bare table needs for the level at the frequency of now [V]."""
    return _bare_vpp(loop, level, loop.setting.frequency_hz)


def _bare_vpp(loop: SineLoop, level: BaseLevel, frequency_hz: float) -> float:
    return needed_vpp(loop.rig, level.acceleration_at(frequency_hz), frequency_hz, OnTable.NOTHING)


def _change(loop: SineLoop, frequency_hz: float, wanted_vpp: float, level: BaseLevel | None) -> None:
    """Change frequency and setting, the latter by no more than the level allows at once."""
    if level is not None:
        now_vpp = loop.setting.setting_vpp
        slow_vpp = min(max(wanted_vpp, now_vpp / level.most_change), now_vpp * level.most_change)
        wanted_vpp = loop.bounded_vpp(slow_vpp)
    loop.change(frequency_hz, wanted_vpp)
