"""Which instrument plays a measurement: the function generator, or an analogue output beside it."""

from enum import StrEnum

from ..excitation import Play, Stream, Tone, Waveform
from ..rig import OutputUse, Rig
from ._measurement import Measurement


class DriveSource(StrEnum):
    """What drives the amplifier."""

    GENERATOR = "function generator"
    OUTPUT = "analogue output"


def drive_source_of(measurement: Measurement, rig: Rig) -> DriveSource:
    """Say what plays a measurement on a rig; a stream needs an output, also where there is none."""
    use = OutputUse.STREAMS if rig.daq.output is None else rig.daq.output.plays
    drive_sources = {_source_of(step.play, use) for step in measurement.excitation.steps()}
    return DriveSource.OUTPUT if DriveSource.OUTPUT in drive_sources else DriveSource.GENERATOR


def _source_of(play: Play, use: OutputUse) -> DriveSource:
    match play, use:
        case (Stream(), _) | (Tone(), OutputUse.TONES_AND_STREAMS):
            return DriveSource.OUTPUT
        case (Tone() | Waveform(), _):
            return DriveSource.GENERATOR
