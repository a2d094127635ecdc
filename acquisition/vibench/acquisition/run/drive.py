"""Signal source of a run: function generator, analogue output or real-time controller."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Protocol

from ..bench import Bench
from ..errors import ConfigurationError
from ..excitation.steps import Tone
from ..instruments import PlugInKind, plug_in
from ..plan import DriveSource, Measurement, Phase, known_phases, require_played
from .generator_drive import DeadMan, GeneratorDrive
from .stream_drive import StreamDrive


class Drive(Protocol):
    """Player of consecutive phases while the run reads samples.

    A drive never waits. It yields how long to read until its next action, because the number of samples read
    is the only clock. Phases are announced beforehand, because some drives write samples in advance.
    """

    @property
    def drive_source(self) -> DriveSource:
        """Kind of instrument that plays the signal."""

    @property
    def pause_s(self) -> float:
        """Duration of the silence between the announcement of phases and their start [s]."""

    @property
    def coefficients(self) -> tuple[Any, ...]:
        """Measurements by a real-time controller since the phase started; empty for other drives."""

    @property
    def is_commanded(self) -> bool:
        """Whether each change of the signal needs a command, which takes time while sampling continues."""

    @property
    def setting_vpp(self) -> float:
        """Present amplitude setting, peak to peak [V]; 0 in silence."""

    @property
    def is_playing(self) -> bool:
        """Whether the drive plays a signal that must be ramped down."""

    def arm(self, coming: Iterable[Phase]) -> None:
        """Prepare the drive; the first phase of ``coming`` starts at the digitizer's first sample."""

    def announce(self, coming: Iterable[Phase]) -> None:
        """Announce the phases that follow all previous phases; the new phases start after `pause_s`."""

    def perform(self, phase: Phase) -> Iterator[float]:
        """Play a phase; before each command, yield how long to read until that command [s]."""

    @property
    def can_hold(self) -> bool:
        """Whether the signal continues if no further command is sent."""

    def ramp_down(self, ramp_s: float, clock_s: Callable[[], float]) -> Iterator[float]:
        """Cancel announced phases and ramp down within ``ramp_s`` [s]; yield times like `perform`.

        ``clock_s`` returns the time [s]; if reading is slow, more time passes than was yielded.
        """

    def cut(self) -> None:
        """Switch the drive off at once, without a ramp. May be called at any time."""

    def silence(self) -> None:
        """Ramp down as fast as possible; if this fails, switch off at once. May be called at any time."""


def drive_for(bench: Bench, measurement: Measurement) -> Drive:
    """Return the drive that plays a measurement.

    Raises ConfigurationError when the bench has no suitable drive.
    """
    source = require_played(measurement, bench.rig)
    if source is not DriveSource.GENERATOR and bench.rig.generator.dead_man_s is not None:
        raise _without_dead_man(f"{measurement.name} is played by the {source.value}")
    match source, bench.output, bench.controller:
        case DriveSource.CONTROLLER, _, controller if controller is not None:
            drive: Drive = plug_in(PlugInKind.DRIVE, "controller")(controller, measurement)
            return drive
        case DriveSource.OUTPUT, output, _ if output is not None:
            return StreamDrive(output, measurement, bench.rig.generator.terminal_factor())
        case _:
            return GeneratorDrive(bench.generator, measurement, _dead_man(bench, measurement))


def _dead_man(bench: Bench, measurement: Measurement) -> DeadMan | None:
    """Return the configured dead man's switch; raise ConfigurationError if the signal does not allow it."""
    longest_s = bench.rig.generator.dead_man_s
    if longest_s is None:
        return None
    plays = [phase.play for phase in known_phases(measurement) if phase.play is not None]
    frequencies_hz = {play.frequency_hz if isinstance(play, Tone) else None for play in plays}
    frequency_hz = frequencies_hz.pop() if len(frequencies_hz) == 1 else None
    if frequency_hz is None:  # several frequencies, or frequencies chosen by feedback
        raise _without_dead_man(f"{measurement.name} is not a sine of one frequency")
    if frequency_hz * longest_s < 1:
        raise _without_dead_man(f"{measurement.name} has a period longer than dead_man_s = {longest_s:g} s")
    return DeadMan(bench.generator, longest_s)


def _without_dead_man(what: str) -> ConfigurationError:
    return ConfigurationError(
        f"{what}, but generator.dead_man_s allows only sines of one frequency, because the generator then "
        "plays bursts that the run must keep triggering. Nothing was played; leave dead_man_s out of the "
        "hardware configuration for this campaign"
    )
