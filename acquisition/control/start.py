"""The first sine of a measurement: its setting guessed from the rig's model, ramped up."""

from ..excitation.feedback import BaseLevel
from ..plan.needed_setting import needed_vpp
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
    yield from play.ramp_up()


def moved(play: SinePlay, frequency_hz: float, level: BaseLevel | None) -> None:
    """Go to another frequency: the setting follows the rig's model from where it is, and no faster."""
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
