"""A campaign from its first point to its last: one recording each, every step in a journal."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from ..bench.protocol import RunBench
from ..errors import RecordingError
from ..host.chosen import chosen
from ..plan import Campaign
from ..recording import sole_use
from ..stopping.stop import StopSwitch
from ..stopping.stop_on_signal import stop_on_signal
from ._attempts import Attempts, CoolingPause, Reopen
from ._event import CampaignEvent, CampaignListener, ignore_event
from ._log import LOG_SUFFIX, STATUS_SUFFIX, CampaignLog, StatusLine
from ._notice import Messenger, Notifier
from ._opening import make_folder, opened_journal, require_all_within_limits, require_new
from ._point_outcome import (
    After,
    AfterFailure,
    CampaignProgress,
    ChangedBench,
    ExistingRecordings,
    PointResult,
    ignore_campaign_progress,
    ignore_result,
)
from ._runner import CampaignRunner


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
