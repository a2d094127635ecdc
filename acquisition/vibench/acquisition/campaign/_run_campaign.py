"""A campaign from its first point to its last: one recording each, every step in a journal."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from ..bench.bench import RunBench
from ..errors import AcquisitionError, InstrumentLost, RecordingError
from ..host.chosen import chosen
from ..plan import Campaign, Measurement, Point
from ..recording import open_recording, sole_use
from ..run.ending import Progress
from ..stopping.stop import StopSwitch
from ..stopping.stop_on_signal import stop_on_signal
from ._attempts import Attempts, CoolingPause, Reopen
from ._journal import Journal, JournalPoint, JournalPointState
from ._log import (
    LOG_SUFFIX,
    STATUS_SUFFIX,
    CampaignEvent,
    CampaignEventKind,
    CampaignListener,
    CampaignLog,
    StatusLine,
    ignore_event,
)
from ._notice import Messenger, Notifier
from ._opening import make_folder, opened_journal, require_all_within_limits, require_new
from ._point_outcome import (
    After,
    AfterFailure,
    CampaignProgress,
    ChangedBench,
    DonePoint,
    ExistingRecordings,
    Finished,
    PointOutcome,
    PointResult,
    ReasonCode,
    ignore_campaign_progress,
    ignore_result,
    reason_code_of,
)


class CampaignRunner:
    """The way through the points, with what results add to it."""

    def __init__(
        self,
        journal: Journal,
        folder: Path,
        attempts: Attempts,
        stop: StopSwitch,
        after_failure: AfterFailure,
        after: After | None,
        say: CampaignListener,
    ) -> None:
        self._journal = journal
        self._folder = folder
        self._attempts = attempts
        self._stop = stop
        self._after_failure = after_failure
        self._after = after
        self._say = say
        self._coming = deque(journal.points())
        self._count = len(self._coming)
        self._results: list[PointResult] = []

    def run(
        self,
        campaign: Campaign,
        on_progress: Callable[[CampaignProgress], None],
        on_result: Callable[[PointResult], None],
    ) -> tuple[PointResult, ...]:
        """Make the points one after the other; returns how each came out."""
        done = sum(point.state is JournalPointState.DONE for point in self._coming)
        begun = (
            CampaignEventKind.RESUMED
            if any(point.attempts for point in self._coming) or done
            else CampaignEventKind.BEGUN
        )
        text = f"{campaign.name}: {self._count} points, {done} done before"
        self._say(CampaignEvent(begun, text, {"points": self._count, "done": done}))
        self._name_damaged()
        try:
            while self._coming and self._may_begin(self._coming[0]):
                point = self._coming.popleft()
                number = len(self._results) + 1

                def tell(
                    path: Path, progress: Progress, name: str = point.name, number: int = number
                ) -> None:
                    on_progress(CampaignProgress(name, number, self._count, path, progress))

                point_result = self._made(point, tell)
                self._results.append(point_result)
                on_result(point_result)
                self._follow_up(point, point_result)
                if point_result.outcome is PointOutcome.STOPPED:
                    break
        except AcquisitionError as error:
            self._ended(f"{campaign.name} ended: {error}", str(reason_code_of(error)))
            raise
        except BaseException as error:
            self._ended(f"{campaign.name} ended: {type(error).__name__}", "stopped")
            raise
        self._ended(f"{campaign.name} {self._closing()}", "stopped" if self._coming else "carried_out")
        return tuple(self._results)

    def _name_damaged(self) -> None:
        """Say of which points the recordings no longer count."""
        for point in self._coming:
            if point.reason_code in (ReasonCode.DAMAGED, ReasonCode.GONE):
                text = f"{point.name} is made again: {point.reason}"
                facts = {"point": point.name, "file": point.file, "why": point.reason_code.value}
                self._say(CampaignEvent(CampaignEventKind.DAMAGED, text, facts))

    def _may_begin(self, point: JournalPoint) -> bool:
        """Rest before a point that is to be made; a stop ends the rest, and the campaign."""
        if point.state is not JournalPointState.DONE and self._stop.request is None:
            self._attempts.pause_before(point.name)
        return self._stop.request is None

    def _made(self, point: JournalPoint, tell: Callable[[Path, Progress], None]) -> PointResult:
        if point.state is JournalPointState.DONE:
            path = self._folder / point.file
            return PointResult(point.name, PointOutcome.KEPT, path, "complete before", point.reason_code)
        try:
            return self._attempts.carry_out(Point(point.name, point.measurement, point.chain), tell)
        except (InstrumentLost, RecordingError):
            raise  # without instruments, or without room on the disk, the next point would fail too
        except AcquisitionError as error:
            if self._after_failure is AfterFailure.STOP:
                raise
            path = self._folder / next(
                each.file for each in self._journal.points() if each.name == point.name
            )
            return PointResult(point.name, PointOutcome.FAILED, path, str(error), reason_code_of(error))

    def _follow_up(self, point: JournalPoint, point_result: PointResult) -> None:
        """Ask what a result asks for, once, and put it next."""
        is_done = point_result.outcome in (PointOutcome.RECORDED, PointOutcome.KEPT)
        if not is_done or point.is_followed_up or self._after is None:
            return
        done = tuple(
            DonePoint(each.name, each.measurement, self._folder / each.file)
            for each in self._journal.points()
            if each.state is JournalPointState.DONE
        )
        this = next(each for each in done if each.name == point.name)
        with open_recording(point_result.path) as recording:
            asked = tuple(self._after(Finished(this, done), recording))
        further = tuple(Point(name, each) for each in asked for name in _names(each))
        self._journal.follow_up(point.name, further)
        if not further:
            return
        names = {each.name for each in further}
        added = [each for each in self._journal.points() if each.name in names]
        self._coming.extendleft(reversed(added))
        self._count += len(added)
        text = f"{point.name} asks for {', '.join(each.name for each in added)}"
        self._say(CampaignEvent(CampaignEventKind.FURTHER, text, {"point": point.name, "points": len(added)}))

    def _closing(self) -> str:
        request = self._stop.request
        if request is not None:
            return f"was stopped: {request.reason}"
        failed = sum(point_result.outcome is PointOutcome.FAILED for point_result in self._results)
        return f"is through, {failed} points failed" if failed else "is through"

    def _ended(self, text: str, reason_code: str) -> None:
        counts = {
            each.value: sum(point_result.outcome is each for point_result in self._results)
            for each in PointOutcome
        }
        self._say(
            CampaignEvent(
                CampaignEventKind.ENDED, text, {"why": reason_code, "left": len(self._coming), **counts}
            )
        )


def _names(measurement: Measurement) -> tuple[str, ...]:
    return tuple(point.name for point in Campaign(name="further", measurements=(measurement,)).points())


def run_campaign(
    bench: RunBench,
    campaign: Campaign,
    folder: Path,
    existing: ExistingRecordings | str = ExistingRecordings.REFUSE,
    after_failure: AfterFailure | str = AfterFailure.STOP,
    on_progress: Callable[[CampaignProgress], None] = ignore_campaign_progress,
    on_result: Callable[[PointResult], None] = ignore_result,
    switch: StopSwitch | None = None,
    after: After | None = None,
    reopen: Reopen | None = None,
    changed_bench: ChangedBench | str = ChangedBench.REFUSE,
    on_event: CampaignListener = ignore_event,
    messengers: tuple[Messenger, ...] = (),
) -> tuple[PointResult, ...]:
    """Make every recording of ``campaign`` in ``folder``, in order, on an open bench.

    All points are held against the limits of the rig before the first one begins. What was done, what
    failed and why stands in the campaign's journal, so that a campaign that was killed goes on with
    ``existing="resume"`` at its first unfinished point. Ctrl-C ends the running measurement softly, and
    the campaign with it.

    Parameters
    ----------
    bench, campaign, folder
        On what, what, and where to.
    existing, after_failure, changed_bench
        What to do about recordings that are there, about a point whose attempts are used up, and about
        another bench than the campaign was begun on; members of the enums or their words.
    on_progress, on_result, on_event
        Called after every block, after every recording, and whenever something happens.
    switch
        Lets others hold the running measurement, or end the campaign.
    after
        Asked after every point that is done; the measurements it gives are made next, in this session
        or after a resume.
    reopen
        Closes and opens the bench when an instrument is lost and the campaign's retries allow another
        attempt; absent, a lost instrument ends the campaign.
    messengers
        Ways to reach somebody at every fault and at the end.

    Returns
    -------
    tuple of PointResult
        What was made, kept or failed; it ends early when the campaign was stopped.

    Raises
    ------
    LimitExceeded
        When any point would pass a limit; nothing was played.
    RecordingError
        When the folder holds recordings already and ``existing`` refuses that, or another program carries
        out the same campaign.
    CheckFailed
        When the bench has changed and ``changed_bench`` refuses that.
    AcquisitionError
        Whatever a failing run raises, when ``after_failure`` says stop, or an instrument is lost.

    """
    existing = chosen(ExistingRecordings, existing)
    after_failure = chosen(AfterFailure, after_failure)
    changed_bench = chosen(ChangedBench, changed_bench)
    points = campaign.points()
    require_all_within_limits(points, bench)
    if existing is ExistingRecordings.REFUSE:
        require_new(campaign, points, folder)
    make_folder(folder)
    stop = StopSwitch() if switch is None else switch
    with ExitStack() as session:
        log = session.enter_context(_log_alone(folder, campaign))
        session.enter_context(stop_on_signal(stop, campaign.name))
        journal = session.enter_context(
            opened_journal(bench, campaign, folder, existing, changed_bench, stop)
        )
        where = folder / f"{campaign.name}{STATUS_SUFFIX}"
        status = session.enter_context(StatusLine(where, campaign.name, journal.points(), campaign.rest_s))
        notifier = Notifier(campaign.name, folder, messengers, log)

        def say(event: CampaignEvent) -> None:
            for listener in (log, status, notifier, on_event):
                listener(event)

        def progress(stand: CampaignProgress) -> None:
            status.progress(stand)
            on_progress(stand)

        pause = CoolingPause(campaign.rest_s, stop, say)
        attempts = Attempts(bench, journal, campaign.retry, stop, say, pause, reopen)
        runner = CampaignRunner(journal, folder, attempts, stop, after_failure, after, say)
        return runner.run(campaign, progress, on_result)


@contextmanager
def _log_alone(folder: Path, campaign: Campaign) -> Iterator[CampaignLog]:
    """Open the log, which also marks the campaign as running; the mark goes with the process."""
    with CampaignLog(folder / f"{campaign.name}{LOG_SUFFIX}") as log, ExitStack() as mark:
        try:
            mark.enter_context(sole_use(log.path))
        except RecordingError as error:
            raise RecordingError(
                f"the campaign {campaign.name!r} is being carried out in {folder} by another program. "
                "Nothing was changed; let it end, or stop it"
            ) from error
        yield log
