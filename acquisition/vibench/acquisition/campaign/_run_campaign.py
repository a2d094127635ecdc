"""Run a campaign: make one recording for each point, and write every step to a journal."""

import shutil
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Self

from vibench.sim import count_text

from ..bench import Bench, CheckResult, RigPower, open_bench
from ..errors import AcquisitionError, InstrumentError, InstrumentLost, RecordingError
from ..excitation.plan import AbstractFeedback
from ..host.toml_file import member
from ..plan import (
    BYTES_PER_SAMPLE,
    Campaign,
    Measurement,
    Point,
    Retryable,
    RunState,
    ScanPoint,
    measuring_s,
    require_played,
)
from ..recording import open_recording, sole_use
from ..rig import Confirm, Rig, channels_of, confirm_knobs_of, load_rig
from ..run.acquisition_loop import BLOCK_S
from ..run.ending import Outcome, Progress
from ..run.run import run_measurement
from ..stopping.program import stop_on_signal
from ..stopping.stop import StopSwitch
from ._journal import (
    After,
    AfterFailure,
    BenchIdentity,
    CampaignProgress,
    ChangedBench,
    ExistingRecordings,
    FinishedPoint,
    Journal,
    JournalPoint,
    JournalPointState,
    PlannedRecording,
    PointOutcome,
    PointResult,
    ReasonCode,
    ignore_result,
    reason_code_of,
)
from ._log import (
    LOG_SUFFIX,
    STATUS_SUFFIX,
    CampaignEvent,
    CampaignEventKind,
    CampaignListener,
    CampaignLog,
    CommandMessenger,
    Messenger,
    Notifier,
    StatusLine,
    ignore_event,
)
from ._opening import (
    make_folder,
    next_attempt,
    open_journal,
    planned_recordings,
    require_all_within_limits,
    require_new,
    require_same_bench,
    rig_at,
)

MOVE_LONGEST_S = 120.0
"""Time after which a command that moves the beam is terminated [s]."""


Reopen = Callable[[], Bench]
"""Function that closes and reopens a bench that has lost an instrument; may raise AcquisitionError."""

LOOK_EVERY_S = 1.0
"""Interval between searches for a lost instrument, and pause before another attempt at a point [s]."""


