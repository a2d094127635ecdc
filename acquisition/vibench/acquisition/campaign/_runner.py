"""The way through the points of a campaign, in order, with what results add to it."""

from collections import deque
from collections.abc import Callable
from pathlib import Path

from ..errors import AcquisitionError, InstrumentLost, RecordingError
from ..plan import Campaign, Measurement, Point
from ..recording import open_recording
from ..run.ending import Progress
from ..stopping.stop import StopSwitch
from ._attempts import Attempts
from ._event import CampaignEvent, CampaignEventKind, CampaignListener
from ._journal import Journal
from ._journal_point import JournalPoint, JournalPointState
from ._point_outcome import (
    After,
    AfterFailure,
    CampaignProgress,
    DonePoint,
    Finished,
    PointOutcome,
    PointResult,
    ReasonCode,
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
