"""A real-time controller as a drive. It receives programs, and sends reports while it plays."""

from collections.abc import Callable, Iterable, Iterator

from vibench.acquisition.errors import LimitExceeded
from vibench.acquisition.excitation.steps import Play, Tone
from vibench.acquisition.instruments import PlugInKind, driver_of
from vibench.acquisition.plan import DriveSource, Measurement, Phase, RunState
from vibench.acquisition.rig import ControllerConfig

from .protocol import ControllerDriver, LoopBlock, LoopController, LoopProgram, LoopState, ProgramTone

TALK = 0.25
"""Longest interval between requests, as a fraction of the watchdog's waiting time."""
QUICK_S = 0.1
"""Duration of a ramp to silence outside the ramp phases of a run [s]."""
_ROUNDING_S = 1e-9


class LoopDrive:
    """A `Drive` whose controller ramps, glides and falls silent by itself."""

    drive_source = DriveSource.CONTROLLER
    is_commanded = False
    pause_s = 0.0
    can_hold = False
    """Whether the drive can hold its output without requests: no, because the watchdog needs requests."""

    def __init__(self, controller: LoopController, measurement: Measurement) -> None:
        self._controller = controller
        self._amplitude_vpp = measurement.excitation.amplitude_vpp
        self._program: LoopProgram | None = None
        self._blocks: list[LoopBlock] = []

    @staticmethod
    def open(config: ControllerConfig) -> LoopController:
        """Connect to the controller of a hardware configuration and silence it."""
        driver: ControllerDriver = driver_of(PlugInKind.CONTROLLER, config.driver, ControllerDriver)
        return driver.open(config)

    @property
    def setting_vpp(self) -> float:
        """Twice the fundamental of the program, as an equivalent generator setting [V]; 0 in silence."""
        return 0.0 if self._program is None else 2 * abs(complex(*self._program.reference_v[0]))

    @property
    def is_playing(self) -> bool:
        """Whether a program is playing."""
        return self._program is not None

    @property
    def coefficients(self) -> tuple[LoopBlock, ...]:
        """Fourier coefficients measured since the start of the phase."""
        return tuple(self._blocks)

    def arm(self, coming: Iterable[Phase]) -> None:
        """Do nothing; the controller is already silent."""

    def announce(self, coming: Iterable[Phase]) -> None:
        """Do nothing, because no signal is prepared in advance."""

    def perform(self, phase: Phase) -> Iterator[float]:
        """Play a phase with regular requests; before each request, yield the time for reading samples [s]."""
        self._blocks = []
        if phase.state is RunState.RAMPING_DOWN:
            self._silence(phase.duration_s)
        elif phase.play is None:
            self._silence(QUICK_S)
        else:
            self._play(phase.play, phase.duration_s if phase.state is RunState.RAMPING_UP else None)
        yield from self._split_duration(phase.duration_s)

    def ramp_down(self, ramp_s: float, _clock_s: Callable[[], float]) -> Iterator[float]:
        """Ramp down, timed by the clock of the controller."""
        self._silence(ramp_s)
        yield from self._split_duration(ramp_s)

    def cut(self) -> None:
        """Silence the output without a ramp."""
        self._silence(0.0)

    def silence(self) -> None:
        """Silence the output, in any state of the controller."""
        self._silence(QUICK_S)

    def _play(self, play: Play, ramp_s: float | None) -> None:
        match play:
            case ProgramTone(program=LoopProgram() as program):
                next_program = program
            case Tone(frequency_hz, level):
                next_program = LoopProgram(
                    frequency_hz=frequency_hz, reference_v=((0.5 * self._amplitude_vpp * level, 0.0),)
                )
            case _:
                raise LimitExceeded(
                    "a real-time controller plays only sines; the requested signal was not played"
                )
        if ramp_s is not None:
            next_program = next_program.model_copy(update={"glide_s": ramp_s})
        if next_program != self._program:
            # Set the program before the command, so that a failed command counts as playing.
            self._program = next_program
            self._controller.play(next_program)  # also discards the previous program's blocks

    def _split_duration(self, duration_s: float) -> Iterator[float]:
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
                    f"the real-time controller stopped: {report.reason or 'on request'}. Its output is "
                    "silent, and the recording is kept; lower the level, or take shorter steps"
                )

    def _silence(self, ramp_s: float) -> None:
        self._controller.silence(ramp_s)
        self._program = None
