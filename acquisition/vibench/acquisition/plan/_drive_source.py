"""Which instrument plays a measurement: the function generator, or an analogue output beside it."""

from enum import StrEnum

from ..errors import ConfigurationError
from ..excitation.steps import LoopTone, Play, Stream, Tone, Waveform
from ..instruments import Sweep
from ..rig import OutputUse, Rig, generator_driver
from ._measurement import Measurement


class DriveSource(StrEnum):
    """What drives the amplifier."""

    GENERATOR = "function generator"
    OUTPUT = "analogue output"
    CONTROLLER = "real-time controller"


def drive_source_of(measurement: Measurement, rig: Rig) -> DriveSource:
    """Say what plays a measurement on a rig; a stream needs an output, also where there is none."""
    use = OutputUse.STREAMS if rig.daq.output is None else rig.daq.output.plays
    drive_sources = {_source_of(step.play, use) for step in measurement.excitation.steps()}
    others = (DriveSource.CONTROLLER, DriveSource.OUTPUT)
    return next((each for each in others if each in drive_sources), DriveSource.GENERATOR)


def require_played(measurement: Measurement, rig: Rig) -> DriveSource:
    """Give what plays a measurement on a rig; raises ConfigurationError where the rig has none."""
    source = drive_source_of(measurement, rig)
    match source:
        case DriveSource.CONTROLLER if rig.controller is None:
            raise ConfigurationError(
                f"{measurement.name} needs a real-time controller, and this bench has none. Nothing was "
                "played; add [controller] to the hardware configuration"
            )
        case DriveSource.OUTPUT if rig.daq.output is None:
            raise ConfigurationError(
                f"{measurement.name} needs an analogue output, and this bench has none: its function "
                "generator repeats one waveform. Nothing was played; add [daq.output] to the hardware "
                "configuration, or use white_noise with more realisations"
            )
    return source


LEAST_SHARE = 1e-4
"""The least setting of an analogue output, as a share of its largest: some tens of a converter's counts."""


def lowest_setting_vpp(measurement: Measurement, rig: Rig) -> float:
    """Give the least setting of what plays a measurement, peak to peak [V]."""
    if rig.controller is not None and drive_source_of(measurement, rig) is DriveSource.CONTROLLER:
        return LEAST_SHARE * 2 * rig.controller.limit_v
    output = rig.daq.output
    if output is not None and drive_source_of(measurement, rig) is DriveSource.OUTPUT:
        return LEAST_SHARE * 2 * output.limit_v / rig.generator.terminal_factor()
    return generator_driver(rig.generator).describe(rig.generator).amplitude_range_vpp[0]


def _source_of(play: Play, use: OutputUse) -> DriveSource:
    match play, use:
        case (LoopTone(), _):
            return DriveSource.CONTROLLER
        case (Stream(), _) | (Tone(), OutputUse.TONES_AND_STREAMS):
            return DriveSource.OUTPUT
        case (Tone() | Waveform() | Sweep(), _):
            return DriveSource.GENERATOR
