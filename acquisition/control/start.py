"""The first sine of a measurement: its setting guessed from the rig's model, ramped up."""

from math import ceil

from ..excitation.feedback import BaseLevel
from ..excitation.settled_sine import GLIDE_TONE_S
from ..plan.needed_setting import needed_vpp
from ..run.state import RunState
from .level_control import LevelControl
from .move import Conduct
from .sine_play import SinePlay


def started(play: SinePlay, frequency_hz: float, level: BaseLevel | None) -> Conduct[None]:
    """Ramp up at a frequency: to the level, as the rig's model has it, or to the plan's setting."""
    setting_vpp = play.most_vpp
    if level is not None:
        guess_vpp = needed_vpp(play.rig, level.acceleration_at(frequency_hz), frequency_hz)
        setting_vpp = LevelControl(level, play.most_vpp).bounded_vpp(guess_vpp)
    play.change(frequency_hz, setting_vpp)
    yield from play.hush()
    yield from play.ramp_up()


def glided(play: SinePlay, frequency_hz: float, level: BaseLevel | None, step_hz: float) -> Conduct[None]:
    """Go to another frequency through others at most ``step_hz`` apart: a large step would be a kick."""
    begin_hz = play.played.frequency_hz
    tones = max(1, ceil(abs(frequency_hz - begin_hz) / step_hz * (1 - 1e-9)))
    for tone in range(1, tones):
        moved(play, begin_hz + (frequency_hz - begin_hz) * tone / tones, level)
        yield from play.listen(RunState.SETTLING, GLIDE_TONE_S)
    moved(play, frequency_hz, level)


def moved(play: SinePlay, frequency_hz: float, level: BaseLevel | None) -> None:
    """Play another frequency: the setting follows the rig's model from where it is, and no faster."""
    now = play.played
    setting_vpp = now.setting_vpp
    if level is not None:
        control = LevelControl(level, play.most_vpp)
        guess_vpp = play.feedforward_vpp(
            frequency_hz, level.acceleration_at(frequency_hz), level.acceleration_at(now.frequency_hz)
        )
        slowest, fastest = now.setting_vpp / level.most_change, now.setting_vpp * level.most_change
        setting_vpp = control.bounded_vpp(min(max(guess_vpp, slowest), fastest))
    play.change(frequency_hz, setting_vpp)
