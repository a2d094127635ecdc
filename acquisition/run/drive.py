"""What makes the sound of a run: a function generator, or an analogue output for what never repeats."""

from collections.abc import Iterable, Iterator
from typing import Protocol

from ..errors import ConfigurationError
from ..excitation.steps import is_stream
from ..plan.measurement import Measurement
from .bench_protocol import RunBench
from .generator_drive import GeneratorDrive
from .schedule import Phase
from .stream_drive import StreamDrive


class Drive(Protocol):
    """Plays phases, one after another, while the run reads.

    A drive never waits: it says how long to read before it has something to do again, and samples
    read are the only clock. What comes next is told beforehand, since some drives write it ahead.
    """

    @property
    def pause_s(self) -> float:
        """Silence between saying what comes after all that was told, and hearing it [s]."""

    @property
    def setting_vpp(self) -> float:
        """What is played now, as an amplitude setting, peak to peak [V]; 0 in silence."""

    @property
    def is_heard(self) -> bool:
        """Whether there is anything to ramp down."""

    def arm(self, coming: Iterable[Phase]) -> None:
        """Get ready before the digitizer starts: the first of ``coming`` begins with its first sample."""

    def announce(self, coming: Iterable[Phase]) -> None:
        """Say what comes after everything told before; it begins after `pause_s`."""

    def perform(self, phase: Phase) -> Iterator[float]:
        """Play a phase; yields how long to read before the next command is due [s]."""

    def ramp_down(self) -> Iterator[float]:
        """Break off what was announced, and ramp down; yields as `perform` does."""

    def silence(self) -> None:
        """Be silent as soon as it goes without a step, and at once when that fails. Legal at any time."""


def drive_for(bench: RunBench, measurement: Measurement) -> Drive:
    """Choose what plays a measurement.

    Raises
    ------
    ConfigurationError
        When it needs an analogue output and the bench has none.

    """
    if not any(is_stream(step.play) for step in measurement.excitation.steps()):
        return GeneratorDrive(bench.generator, measurement)
    if bench.output is None:
        raise ConfigurationError(
            "streamed noise needs an analogue output, and this bench has none: its function generator "
            "repeats one waveform. Nothing was played; add [daq.output] to the hardware configuration, or "
            "use multisine_noise with more realisations"
        )
    return StreamDrive(bench.output, measurement, bench.rig.generator.terminal_factor())
