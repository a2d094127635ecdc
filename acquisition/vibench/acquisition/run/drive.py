"""What makes the sound of a run: a function generator, or an analogue output for what never repeats."""

from collections.abc import Iterable, Iterator
from typing import Protocol

from ..bench.bench import Bench
from ..errors import ConfigurationError, LimitExceeded
from ..excitation.steps import LoopTone, Play, Tone
from ..instruments import LoopBlock, LoopProgram, LoopState, RealTimeController
from ..plan import DriveSource, Measurement, Phase, RunState, known_phases, require_played
from .generator_drive import DeadMan, GeneratorDrive
from .stream_drive import StreamDrive

TALK = 0.25
"""It is talked to after this part of its watchdog's time at the latest."""
QUICK_S = 0.1
"""Ramp of the ways out on which no samples can be counted [s]."""
_ROUNDING_S = 1e-9


class LoopDrive:
    """A `Drive` that ramps, glides and falls silent by itself."""

    drive_source = DriveSource.CONTROLLER
    is_commanded = False
    pause_s = 0.0
    can_hold = False
    """What it plays must be talked to."""

    def __init__(self, controller: RealTimeController, measurement: Measurement) -> None:
        self._controller = controller
        self._amplitude_vpp = measurement.excitation.amplitude_vpp
        self._program: LoopProgram | None = None
        self._blocks: list[LoopBlock] = []

    @property
    def setting_vpp(self) -> float:
        """Twice the fundamental that it is told [V]; 0 in silence."""
        return 0.0 if self._program is None else 2 * abs(complex(*self._program.reference_v[0]))

    @property
    def is_playing(self) -> bool:
        """Whether there is anything to ramp down."""
        return self._program is not None

    @property
    def coefficients(self) -> tuple[LoopBlock, ...]:
        """What was measured since the phase began."""
        return tuple(self._blocks)

    def arm(self, coming: Iterable[Phase]) -> None:
        """Nothing to get ready: it is silent."""

    def announce(self, coming: Iterable[Phase]) -> None:
        """Nothing to prepare."""

    def perform(self, phase: Phase) -> Iterator[float]:
        """Tell it what to play, and talk to it while it does; yields how long to read between [s]."""
        self._blocks = []
        if phase.state is RunState.RAMPING_DOWN:
            self._silence(phase.duration_s)
        elif phase.play is None:
            self._silence(QUICK_S)
        else:
            self._play(phase.play, phase.duration_s if phase.state is RunState.RAMPING_UP else None)
        yield from self._talking(phase.duration_s)

    def ramp_down(self, ramp_s: float) -> Iterator[float]:
        """Let it ramp down from what it plays."""
        self._silence(ramp_s)
        yield from self._talking(ramp_s)

    def cut(self) -> None:
        """Silence it, with a step."""
        self._silence(0.0)

    def silence(self) -> None:
        """Silence it, whatever happens."""
        self._silence(QUICK_S)

    def _play(self, play: Play, ramp_s: float | None) -> None:
        match play:
            case LoopTone(program=LoopProgram() as program):
                told = program
            case Tone(frequency_hz, level):
                told = LoopProgram(
                    frequency_hz=frequency_hz, reference_v=((0.5 * self._amplitude_vpp * level, 0.0),)
                )
            case _:
                raise LimitExceeded(
                    "a real-time controller plays sines, and was given something else; it stayed silent"
                )
        if ramp_s is not None:
            told = told.model_copy(update={"glide_s": ramp_s})
        if told != self._program:
            # Before the command: should it fail half-way, it counts as playing.
            self._program = told
            self._controller.play(told)  # what it measured of the program before is dropped

    def _talking(self, duration_s: float) -> Iterator[float]:
        longest_s = TALK * self._controller.facts.watchdog_s
        while duration_s > _ROUNDING_S:
            piece_s = min(duration_s, longest_s)
            yield piece_s
            duration_s -= piece_s
            report = self._controller.report()
            self._blocks.extend(report.blocks)
            if self._program is not None and report.state is not LoopState.PLAYING:
                self._program = None
                raise LimitExceeded(
                    f"the real-time controller ended by itself: {report.reason or 'it was told to'}. It is "
                    "silent, and its recording kept; lower the level, or go in shorter steps"
                )

    def _silence(self, ramp_s: float) -> None:
        self._controller.silence(ramp_s)
        self._program = None


