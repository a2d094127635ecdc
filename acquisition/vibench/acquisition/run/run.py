"""Run a measurement: check, ramp up, settle, record, ramp down, and silence the drive in any case."""

import math
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from itertools import islice, tee
from pathlib import Path

from ..bench import Bench
from ..control.control_action import Controller, phase_samples
from ..control.controllers import feedback_controller
from ..errors import AcquisitionError, ConfigurationError, DriveLate, LimitExceeded, RunStalled
from ..excitation.plan import AbstractFeedback
from ..excitation.steps import Tone
from ..host.beside import ClosedOnLeaving
from ..host.toml_file import member
from ..instruments import Block, FunctionGenerator
from ..plan import (
    CHECK_S,
    DriveSource,
    Measurement,
    Phase,
    RunState,
    check_phases,
    drive_source_of,
    duration_s,
    known_phases,
    phases,
    require_within_limits,
    run_check_vpp,
    shortest_ramp_s,
)
from ..recording import ChannelHeader, EventKind, Origin, RecordingHeader, RecordingWriter, create_recording
from ..rig import Channel
from ..stopping.program import stop_on_signal
from ..stopping.stop import LEVELS, MEMORY_RESERVE, Cause, StopLevel, StopRequest, StopSwitch
from .acquisition_loop import AcquisitionLoop
from .drive import Drive, drive_for
from .ending import Ending, Outcome, Progress
from .limit_monitor import LimitMonitor
from .phase_runner import GlideWatch, PhaseRunner, StopRequested
from .silence_watch import DriveGuard, LowLevelCheck, SilenceWatch, check_figures, require_checkable
from .until import UntilWatch

ROOM = 1.25
"""Smallest ratio of a sweep's step duration to the time of its commands; above 1, as command times vary."""
_MOST_COMMANDS = 2
"""Largest number of commands for one change of tone: amplitude and frequency."""


def require_time_for_commands(measurement: Measurement, generator: FunctionGenerator) -> float:
    """Refuse a sweep whose steps are too short; return the time that commands add to settled tones [s].

    Raises ConfigurationError when a step is shorter than `ROOM` times the measured time of its commands.
    """
    step_s = measurement.excitation.glide_step_s
    if step_s is not None:
        latency_s = _commands_of_a_step(measurement) * generator.measured_latency_s()
        if step_s < ROOM * latency_s:
            raise ConfigurationError(
                f"step_s = {step_s:g} s is too short: the generator takes {latency_s:.3g} s for each "
                "setting, and the drive would fall behind the plan. Nothing was played; give step_s of at "
                f"least {math.ceil(100 * ROOM * latency_s) / 100:.2f} s, or shorten generator.settle_s if "
                "the instrument allows it"
            )
        return 0.0
    settled = sum(phase.state is RunState.SETTLING for phase in known_phases(measurement))
    return settled * _MOST_COMMANDS * generator.measured_latency_s() if settled > 1 else 0.0


def _commands_of_a_step(measurement: Measurement) -> int:
    """Return the number of commands per step: frequency, and amplitude if it may change."""
    if isinstance(measurement.excitation, AbstractFeedback):
        return _MOST_COMMANDS
    levels = {
        step.play.level for step in islice(measurement.excitation.steps(), 2) if isinstance(step.play, Tone)
    }
    return len(levels)


def controller_for(bench: Bench, measurement: Measurement) -> Controller[None] | None:
    """Return the feedback controller of a measurement; None without feedback.

    Raises ConfigurationError when the bench does not support feedback, before any signal is played.
    """
    if not isinstance(measurement.excitation, AbstractFeedback):
        return None
    if drive_source_of(measurement, bench.rig) is DriveSource.OUTPUT:
        raise ConfigurationError(
            f"{measurement.name} uses feedback, but the signal of an analogue output is written in advance. "
            'Nothing was played; set daq.output.plays = "streams", and connect the function generator'
        )
    return feedback_controller(measurement, bench.rig, bench.channels, bench.digitizer.sample_rate_hz)