@dataclass
class CampaignRunner:
    """Measurement of the points of a campaign, and of further points that are requested after a result.

    Each point gets as many attempts as the policy allows.
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
    after_failure: AfterFailure
    after: After | None

    def __post_init__(self) -> None:
        self._coming = deque(self.journal.points())
        self._count = len(self._coming)
        self._results: list[PointResult] = []
        self._is_pause_due = False
        self._beam_at: ScanPoint | None = None

    @property
    def folder(self) -> Path:
        """Folder of the recordings and the journal."""
        return self.journal.path.parent

    def run(
        self, on_progress: Callable[[CampaignProgress], None], on_result: Callable[[PointResult], None]
    ) -> tuple[PointResult, ...]:
        """Measure the points one after another; return the result of each point."""
        name = self.campaign.name
        done = sum(point.state is JournalPointState.DONE for point in self._coming)
        is_resumed = done or any(point.attempts for point in self._coming)
        begun = CampaignEventKind.RESUMED if is_resumed else CampaignEventKind.BEGUN
        text = f"{name}: {count_text(self._count, 'point')}, {done} already done"
        self.say(begun, text, points=self._count, done=done)
        self._report_damage()
        try:
            while self._coming and self._may_begin(self._coming[0]):
                point = self._coming.popleft()
                number = len(self._results) + 1

                def report_progress(
                    path: Path, progress: Progress, name: str = point.name, number: int = number
                ) -> None:
                    on_progress(CampaignProgress(name, number, self._count, path, progress))

                point_result = self._measure(point, report_progress)
                self._results.append(point_result)
                on_result(point_result)
                self._follow_up(point, point_result)
                if point_result.outcome is PointOutcome.STOPPED:
                    break
        except AcquisitionError as error:
            self._report_end(f"{name} ended: {error}", str(reason_code_of(error)))
            raise
        except BaseException as error:
            self._report_end(f"{name} ended: {type(error).__name__}", "stopped")
            raise
        is_stopped = any(each.outcome is PointOutcome.STOPPED for each in self._results)
        reason_code = "stopped" if self._coming or is_stopped else "carried_out"
        self._report_end(f"{name} {self._closing()}", reason_code)
        return tuple(self._results)

    def _report_damage(self) -> None:
        for point in self._coming:
            if point.reason_code in (ReasonCode.DAMAGED, ReasonCode.GONE):
                text = f"{point.name} is measured again: {point.reason}"
                facts = {"point": point.name, "file": point.file, "why": point.reason_code.value}
                self.say(CampaignEventKind.DAMAGED, text, **facts)

    def _may_begin(self, point: JournalPoint) -> bool:
        """Before a measurement, pause and wait until the beam has been moved; return False if stopped."""
        if point.state is not JournalPointState.DONE and self.switch.request is None:
            self.wait_before(point.name, point.measurement)
        return self.switch.request is None

    def _measure(self, point: JournalPoint, tell: Callable[[Path, Progress], None]) -> PointResult:
        if point.state is JournalPointState.DONE:
            path = self.folder / point.file
            return PointResult(point.name, PointOutcome.KEPT, path, "complete before", point.reason_code)
        try:
            return self.carry_out(Point(point.name, point.measurement, point.chain), tell)
        except (InstrumentLost, RecordingError):
            raise  # the next point would fail too: an instrument or disk space is missing
        except AcquisitionError as error:
            if self.after_failure is AfterFailure.STOP:
                raise
            path = self.folder / next(each.file for each in self.journal.points() if each.name == point.name)
            return PointResult(point.name, PointOutcome.FAILED, path, str(error), reason_code_of(error))

    def _follow_up(self, point: JournalPoint, point_result: PointResult) -> None:
        """Call ``after`` once for a point that is done, and insert the measurements that it returns."""
        is_done = point_result.outcome in (PointOutcome.RECORDED, PointOutcome.KEPT)
        if not is_done or point.is_followed_up or self.after is None:
            return
        done = tuple(
            PlannedRecording(each.name, each.measurement, self.folder / each.file, is_complete=True)
            for each in self.journal.points()
            if each.state is JournalPointState.DONE
        )
        this = next(each for each in done if each.name == point.name)
        with open_recording(point_result.path) as recording:
            follow_ups = tuple(self.after(FinishedPoint(this, done), recording))
        further = tuple(
            point for each in follow_ups for point in Campaign(name="further", measurements=(each,)).points()
        )
        self.journal.follow_up(point.name, further)
        if not further:
            return
        names = {each.name for each in further}
        added = [each for each in self.journal.points() if each.name in names]
        self._coming.extendleft(reversed(added))
        self._count += len(added)
        text = f"after {point.name}, these points follow: {', '.join(each.name for each in added)}"
        self.say(CampaignEventKind.FURTHER, text, point=point.name, points=len(added))

    def _closing(self) -> str:
        request = self.switch.request
        if request is not None:
            return f"was stopped: {request.reason}"
        failed = sum(point_result.outcome is PointOutcome.FAILED for point_result in self._results)
        return f"is finished, {count_text(failed, 'point')} failed" if failed else "is finished"

    def _report_end(self, text: str, reason_code: str) -> None:
        counts = Counter(point_result.outcome for point_result in self._results)
        results = {each.value: counts[each] for each in PointOutcome}
        self.say(CampaignEventKind.ENDED, text, why=reason_code, left=len(self._coming), **results)

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


def run_campaign(
    bench: Bench,
    campaign: Campaign,
    folder: Path,
    existing: ExistingRecordings | str = ExistingRecordings.REFUSE,
    after_failure: AfterFailure | str = AfterFailure.STOP,
    on_progress: Callable[[CampaignProgress], None] = ignore_result,
    on_result: Callable[[PointResult], None] = ignore_result,
    switch: StopSwitch | None = None,
    after: After | None = None,
    reopen: Reopen | None = None,
    changed_bench: ChangedBench | str = ChangedBench.REFUSE,
    on_event: CampaignListener = ignore_event,
    messengers: tuple[Messenger, ...] = (),
    move_beam: CommandMessenger | None = None,
) -> tuple[PointResult, ...]:
    """Make every recording of ``campaign`` in ``folder``, in order, on an open bench.

    All points are checked against the limits of the rig before the first one starts. The journal records
    what was done, what failed and why. A killed campaign continues with ``existing="resume"`` at its first
    unfinished point. Ctrl-C ramps the running measurement down and ends the campaign. Returns one result per
    recording made, kept or failed; a stopped campaign returns fewer results than it has points.

    Parameters
    ----------
    bench, campaign, folder
        The open bench, the plan, and the folder of the recordings.
    existing, after_failure, changed_bench
        What to do about existing recordings, a point whose attempts are used up, and a bench that differs
        from the bench at the start; give members of the enums or their values.
    on_progress, on_result, on_event
        Functions called after every block, after every recording, and at every event.
    switch
        Switch by which another thread holds the running measurement or ends the campaign.
    after
        Function called after every point that is done; the measurements that it returns are made next, in
        this session or after a resume.
    reopen
        Function that closes and opens the bench when an instrument is lost and the campaign allows another
        attempt; if None, a lost instrument ends the campaign.
    messengers
        Ways to notify somebody at every fault and at the end.
    move_beam
        Command that moves the vibrometer of a real rig to each point of a scan; it reads the point as JSON.
        If None, the campaign holds until the operator has moved the vibrometer.

    Raises
    ------
    LimitExceeded
        When any point would exceed a limit; nothing has been played.
    RecordingError
        When the folder contains recordings already and ``existing`` refuses that, or another program is
        running the same campaign.
    CheckFailed
        When the bench has changed and ``changed_bench`` refuses that.
    AcquisitionError
        The error of a failed run, when ``after_failure`` is ``stop`` or an instrument is lost.
    """
    existing = member(ExistingRecordings, existing)
    after_failure = member(AfterFailure, after_failure)
    changed_bench = member(ChangedBench, changed_bench)
    points = campaign.points()
    require_all_within_limits(points, bench)
    if existing is ExistingRecordings.REFUSE:
        require_new(campaign, points, folder)
    make_folder(folder)
    stop = StopSwitch() if switch is None else switch
    with ExitStack() as session:
        log = session.enter_context(_log_alone(folder, campaign))
        session.enter_context(stop_on_signal(stop, campaign.name))
        journal = session.enter_context(open_journal(bench, campaign, folder, existing, changed_bench, stop))
        where = folder / f"{campaign.name}{STATUS_SUFFIX}"
        status = session.enter_context(StatusLine(where, campaign.name, journal.points(), campaign.rest_s))
        notifier = Notifier(campaign.name, folder, messengers, log)

        def say(kind: CampaignEventKind, text: str, **facts: str | float) -> None:
            for listener in (log, status, notifier, on_event):
                listener(CampaignEvent(kind, text, facts))

        def progress(stand: CampaignProgress) -> None:
            status.progress(stand)
            on_progress(stand)

        runner = CampaignRunner(bench, campaign, journal, stop, say, move_beam, reopen, after_failure, after)
        return runner.run(progress, on_result)


@contextmanager
def _log_alone(folder: Path, campaign: Campaign) -> Iterator[CampaignLog]:
    """Open and lock the log, so that no other program can run the same campaign."""
    with CampaignLog(folder / f"{campaign.name}{LOG_SUFFIX}") as log, ExitStack() as mark:
        try:
            mark.enter_context(sole_use(log.path))
        except RecordingError as error:
            raise RecordingError(
                f"another program is running the campaign {campaign.name!r} in {folder}. "
                "Nothing was changed; wait until that program has ended, or stop that program"
            ) from error
        yield log


LOOK_AGAIN_S = 1.0
"""Simulated time before a virtual bench is reopened [s], in which the fault script may reconnect cables."""


class ReconnectingBench:
    """Bench that can be reopened without confirming its knobs again. Use it in a ``with`` statement."""

    def __init__(self, config: Rig | Path, confirm: Confirm | None = None) -> None:
        self._rig = config if isinstance(config, Rig) else load_rig(config)
        self._confirm = confirm
        self._power = RigPower(self._rig)
        self._bench: Bench | None = None
        self._last_check: CheckResult | None = None

    @property
    def bench(self) -> Bench:
        """The open bench; raises an error if the bench is not open."""
        if self._bench is None:
            raise AcquisitionError("the bench is not open: use 'with ReconnectingBench(...) as kept'")
        return self._bench

    @property
    def played_faults(self) -> tuple[str, ...]:
        """Faults that a script has injected into the virtual rig so far, in order."""
        return tuple(each.fault for each in self._power.played_faults)

    def reopen(self) -> Bench:
        """Close the bench, open it again and return it; confirmed manual settings (knobs) stay valid.

        Raises AcquisitionError when an instrument is still missing. The bench then stays closed; try again.
        """
        before, self._bench = self._bench, None
        if before is not None:
            self._last_check = before.last_check
            self._confirm = partial(confirm_knobs_of, before.confirmations, "the first opening of the bench")
            with suppress(AcquisitionError):  # closing fails only if an instrument is lost
                before.close()
        self._power.let_pass(LOOK_AGAIN_S)
        self._bench = open_bench(self._rig, self._confirm, power=self._power)
        self._bench.last_check = self._last_check
        return self._bench

    def close(self) -> None:
        """Silence and close all instruments. May be called at any time."""
        self.__exit__(None, None, None)

    def __enter__(self) -> Self:
        with ExitStack() as undo:
            undo.enter_context(self._power)
            self._bench = open_bench(self._rig, self._confirm, power=self._power)
            undo.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        bench, self._bench = self._bench, None
        try:
            if bench is not None:
                bench.__exit__(kind, error, trace)
        finally:
            self._power.__exit__(kind, error, trace)


WRITTEN_SHARE = 1 / 1.7
"""Ratio of a recording's final size to its size while growing, for 24-bit white noise; smaller for dwells."""


