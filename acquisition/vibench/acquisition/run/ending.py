"""End of a run: report the first cause, silence the drive, stop sampling, finish the recording."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from ..errors import AcquisitionError, DataLost, DriveLate, InstrumentError, LimitExceeded, RecordingError
from ..excitation.steps import Segment
from ..instruments import Block, Digitizer
from ..plan import RunState
from ..recording import RecordingState, RecordingWriter, UntilNote
from ..stopping.stop import Cause
from .silence_watch import DriveGuard


@dataclass(frozen=True, eq=False)
class Progress:
    """State of a run after a block, for viewers."""

    state: RunState
    segment: Segment | None
    """Segment of the recording that contains the block."""
    block: Block
    elapsed_s: float
    """Duration of the samples recorded so far [s]."""
    total_s: float
    """Planned duration of the whole recording [s]."""
    amplitude_vpp: float
    """Amplitude setting of the generator, peak to peak [V]; 0 while its output is off."""
    frequency_hz: float | None = None
    """Frequency of the sine that is played [Hz]; None for other signals."""
    until: UntilNote | None = None
    """Bounds of the results so far, if the recording lasts until they are small enough."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended."""

    state: RunState
    reason: str
    path: Path
    """Path of the recording."""
    cause: Cause | None = None
    """Cause of an early end; None for a completed run."""


class Ending:
    """Cause and description of the end of a run."""

    def __init__(self) -> None:
        self.state = RunState.FAILED
        self.reason = "the run ended without a stated reason"
        self._cause: Cause | None = None

    def is_finished(self, lost_samples: int, known: str) -> None:
        """Set the cause of the end: completed as planned; ``known`` is a text with bounds of the results."""
        lost = f"; the converter lost {lost_samples} samples" if lost_samples else ""
        self.state, self.reason = RunState.FINISHED, f"the plan was carried out{known}{lost}"

    def is_stopped(self, reason: str, cause: Cause) -> None:
        """Set the cause of the end: stopped on request."""
        self.state, self.reason, self._cause = RunState.STOPPED, reason, cause

    def is_failed(self, error: Exception, reason: str) -> None:
        """Set the cause of the end to a failure, unless an earlier cause is set."""
        if self._cause is None:
            self.reason, self._cause = reason, _cause_of(error)
        else:
            self.reason = f"{self.reason}; then: {reason}"
        self.state = RunState.FAILED

    def outcome(self, path: Path) -> Outcome:
        """Return how the run ended."""
        return Outcome(self.state, self.reason, path, self._cause)

    def leave(self, guard: DriveGuard, digitizer: Digitizer, sink: RecordingWriter) -> None:
        """Silence the drive, end sampling and finish the recording; do each even if another step fails."""
        with ExitStack() as leaving:
            leaving.callback(self._note_failure, lambda: sink.finish(_RECORDED_AS[self.state], self.reason))
            leaving.callback(self._stop_listening, digitizer)
            leaving.callback(self._note_failure, guard.silence)

    def _note_failure(self, step: Callable[[], object]) -> None:
        """Carry out a step; store an error as the cause of the end, and raise it again."""
        try:
            step()
        except AcquisitionError as failure:
            self._add(failure)
            raise

    def _stop_listening(self, digitizer: Digitizer) -> None:
        has_failed_already = self.state is RunState.FAILED
        try:
            digitizer.stop()
        except AcquisitionError as failure:
            self._add(failure)
            if not has_failed_already:  # an earlier failure remains the cause of the end
                raise

    def _add(self, failure: AcquisitionError) -> None:
        if self._cause is None:
            self._cause = _cause_of(failure)
        self.state, self.reason = RunState.FAILED, f"{self.reason}; then: {failure}"


def _cause_of(error: Exception) -> Cause:
    match error:
        case LimitExceeded():
            return Cause.LIMIT
        case InstrumentError() | DataLost() | DriveLate():
            return Cause.INSTRUMENT
        case RecordingError():
            return Cause.DISK
        case _:
            return Cause.FAULT


_RECORDED_AS = {
    RunState.FINISHED: RecordingState.COMPLETE,
    RunState.STOPPED: RecordingState.STOPPED,
    RunState.FAILED: RecordingState.FAILED,
}