def run_header(bench: Bench, measurement: Measurement, planned_s: float) -> RecordingHeader:
    """Return the header of a recording of ``measurement`` on ``bench``, planned for ``planned_s``."""
    rig, sheet = bench.rig, bench.confirmations
    steps = bench.digitizer.volts_per_count
    sample_rate_hz = bench.digitizer.sample_rate_hz
    origins = {identity.origin for identity in bench.identities.values()}
    simulated = bench.rig.virtual is not None or Origin.SIMULATED.value in origins
    return RecordingHeader(
        channels=tuple(_channel(channel, step) for channel, step in zip(bench.channels, steps, strict=True)),
        sample_rate_hz=sample_rate_hz,
        expected_samples=round(planned_s * sample_rate_hz),
        origin=Origin.SIMULATED if simulated else Origin.REAL,
        plan_json=measurement.model_dump_json(),
        bench_json=rig.model_dump_json(),
        requested_sample_rate_hz=rig.daq.sample_rate_hz,
        instruments=bench.identities,
        confirmations={"operator": sheet.operator, "confirmed": sheet.confirmed.isoformat(), **sheet.values},
        bench_check_json="{}" if bench.last_check is None else bench.last_check.model_dump_json(),
    )


def _channel(channel: Channel, volts_per_count: float | None) -> ChannelHeader:
    calibrated = channel.sensor_calibrated or channel.converter_calibrated
    return ChannelHeader(
        role=channel.role.value,
        physical_channel=channel.physical,
        quantity=channel.quantity,
        unit=channel.unit,
        physical_per_volt=channel.units_per_volt,
        range_v=channel.range_v,
        volts_per_count=volts_per_count,
        coupling=channel.coupling,
        iepe_current_a=channel.iepe_current_a,
        sensitivity=1 / channel.units_per_volt,
        sensitivity_unit=f"V/({channel.unit})",
        serial=channel.serial,
        calibration_date=calibrated.isoformat(),
        delay_s=channel.delay_s,
        long_name=f"{channel.role.value.replace('_', ' ')} ({channel.sensor})",
    )


CreateRecording = Callable[[Path, RecordingHeader], RecordingWriter]
PlayedPhase = tuple[Phase, list[Block] | None]
"""Phase to be played, and the list that receives its blocks, or None if they are not needed."""


