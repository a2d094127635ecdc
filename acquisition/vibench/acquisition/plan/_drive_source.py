"""Which instrument plays a measurement: the function generator, or an analogue output beside it."""

from enum import StrEnum

from ..excitation import Play, Stream, Tone, Waveform
from ..rig import OutputUse, Rig
from ._measurement import Measurement


class Player(StrEnum):
    """What drives the amplifier."""

    GENERATOR = "function generator"
    OUTPUT = "analogue output"


def player_of(measurement: Measurement, rig: Rig) -> Player:
    """Say what plays a measurement on a rig; a stream needs an output, also where there is none."""
    use = OutputUse.STREAMS if rig.daq.output is None else rig.daq.output.plays
    players = {_player(step.play, use) for step in measurement.excitation.steps()}
    return Player.OUTPUT if Player.OUTPUT in players else Player.GENERATOR


def _player(play: Play, use: OutputUse) -> Player:
    match play, use:
        case (Stream(), _) | (Tone(), OutputUse.TONES_AND_STREAMS):
            return Player.OUTPUT
        case (Tone() | Waveform(), _):
            return Player.GENERATOR