@dataclass(frozen=True)
class CampaignEstimate:
    """Duration and disk space needed for the recordings that a campaign must still make."""

    recordings: int
    """Number of recordings that the campaign must still make."""
    kept: int
    """Number of recordings that exist and are complete."""
    duration_s: float
    """Duration by the rig's clock, including bench checks, lead-ins and ramps [s]."""
    rest_s: float
    """Part of ``duration_s`` for pauses between recordings [s]."""
    lead_in_s: float
    """Part of ``duration_s`` for lead-ins of points in chains [s]."""
    largest_bytes: int
    """Largest size of one recording while it grows [bytes]."""
    total_bytes: int
    """Total size of all finished recordings [bytes]."""
    free_bytes: int
    """Free space on the disk that contains the folder [bytes]."""
    searching: int = 0
    """Number of recordings that may end early, because of feedback or because results are accurate enough."""

    @property
    def needed_bytes(self) -> int:
        """Disk space that the campaign needs [bytes]."""
        return self.total_bytes + self.largest_bytes

    @property
    def fits(self) -> bool:
        """Whether the disk has enough free space for the campaign."""
        return self.needed_bytes <= self.free_bytes


def estimate_campaign(
    campaign: Campaign, rig: Rig, folder: Path, existing: ExistingRecordings = ExistingRecordings.REFUSE
) -> CampaignEstimate:
    """Estimate the duration and disk space of a campaign; open no instrument and write nothing.

    Raises RecordingError when the folder contains recordings of the campaign and ``existing`` refuses that,
    ConfigurationError when a part that a measurement needs is missing, and LimitExceeded when feedback on
    the rig cannot hold a requested motion.
    """
    for each in campaign.measurements:
        require_played(each, rig)
    for point in campaign.points():
        rig_at(rig, point.measurement)
    planned = planned_recordings(campaign, folder, existing)
    missing = [each.measurement for each in planned if not each.is_complete]
    for each in missing:
        each.excitation.require_holdable(rig)
    durations_s = [measuring_s(each) for each in missing]
    bytes_per_s = rig.daq.sample_rate_hz * len(channels_of(rig)) * BYTES_PER_SAMPLE
    rest_s = campaign.rest_s * max(0, len(missing) - 1)
    disk = next(each for each in (folder.resolve(), *folder.resolve().parents) if each.exists())
    return CampaignEstimate(
        recordings=len(missing),
        kept=len(planned) - len(missing),
        duration_s=sum(durations_s) + rest_s,
        rest_s=rest_s,
        lead_in_s=sum(each.excitation.lead_in_s for each in missing),
        largest_bytes=round(max(durations_s, default=0.0) * bytes_per_s),
        total_bytes=round(sum(durations_s) * bytes_per_s * WRITTEN_SHARE),
        free_bytes=shutil.disk_usage(disk).free,
        searching=sum(
            isinstance(each.excitation, AbstractFeedback) or each.until is not None for each in missing
        ),
    )