class Drive(Protocol):
    """Plays phases, one after another, while the run reads.

    A drive never waits: it says how long to read before it has something to do again, and samples
    read are the only clock. What comes next is told beforehand, since some drives write it ahead.
    """

    @property
    def drive_source(self) -> DriveSource:
        """The instrument that plays."""

    @property
    def pause_s(self) -> float:
        """Silence between saying what comes after all that was told, and hearing it [s]."""

    @property
    def coefficients(self) -> tuple[LoopBlock, ...]:
        """What a real-time controller has measured since the phase began; nothing of other drives."""

    @property
    def is_commanded(self) -> bool:
        """Whether each change is a command that takes its time while samples are converted."""

    @property
    def setting_vpp(self) -> float:
        """What is played now, as an amplitude setting, peak to peak [V]; 0 in silence."""

    @property
    def is_playing(self) -> bool:
        """Whether there is anything to ramp down."""

    def arm(self, coming: Iterable[Phase]) -> None:
        """Get ready before the digitizer starts: the first of ``coming`` begins with its first sample."""

    def announce(self, coming: Iterable[Phase]) -> None:
        """Say what comes after everything told before; it begins after `pause_s`."""

    def perform(self, phase: Phase) -> Iterator[float]:
        """Play a phase; yields how long to read before the next command is due [s]."""

    @property
    def can_hold(self) -> bool:
        """Whether what is played goes on by itself while nobody tells more."""

    def ramp_down(self, ramp_s: float) -> Iterator[float]:
        """Break off what was announced, and ramp down within ``ramp_s`` [s]; yields as `perform` does."""

    def cut(self) -> None:
        """Switch off at once, with a step. Legal at any time."""

    def silence(self) -> None:
        """Be silent as soon as it goes without a step, and at once when that fails. Legal at any time."""


def drive_for(bench: Bench, measurement: Measurement) -> Drive:
    """Choose what plays a measurement.

    Raises ConfigurationError when the bench has none.
    """
    source = require_played(measurement, bench.rig)
    if source is not DriveSource.GENERATOR and bench.rig.generator.dead_man_s is not None:
        raise _without_dead_man(f"{measurement.name} is played by the {source.value}")
    match source, bench.output, bench.controller:
        case DriveSource.CONTROLLER, _, controller if controller is not None:
            return LoopDrive(controller, measurement)
        case DriveSource.OUTPUT, output, _ if output is not None:
            return StreamDrive(output, measurement, bench.rig.generator.terminal_factor())
        case _:
            return GeneratorDrive(bench.generator, measurement, _dead_man(bench, measurement))


def _dead_man(bench: Bench, measurement: Measurement) -> DeadMan | None:
    """Give the dead man that the configuration asks for; raises ConfigurationError where it cannot be."""
    longest_s = bench.rig.generator.dead_man_s
    if longest_s is None:
        return None
    plays = [phase.play for phase in known_phases(measurement) if phase.play is not None]
    frequencies_hz = {play.frequency_hz if isinstance(play, Tone) else None for play in plays}
    frequency_hz = frequencies_hz.pop() if len(frequencies_hz) == 1 else None
    if frequency_hz is None:  # nothing is known of what is decided while it plays
        raise _without_dead_man(f"{measurement.name} is not a sine of one frequency")
    if frequency_hz * longest_s < 1:
        raise _without_dead_man(f"{measurement.name} has a period longer than dead_man_s = {longest_s:g} s")
    return DeadMan(bench.generator, longest_s)


def _without_dead_man(what: str) -> ConfigurationError:
    return ConfigurationError(
        f"{what}, and generator.dead_man_s lets only sines of one frequency play, as bursts of the generator "
        "that are triggered while the run lives. Nothing was played; leave dead_man_s out of the hardware "
        "configuration for this campaign"
    )