class Run(ClosedOnLeaving):
    """Run of one measurement: iterate over it to play, check and record, block by block.

    `RunState` shows the diagram of the states. However the run ends (plan done, cancelled, limit,
    failed instrument, full disk, Ctrl-C, abandoned iterator), the generator is silent afterwards.
    The recording is finished and states the reason. Use a ``with`` statement, so that an abandoned
    run ends at once::

        with Run(bench, measurement, path) as run:
            for progress in run:
                print(progress.state, progress.elapsed_s)

    Iterating raises LimitExceeded when the plan (before anything moves) or a measured value exceeds a limit.
    It raises CheckFailed when the response at low level is not as expected, RunStalled when no
    samples were read for too long, and InstrumentError, DataLost or RecordingError when an instrument or the
    disk fails.
    """

    def __init__(
        self,
        bench: Bench,
        measurement: Measurement,
        path: Path,
        bench_check: LowLevelCheck = LowLevelCheck.AT_LOW_LEVEL,
        create: CreateRecording = create_recording,
        switch: StopSwitch | None = None,
    ) -> None:
        """``switch`` lets other threads hold or end the run."""
        self.switch = StopSwitch() if switch is None else switch
        """Switch to hold or end the run within a block, from any thread or signal handler."""
        self._bench = bench
        self._measurement = measurement
        self._path = path
        self._bench_check = bench_check
        self._create = create
        self._drive: Drive  # The drive is chosen when the plan is admitted.
        self._silence: SilenceWatch  # The watch is created after the check that the drive is recorded.
        self._guard: DriveGuard  # The guard is created when the plan is admitted.
        self._controller: Controller[None] | None = None
        self._until: UntilWatch | None = None
        self._known = ""
        self._limit_monitor = LimitMonitor(
            bench.rig, bench.channels, measurement.limits, bench.digitizer.sample_rate_hz
        )
        self._total_s = duration_s(measurement)
        self._state = RunState.IDLE
        self._ending = Ending()
        self._runner: PhaseRunner | None = None
        self._blocks = self._carry_out()

    @property
    def state(self) -> RunState:
        """State of the run."""
        return self._state if self._runner is None else self._runner.state

    @property
    def outcome(self) -> Outcome:
        """How the run ended, once it is finished, stopped or failed."""
        return self._ending.outcome(self._path)

    def cancel(self, reason: str = "cancelled") -> None:
        """Request that the run ramp down and end.

        The request has no effect on a run that has ended or is in its final ramp.
        """
        self.switch.ask(StopRequest.of(Cause.OPERATOR, reason))

    def close(self) -> None:
        """End the run if needed: ramp down, silence, finish the recording."""
        self._blocks.close()

    def __iter__(self) -> Iterator[Progress]:
        return self._blocks

    def _carry_out(self) -> Generator[Progress, None, None]:
        """Play the plan; after a stop or an exceeded limit, ramp down as fast as the cause requires."""
        with self._recording() as runner:
            try:
                for phase, blocks in self._course(runner.loop):
                    yield from runner.run_phase(phase, blocks)
                self._ending.is_finished(runner.loop.lost_samples, self._known)
            except StopRequested as stop:
                self._ending.is_stopped(str(stop), stop.request.cause)
                yield from self._ramp_down_early(runner, stop.request.level)
            except (DriveLate, LimitExceeded, RunStalled) as error:
                self._ending.is_failed(error, str(error))
                if isinstance(error, LimitExceeded):
                    runner.loop.log_limit_trip(error)
                cause = Cause.FAULT if isinstance(error, RunStalled) else Cause.LIMIT
                yield from self._ramp_down_early(runner, LEVELS[cause])
                raise
            except GeneratorExit:
                self._ending.is_stopped("the calling program abandoned the run", Cause.PROGRAM)
                deque(self._ramp_down_early(runner, LEVELS[Cause.PROGRAM]), maxlen=0)
                raise

    @contextmanager
    def _recording(self) -> Iterator[PhaseRunner]:
        """Open the recording and yield its runner; at the end, silence the drive and finish the recording."""
        sink = self._open_writer()
        loop = AcquisitionLoop(self._bench.digitizer, sink, self._guard.advance)
        self._runner = PhaseRunner(
            self._drive,
            loop,
            self._limit_monitor,
            self._silence,
            GlideWatch(self._bench.channels, self._bench.digitizer.sample_rate_hz),
            self.switch,
            self._total_s,
            self._until,
        )
        self.switch.refusal_to_hold = self._runner.refusal_to_hold
        try:
            yield self._runner
        except (GeneratorExit, DriveLate, LimitExceeded, RunStalled):
            raise
        except KeyboardInterrupt:
            self._ending.is_stopped("interrupted from the keyboard", Cause.KEYBOARD)
            raise
        except Exception as error:
            if isinstance(error, MemoryError):
                MEMORY_RESERVE.release()
            self._ending.is_failed(error, f"{type(error).__name__}: {error}")
            raise
        finally:
            try:
                with self._guard as guard:
                    self._ending.leave(guard, self._bench.digitizer, sink)
            finally:
                self._runner.state = self._ending.state
                self.switch.refusal_to_hold = str
                if self._until is not None:
                    self._until.close()

    def _open_writer(self) -> RecordingWriter:
        """Check the plan and the bench before anything moves; create the recording and return its writer."""
        self._state = RunState.CHECKING
        try:
            require_checkable(self._bench.channels)
            require_within_limits(self._measurement, self._bench.rig)
            self._drive = drive_for(self._bench, self._measurement)
            self._controller = controller_for(self._bench, self._measurement)
            if self._bench_check is LowLevelCheck.AT_LOW_LEVEL:
                self._total_s += CHECK_S + self._drive.pause_s  # the drive gets no phase before the check
            if self._drive.is_commanded:
                self._total_s += require_time_for_commands(self._measurement, self._bench.generator)
            self._silence = SilenceWatch(self._bench.channels, self._bench.digitizer.sample_rate_hz)
            with ExitStack() as refused:
                self._guard = DriveGuard(self._drive, self.switch, lambda: self._silence.is_heard)
                refused.enter_context(self._guard)
                if self._measurement.until is not None:
                    self._until = UntilWatch(self._measurement, self._measurement.until, self._path)
                    refused.callback(self._until.close)
                    self._until.wait_until_ready(self.switch)
                header = run_header(self._bench, self._measurement, self._total_s)
                sink = self._create(self._path, header)
                refused.pop_all()
                return sink
        except AcquisitionError as error:
            self._ending.is_failed(error, str(error))
            self._state = RunState.FAILED
            raise

    def _course(self, loop: AcquisitionLoop) -> Iterator[PlayedPhase]:
        """Yield the phases of the check and of the plan; each phase ends before the next is requested."""
        loop.log(EventKind.PLAYER, self._drive.drive_source.value)
        playing: Iterator[Phase] = iter(())
        if self._controller is None:
            playing = phases(self._measurement)
        if self._until is not None:
            playing = self._until.phases(self._measurement)
        # An analogue output is written in advance, so the output needs each phase before the run does.
        playing, announced = tee(playing)
        match self._bench_check:
            case LowLevelCheck.AT_LOW_LEVEL:
                self._begin(check_phases(self._measurement, self._bench.rig))
                yield from self._check(loop)
                self._drive.announce(announced)
                pause_s = self._drive.pause_s
            case LowLevelCheck.RECENTLY_PASSED:
                self._begin(announced)
                loop.log(EventKind.CHECK, "skipped: the bench was checked shortly before")
                pause_s = 0.0
        del announced  # without a second reader, `tee` stores no phases
        yield Phase(RunState.ARMED, None, pause_s), None
        if self._controller is None:
            for phase in playing:
                yield phase, None
                self._log_bounds(loop)
            self._log_bounds(loop)
        else:
            yield from self._actions(loop, self._controller)
        loop.enter(None)

    def _actions(self, loop: AcquisitionLoop, controller: Controller[None]) -> Iterator[PlayedPhase]:
        """Yield the phases of a controller's actions; the controller receives the samples of each action."""
        try:
            action = next(controller)
            while True:
                for note in action.notes:
                    loop.log(note.kind, note.text)
                blocks: list[Block] = []
                if action.phase is not None:
                    yield action.phase, blocks
                samples = replace(phase_samples(blocks), coefficients=self._drive.coefficients)
                action = controller.send(samples)
        except StopIteration:
            pass

    def _log_bounds(self, loop: AcquisitionLoop) -> None:
        """Log the bounds of each finished result; the reason for the run's end repeats the last bounds."""
        while self._until is not None and self._until.ended:
            note = self._until.ended.pop(0)
            loop.log(note.kind, note.text)
            self._known = f"; {note.sentence}"

    def _begin(self, coming: Iterable[Phase]) -> None:
        """Start sampling, and so also start an analogue output that shares the digitizer's trigger."""
        self._guard.begin(self._bench.rig.generator.resource or self._bench.rig.daq.device)
        self._drive.arm(coming)
        self._bench.digitizer.start()

    def _check(self, loop: AcquisitionLoop) -> Iterator[PlayedPhase]:
        """Yield the phases of the check, and log what was measured."""
        before: list[Block] = []
        during: list[Block] = []
        silence, settling, measuring = check_phases(self._measurement, self._bench.rig)
        yield silence, before
        self._silence.learn_hum(phase_samples(before).volts)
        yield settling, None
        yield measuring, during
        figures = check_figures(
            self._bench.rig,
            self._bench.channels,
            phase_samples(before).volts,
            phase_samples(during).volts,
            self._bench.digitizer.sample_rate_hz,
            run_check_vpp(self._measurement.excitation.amplitude_vpp, self._bench.rig),
        )
        loop.log(EventKind.CHECK, figures.text())

    def _ramp_down_early(self, runner: PhaseRunner, level: StopLevel) -> Iterator[Progress]:
        return runner.ramp_down_early(self._ending.reason, level, self._ramp_s)

    def _ramp_s(self, level: StopLevel) -> float:
        """Return the duration of the ramp for a stop [s]."""
        planned_s = self._measurement.ramp_s
        return planned_s if level is StopLevel.RAMP else min(planned_s, shortest_ramp_s(self._bench.rig))


def ignore_progress(progress: Progress) -> None:
    """Ignore the progress; the default for ``on_progress``."""


def run_measurement(
    bench: Bench,
    measurement: Measurement,
    path: Path,
    bench_check: LowLevelCheck | str = LowLevelCheck.AT_LOW_LEVEL,
    on_progress: Callable[[Progress], None] = ignore_progress,
    create: CreateRecording = create_recording,
    switch: StopSwitch | None = None,
) -> Outcome:
    """Run ``measurement`` on an open bench and record it at ``path`` (``NAME.h5``).

    ``on_progress`` is called after every block; ``switch`` lets other threads hold or end the run. Ctrl-C
    ramps down and returns an outcome whose state is ``stopped``; a second Ctrl-C raises KeyboardInterrupt.
    Raises AcquisitionError in the cases listed in `run.Run`; the generator is then silent, and a recording
    that had started is finished as failed.
    """
    run = Run(bench, measurement, path, member(LowLevelCheck, bench_check), create, switch)
    # Handle Ctrl-C and SIGTERM until the run has ended, so that the output is always switched off.
    with stop_on_signal(run.switch, path.stem), run:
        for progress in run:
            on_progress(progress)
    return run.outcome
