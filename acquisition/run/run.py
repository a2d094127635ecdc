"""Carrying out a measurement: check, ramp up, settle, record, ramp down, and silence whatever happens."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ..check.low_level import BenchCheck, judged, require_checkable
from ..errors import AcquisitionError, LimitExceeded
from ..instruments import Block, Samples
from ..plan.limits import require_within_limits
from ..plan.measurement import Measurement
from ..recording.header import RecordingHeader
from ..recording.layout import RecordingState
from ..recording.writer import create_recording
from .bench_protocol import RunBench
from .drive import Drive, drive_for
from .guard import Guard
from .header import run_header
from .progress import Outcome, Progress
from .schedule import (
    CHECK_S,
    Phase,
    check_amplitude_vpp,
    check_phases,
    duration_s,
    phases,
)
from .state import RunState
from .tape import Recorder, Tape

CreateRecording = Callable[[Path, RecordingHeader], Recorder]


class _Cancelled(Exception):
    """Somebody asked the run to end; the text says why."""


class Run:
    """One measurement being carried out: iterate it, and it plays, watches and records, block by block.

    `RunState` has the diagram of its states. However the run ends (plan done, cancelled, limit,
    failed instrument, full disk, keyboard, abandoned iterator), the generator is silent afterwards
    and the recording is finished and says why. Leave it through a ``with``, so that an abandoned
    run ends at once::

        with Run(bench, measurement, path) as run:
            for progress in run:
                print(progress.state, progress.elapsed_s)

    Iterating raises LimitExceeded (before anything moves when the plan passes a limit, later when a
    measured value does), CheckFailed when the bench does not answer at low level as it should, and
    InstrumentError, DataLost or RecordingError when an instrument or the disk fails.
    """

    def __init__(
        self,
        bench: RunBench,
        measurement: Measurement,
        path: Path,
        bench_check: BenchCheck = BenchCheck.AT_LOW_LEVEL,
        create: CreateRecording = create_recording,
    ) -> None:
        self._bench = bench
        self._measurement = measurement
        self._path = path
        self._bench_check = bench_check
        self._create = create
        self._drive: Drive  # chosen when the plan is admitted; nothing plays before
        self._guard = Guard(bench.rig, bench.channels, measurement.limits)
        self._total_s = duration_s(measurement)
        self._state = RunState.IDLE
        self._cancelled: str | None = None
        self._ending = (RunState.FAILED, "the run ended without saying why")
        self._look: Callable[[Block], None] = self._go_on
        self._blocks = self._carry_out()

    @property
    def state(self) -> RunState:
        """Where the run stands."""
        return self._state

    @property
    def outcome(self) -> Outcome:
        """How the run ended, once its state is one of ``ENDED``."""
        return Outcome(*self._ending, self._path)

    def cancel(self, reason: str = "cancelled") -> None:
        """Ask the run to ramp down and end, within a block. From any thread, and from a signal handler.

        Without effect on a run that is ramping down for the last time, or has ended.
        """
        # One assignment, which needs no lock: a signal handler must not wait for one.
        self._cancelled = reason

    def close(self) -> None:
        """End the run if it has not ended: ramp down, silence, finish the recording."""
        self._blocks.close()

    def __iter__(self) -> Iterator[Progress]:
        return self._blocks

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _carry_out(self) -> Generator[Progress, None, None]:
        recorder = self._admitted()
        tape = Tape(self._bench.digitizer, recorder)
        try:
            yield from self._played(tape)
            self._ending = (RunState.FINISHED, "the plan was carried out")
        except _Cancelled as request:
            self._ending = (RunState.STOPPED, str(request))
            yield from self._ramped_down_early(tape)
        except LimitExceeded as error:
            self._ending = (RunState.FAILED, str(error))
            yield from self._ramped_down_early(tape)
            raise
        except GeneratorExit:
            self._ending = (RunState.STOPPED, "the program that carried it out left it")
            deque(self._ramped_down_early(tape), maxlen=0)
            raise
        except KeyboardInterrupt:
            self._ending = (RunState.STOPPED, "interrupted from the keyboard")
            raise
        except Exception as error:
            self._ending = (RunState.FAILED, f"{type(error).__name__}: {error}")
            raise
        finally:
            self._leave(recorder)

    def _admitted(self) -> Recorder:
        """Refuse what can be refused before anything moves; then begin the recording."""
        self._state = RunState.CHECKING
        try:
            require_checkable(self._bench.channels)
            require_within_limits(self._measurement, self._bench.rig)
            self._drive = drive_for(self._bench, self._measurement)
            self._total_s += self._before_s()
            return self._create(self._path, run_header(self._bench, self._measurement, self._total_s))
        except AcquisitionError as error:
            self._ending = (RunState.FAILED, str(error))
            self._state = RunState.FAILED
            raise

    def _played(self, tape: Tape) -> Iterator[Progress]:
        tape.log("player", self._drive.player.value)
        match self._bench_check:
            case BenchCheck.AT_LOW_LEVEL:
                self._begin(check_phases(self._measurement))
                yield from self._checked(tape)
                self._drive.announce(phases(self._measurement))
                pause_s = self._drive.pause_s
            case BenchCheck.RECENTLY_PASSED:
                self._begin(phases(self._measurement))
                tape.log("check", "left out: the bench was checked shortly before")
                pause_s = 0.0
        yield from self._perform(tape, Phase(RunState.ARMED, None, pause_s))
        for phase in phases(self._measurement):
            yield from self._perform(tape, phase)
        tape.enter(None)

    def _before_s(self) -> float:
        """Time before the first ramp [s]: what comes is told when the check has passed, and not before."""
        match self._bench_check:
            case BenchCheck.AT_LOW_LEVEL:
                return CHECK_S + self._drive.pause_s
            case BenchCheck.RECENTLY_PASSED:
                return 0.0

    def _begin(self, coming: Iterable[Phase]) -> None:
        """Start sampling, and with it what plays by the digitizer's trigger."""
        self._drive.arm(coming)
        self._bench.digitizer.start()

    def _checked(self, tape: Tape) -> Iterator[Progress]:
        quiet: list[Samples] = []
        heard: list[Samples] = []
        listening, settling, measuring = check_phases(self._measurement)
        yield from self._perform(tape, listening, quiet)
        yield from self._perform(tape, settling)
        yield from self._perform(tape, measuring, heard)
        figures = judged(
            self._bench.rig,
            self._bench.channels,
            np.concatenate(quiet, axis=1),
            np.concatenate(heard, axis=1),
            self._bench.digitizer.sample_rate_hz,
            check_amplitude_vpp(self._measurement.excitation.amplitude_vpp),
        )
        tape.log("check", figures.text())

    def _perform(self, tape: Tape, phase: Phase, into: list[Samples] | None = None) -> Iterator[Progress]:
        self._enter(tape, phase.state)
        tape.enter(phase.segment)
        for wait_s in self._drive.perform(phase):
            yield from self._read(tape, wait_s, into)

    def _ramped_down_early(self, tape: Tape) -> Iterator[Progress]:
        """Ramp down from wherever the run is, unwatched; a segment that is open stays incomplete."""
        self._look = _look_away
        tape.log("end", self._ending[1])
        tape.cut()
        if self._drive.is_heard:
            self._enter(tape, RunState.RAMPING_DOWN)
            for wait_s in self._drive.ramp_down():
                yield from self._read(tape, wait_s)

    def _read(self, tape: Tape, duration_s: float, into: list[Samples] | None = None) -> Iterator[Progress]:
        for block in tape.read_for(duration_s):
            if into is not None:
                into.append(block.volts)
            yield Progress(
                self._state, tape.segment, block, tape.elapsed_s, self._total_s, self._drive.setting_vpp
            )
            self._look(block)

    def _go_on(self, block: Block) -> None:
        """Raise what ends the run early: a limit, or somebody's wish."""
        self._guard.require_safe(block)
        if self._cancelled is not None:
            raise _Cancelled(self._cancelled)

    def _enter(self, tape: Tape, state: RunState) -> None:
        if state is not self._state:
            self._state = state
            tape.log("state", state.value)

    def _leave(self, recorder: Recorder) -> None:
        """Silence the generator, end sampling, finish the recording: each of them, whatever the others do."""
        with ExitStack() as leaving:
            leaving.callback(self._finish, recorder)
            leaving.callback(self._stop_listening)
            leaving.callback(self._silence)

    def _silence(self) -> None:
        try:
            self._drive.silence()
        except AcquisitionError as failure:
            self._add_failure(failure)
            raise

    def _stop_listening(self) -> None:
        has_failed_already = self._ending[0] is RunState.FAILED
        try:
            self._bench.digitizer.stop()
        except AcquisitionError as failure:
            self._add_failure(failure)
            if not has_failed_already:  # else the first failure is the cause, and must stay in front
                raise

    def _add_failure(self, failure: AcquisitionError) -> None:
        self._ending = (RunState.FAILED, f"{self._ending[1]}; then: {failure}")

    def _finish(self, recorder: Recorder) -> None:
        state, reason = self._ending
        try:
            recorder.finish(_RECORDED_AS[state], reason)
        except AcquisitionError as failure:
            self._add_failure(failure)
            raise
        finally:
            self._state = self._ending[0]


def _look_away(block: Block) -> None:
    """Let a block pass: the run is ending already."""


_RECORDED_AS = {
    RunState.FINISHED: RecordingState.COMPLETE,
    RunState.STOPPED: RecordingState.STOPPED,
    RunState.FAILED: RecordingState.FAILED,
}
