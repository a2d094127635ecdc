"""Measure a point until it is recorded or all attempts are used; pause between points for cooling."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic

from ..bench.bench import Bench
from ..errors import AcquisitionError, InstrumentError, RecordingError
from ..plan import Measurement, Point, Retryable, RetryPolicy, RunState
from ..recording import open_recording
from ..run.acquisition_loop import BLOCK_S
from ..run.ending import Outcome, Progress
from ..run.run import run_measurement
from ..stopping.stop import StopSwitch
from ._attempt_files import next_attempt
from ._beam import BeamMover
from ._bench_identity import BenchIdentity
from ._journal import Journal, JournalPointState, PointOutcome, PointResult, ReasonCode, reason_code_of
from ._log import CampaignEvent, CampaignEventKind, CampaignListener
from ._opening import require_same_bench


class CoolingPause:
    """Pause before every recording of a session except the first.

    A stop ends the pause at once; a hold extends the pause until the hold is released. The journal does not
    change meanwhile: a campaign killed during a pause resumes with the next point.
    """

    def __init__(self, rest_s: float, switch: StopSwitch, say: CampaignListener) -> None:
        self._rest_s = rest_s
        self._switch = switch
        self._say = say
        self._is_due = False

    def require(self) -> None:
        """Require a pause before the next recording."""
        self._is_due = True

    def wait(self, bench: Bench, name: str) -> None:
        """Pause before the recording of the point ``name``, if a pause is required; the generator is off."""
        if not self._is_due or not self._rest_s:
            return
        self._is_due = False
        text = f"pausing for {self._rest_s:g} s before {name}"
        self._say(CampaignEvent(CampaignEventKind.RESTING, text, {"point": name, "rest_s": self._rest_s}))
        left_s = self._rest_s
        while (left_s > 0 or self._switch.is_holding) and self._switch.request is None:
            piece_s = min(left_s, BLOCK_S) if left_s > 0 else BLOCK_S
            bench.idle(piece_s)
            left_s -= piece_s


Reopen = Callable[[], Bench]
"""Function that closes and reopens a bench that has lost an instrument; may raise AcquisitionError."""

LOOK_EVERY_S = 1.0
"""Interval between searches for a lost instrument, and pause before another attempt at a point [s]."""


@dataclass
class Attempts:
    """Measurement of points on a bench, with as many attempts as the policy allows."""

    bench: Bench
    journal: Journal
    policy: RetryPolicy
    switch: StopSwitch
    say: CampaignListener
    pause: CoolingPause
    beam: BeamMover
    reopen: Reopen | None

    def wait_before(self, name: str, measurement: Measurement) -> None:
        """Pause before a point, and wait until the operator has moved the beam; a stop ends both waits."""
        self.pause.wait(self.bench, name)
        self.beam.ask(self.bench, measurement)

    def carry_out(self, point: Point, tell: Callable[[Path, Progress], None]) -> PointResult:
        """Measure a point until it has a valid recording; ``tell`` is called after every block.

        Raises the AcquisitionError of the last attempt, and writes it to the journal.
        """
        for left in reversed(range(self.policy.attempts)):
            path = next_attempt(self.journal.path.parent, point.name)
            self.pause.require()
            self.journal.start(point.name, path.name)
            self._note(CampaignEventKind.POINT_BEGUN, f"{path.name} begins", point, path)
            try:
                with self.beam.beam_at(self.bench, point.name, point.measurement) as bench:
                    outcome = run_measurement(
                        bench, point.measurement, path, on_progress=partial(tell, path), switch=self.switch
                    )
            except AcquisitionError as error:
                self._fail_attempt(point, path, error)
                if not (left and self._is_retryable(reason_code_of(error))):
                    raise
                self._prepare_retry(point, path, error)
                self.pause.wait(self.bench, point.name)
                if self.switch.request is not None:
                    raise
            except BaseException as error:
                reason = f"{type(error).__name__}: {error}".removesuffix(": ")
                self.journal.end(point.name, JournalPointState.INTERRUPTED, ReasonCode.STOPPED, reason)
                raise
            else:
                point_result = self._end_attempt(point, outcome)
                is_over = point_result.reason_code is ReasonCode.OVER_RANGE
                if not (left and is_over and self._is_retryable(ReasonCode.OVER_RANGE)):
                    return point_result
                text = f"{point.name} is tried again: {point_result.reason}"
                self._note(CampaignEventKind.RETRY, text, point, path)
                self.pause.wait(self.bench, point.name)
                if self.switch.request is not None:
                    return point_result
        raise AssertionError("the last attempt returns or raises")

    def _end_attempt(self, point: Point, outcome: Outcome) -> PointResult:
        if outcome.state is RunState.FINISHED:
            over = _over_range(outcome.path, point.measurement.excitation.result_labels)
            reason_code = ReasonCode.OVER_RANGE if over else ReasonCode.CARRIED_OUT
            reason = f"{outcome.reason}; {over}" if over else outcome.reason
            state, result = JournalPointState.DONE, PointOutcome.RECORDED
            kind = CampaignEventKind.POINT_DONE
        else:
            reason_code, reason = ReasonCode.STOPPED, outcome.reason
            state, result = JournalPointState.INTERRUPTED, PointOutcome.STOPPED
            kind = CampaignEventKind.POINT_STOPPED
        self.journal.end(point.name, state, reason_code, reason, _seal_of(outcome.path))
        self._note(kind, f"{point.name}: {reason}", point, outcome.path)
        return PointResult(point.name, result, outcome.path, reason, reason_code)

    def _fail_attempt(self, point: Point, path: Path, error: AcquisitionError) -> None:
        reason_code = reason_code_of(error)
        try:
            self.journal.end(point.name, JournalPointState.FAILED, reason_code, str(error), _seal_of(path))
        except RecordingError as second:  # the journal failed too: the first error is the cause
            error.add_note(str(second))
        self.say(
            CampaignEvent(
                CampaignEventKind.FAULT,
                f"{point.name}: {error}",
                {"point": point.name, "file": path.name, "why": reason_code.value},
            )
        )

    def _is_retryable(self, reason_code: ReasonCode) -> bool:
        is_stopping = self.switch.request is not None
        return not is_stopping and reason_code.value in {each.value for each in self.policy.on}

    def _prepare_retry(self, point: Point, path: Path, error: AcquisitionError) -> None:
        """Prepare another attempt: reopen the bench after an instrument error, otherwise wait briefly."""
        if isinstance(error, InstrumentError):
            if self.reopen is None:
                raise error
            self.bench = self._reopen_bench(self.reopen, error)
            self._note(CampaignEventKind.BENCH_REOPENED, "the bench was closed and opened again", point, path)
        else:
            self.bench.idle(LOOK_EVERY_S)  # an immediate retry seldom succeeds
        self._note(CampaignEventKind.RETRY, f"{point.name} is tried again", point, path)

    def _reopen_bench(self, reopen: Reopen, lost: AcquisitionError) -> Bench:
        began, idled_s = monotonic(), 0.0
        while True:
            try:
                bench = reopen()
            except AcquisitionError as error:
                # Simulated time may pass faster than real time: use the longer of both waiting times.
                looked_s = max(monotonic() - began, idled_s)
                if looked_s >= self.policy.reopen_for_s or self.switch.request is not None:
                    lost.add_note(f"The bench could not be opened again: {error}")
                    raise lost from error
                # The bench is not notified when somebody reconnects an instrument, so try again to open it.
                self.bench.idle(LOOK_EVERY_S)
                idled_s += LOOK_EVERY_S
            else:
                require_same_bench(self.journal.bench, BenchIdentity.of(bench))
                return bench

    def _note(self, kind: CampaignEventKind, text: str, point: Point, path: Path) -> None:
        self.say(CampaignEvent(kind, text, {"point": point.name, "file": path.name}))


def _seal_of(path: Path) -> str:
    """Return the seal (checksums) of a finished recording; empty for an unfinished recording."""
    try:
        with open_recording(path) as recording:
            return recording.seal
    except RecordingError:
        return ""


def _over_range(path: Path, labels: Collection[str]) -> str:
    """Return a clause that names inputs near full scale in the segments ``labels``; empty if none."""
    if not path.exists():  # the user may have moved a complete recording already
        return ""
    with open_recording(path) as recording:
        counting = [each for each in recording.segments if each.label in labels]
        roles = {
            overload.channel: None
            for overload in recording.overloads
            for segment in counting
            if overload.first_sample <= segment.last_sample and overload.last_sample >= segment.first_sample
        }
    return f"near full scale: {', '.join(roles)}" if roles else ""


assert {each.value for each in Retryable} <= {each.value for each in ReasonCode}
