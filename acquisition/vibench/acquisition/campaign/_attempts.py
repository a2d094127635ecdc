"""Attempts at a point until it is recorded, the moves of the beam, and the pauses for cooling."""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic

from ..bench import Bench
from ..errors import AcquisitionError, InstrumentError, RecordingError
from ..plan import Campaign, Measurement, Point, Retryable, RunState, ScanPoint
from ..recording import open_recording
from ..run.acquisition_loop import BLOCK_S
from ..run.ending import Outcome, Progress
from ..run.run import run_measurement
from ..stopping.stop import StopSwitch
from ._journal import (
    BenchIdentity,
    Journal,
    JournalPointState,
    PointOutcome,
    PointResult,
    ReasonCode,
    reason_code_of,
)
from ._log import CampaignEventKind, CommandMessenger
from ._opening import next_attempt, require_same_bench

MOVE_LONGEST_S = 120.0
"""Time after which a command that moves the beam is terminated [s]."""


Reopen = Callable[[], Bench]
"""Function that closes and reopens a bench that has lost an instrument; may raise AcquisitionError."""

LOOK_EVERY_S = 1.0
"""Interval between searches for a lost instrument, and pause before another attempt at a point [s]."""


@dataclass
class Attempts:
    """Measurement of points on a bench, with as many attempts as the policy allows.

    There is a pause before every recording of a session except the first. The journal does not change during
    a pause: a campaign killed then resumes with the next point.
    """

    bench: Bench
    campaign: Campaign
    journal: Journal
    switch: StopSwitch
    say: Callable[..., None]
    """Function that reports an event, given its kind, its text, and its facts by name."""
    move_beam: CommandMessenger | None
    """Command that moves the beam of a real rig; if there is no command, the operator moves the beam."""
    reopen: Reopen | None

    def __post_init__(self) -> None:
        self._is_pause_due = False
        self._beam_at: ScanPoint | None = None

    @property
    def folder(self) -> Path:
        """Folder of the recordings and the journal."""
        return self.journal.path.parent

    def wait_before(self, name: str, measurement: Measurement) -> None:
        """Pause before a point, and wait until the operator has moved the beam; a stop ends both waits."""
        self._pause(name)
        point = measurement.point
        rig, moves_itself = self.bench.rig, self.move_beam is not None
        if point is None or point == self._beam_at or moves_itself or rig.virtual or rig.plays_back:
            return
        self.switch.hold()
        text = f"move the beam to {point.text}, then run 'vibench release' or press 'Go on'"
        self.say(CampaignEventKind.MOVE_BEAM, text, point=point.name)
        while self.switch.is_holding:
            self.bench.idle(BLOCK_S)
        self._beam_at = point

    def carry_out(self, point: Point, tell: Callable[[Path, Progress], None]) -> PointResult:
        """Measure a point until it has a valid recording; ``tell`` is called after every block.

        Raises the AcquisitionError of the last attempt, and writes it to the journal.
        """
        for left in reversed(range(self.campaign.retry.attempts)):
            path = next_attempt(self.folder, point.name)
            self._is_pause_due = True
            self.journal.start(point.name, path.name)
            facts = {"point": point.name, "file": path.name}
            self.say(CampaignEventKind.POINT_BEGUN, f"{path.name} begins", **facts)
            try:
                with self._aimed_bench(point.name, point.measurement.point) as bench:
                    outcome = run_measurement(
                        bench, point.measurement, path, on_progress=partial(tell, path), switch=self.switch
                    )
            except AcquisitionError as error:
                self._fail_attempt(point, path, error)
                if not (left and self._is_retryable(reason_code_of(error))):
                    raise
                self._prepare_retry(error, facts)
                self.say(CampaignEventKind.RETRY, f"{point.name} is tried again", **facts)
                self._pause(point.name)
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
                self.say(CampaignEventKind.RETRY, text, **facts)
                self._pause(point.name)
                if self.switch.request is not None:
                    return point_result
        raise AssertionError("the last attempt returns or raises")

    def _pause(self, name: str) -> None:
        """Pause before a recording, if a pause is due; a stop ends the pause, and a hold extends it."""
        if not self._is_pause_due or not self.campaign.rest_s:
            return
        self._is_pause_due = False
        text = f"pausing for {self.campaign.rest_s:g} s before {name}"
        self.say(CampaignEventKind.RESTING, text, point=name, rest_s=self.campaign.rest_s)
        left_s = self.campaign.rest_s
        while (left_s > 0 or self.switch.is_holding) and self.switch.request is None:
            piece_s = min(left_s, BLOCK_S) if left_s > 0 else BLOCK_S
            self.bench.idle(piece_s)
            left_s -= piece_s

    @contextmanager
    def _aimed_bench(self, name: str, point: ScanPoint | None) -> Iterator[Bench]:
        """Yield the bench with the beam at a point of a scan, for the recording ``name``.

        Raises AcquisitionError when the command fails, because the beam may then be anywhere.
        """
        if point is None:
            yield self.bench
            return
        with self.bench.beam_on(point.role) as aimed:
            if self.move_beam is not None and point != self._beam_at:
                self._beam_at = None
                failure = self.move_beam.run({"recording": name, **point.model_dump()}, MOVE_LONGEST_S)
                if failure:
                    raise AcquisitionError(
                        f"the beam was not moved to {point.text}: {failure}. Nothing was played there; "
                        "correct the command, and resume the campaign"
                    )
                self._beam_at = point
            yield aimed

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
        self.say(kind, f"{point.name}: {reason}", point=point.name, file=outcome.path.name)
        return PointResult(point.name, result, outcome.path, reason, reason_code)

    def _fail_attempt(self, point: Point, path: Path, error: AcquisitionError) -> None:
        reason_code = reason_code_of(error)
        try:
            self.journal.end(point.name, JournalPointState.FAILED, reason_code, str(error), _seal_of(path))
        except RecordingError as second:  # the attempt's error is the cause, so raise no second error
            error.add_note(str(second))
        facts = {"point": point.name, "file": path.name, "why": reason_code.value}
        self.say(CampaignEventKind.FAULT, f"{point.name}: {error}", **facts)

    def _is_retryable(self, reason_code: ReasonCode) -> bool:
        is_stopping = self.switch.request is not None
        return not is_stopping and reason_code.value in {each.value for each in self.campaign.retry.on}

    def _prepare_retry(self, error: AcquisitionError, facts: Mapping[str, str]) -> None:
        """Prepare another attempt: reopen the bench after an instrument error, otherwise wait briefly."""
        if isinstance(error, InstrumentError):
            if self.reopen is None:
                raise error
            self.bench = self._reopen_bench(self.reopen, error)
            self.say(CampaignEventKind.BENCH_REOPENED, "the bench was closed and opened again", **facts)
        else:
            self.bench.idle(LOOK_EVERY_S)  # an immediate retry seldom succeeds

    def _reopen_bench(self, reopen: Reopen, lost: AcquisitionError) -> Bench:
        began, idled_s = monotonic(), 0.0
        while True:
            try:
                bench = reopen()
            except AcquisitionError as error:
                # Simulated time may pass faster than real time: use the longer waiting time.
                looked_s = max(monotonic() - began, idled_s)
                if looked_s >= self.campaign.retry.reopen_for_s or self.switch.request is not None:
                    lost.add_note(f"The bench could not be opened again: {error}")
                    raise lost from error
                # Nothing reports that somebody has reconnected an instrument, so try to open the bench again.
                self.bench.idle(LOOK_EVERY_S)
                idled_s += LOOK_EVERY_S
            else:
                require_same_bench(self.journal.bench, BenchIdentity.of(bench))
                return bench


def _seal_of(path: Path) -> str:
    """Return the seal (checksums) of a finished recording; empty for an unfinished recording."""
    try:
        with open_recording(path) as recording:
            return recording.seal
    except RecordingError:
        return ""


def _over_range(path: Path, labels: Collection[str]) -> str:
    """Return a clause that names the inputs near full scale in the segments ``labels``, or an empty text."""
    if not path.exists():  # the user may already have moved the complete recording
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
