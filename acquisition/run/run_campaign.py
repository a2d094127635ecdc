"""A campaign from its first measurement to its last: one recording each, nothing overwritten."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import assert_never

from ..errors import AcquisitionError, InstrumentLost, LimitExceeded, RecordingError
from ..plan.campaign import Campaign
from ..plan.limits import require_within_limits
from ..plan.measurement import Measurement
from ..recording.layout import SUFFIX, RecordingState, part_of, tmp_of
from ..recording.reader import open_recording
from .bench_protocol import RunBench
from .drive import drive_for
from .progress import Progress
from .run_measurement import run_measurement
from .state import RunState
from .stop import StopSwitch


class Existing(StrEnum):
    """What to do about recordings that are in the folder already."""

    REFUSE = "refuse"
    """Begin no campaign over an older one."""
    RESUME = "resume"
    """Leave out what is complete; make another attempt, beside the old one, at what is not."""


class AfterFailure(StrEnum):
    """What to do when a measurement fails."""

    STOP = "stop"
    GO_ON = "go_on"
    """Make the next one, unless an instrument is lost: nothing can be measured then."""


class Item(StrEnum):
    """How one recording of a campaign came out."""

    RECORDED = "recorded"
    KEPT = "kept"
    """It was complete before."""
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class PlannedRecording:
    """One recording that a campaign wants, and where it goes."""

    name: str
    measurement: Measurement
    path: Path
    is_complete: bool = False
    """It exists already, made by the same plan."""


@dataclass(frozen=True)
class CampaignItem:
    """One recording of a campaign, as it came out."""

    name: str
    result: Item
    path: Path
    reason: str


@dataclass(frozen=True, eq=False)
class CampaignProgress:
    """Where a campaign stands after each block."""

    name: str
    number: int
    """Of this recording, from 1."""
    count: int
    """Recordings in all."""
    path: Path
    run: Progress


def ignore_campaign_progress(progress: CampaignProgress) -> None:
    """Watch nothing."""


def ignore_item(item: CampaignItem) -> None:
    """Do nothing about a recording."""


def run_campaign(
    bench: RunBench,
    campaign: Campaign,
    folder: Path,
    existing: Existing = Existing.REFUSE,
    after_failure: AfterFailure = AfterFailure.STOP,
    on_progress: Callable[[CampaignProgress], None] = ignore_campaign_progress,
    on_item: Callable[[CampaignItem], None] = ignore_item,
    switch: StopSwitch | None = None,
) -> tuple[CampaignItem, ...]:
    """Make every recording of ``campaign`` in ``folder``, in order, on an open bench.

    All measurements are held against the limits of the rig before the first one begins. Ctrl-C
    ends the running measurement softly, and the campaign with it. ``on_progress`` is called after every
    block, ``on_item`` after every recording. ``switch`` lets others hold the running measurement, or end
    the campaign.

    Returns
    -------
    tuple of CampaignItem
        What was made, kept or failed; it ends early when the campaign was stopped.

    Raises
    ------
    LimitExceeded
        When any measurement would pass a limit; nothing was played.
    RecordingError
        When the folder holds recordings already and ``existing`` refuses that.
    AcquisitionError
        Whatever a failing run raises, when ``after_failure`` says stop, or an instrument is lost.

    """
    _require_all_within_limits(campaign, bench)
    _make(folder)
    plan = planned_recordings(campaign, folder, existing)
    items: list[CampaignItem] = []
    stop = StopSwitch() if switch is None else switch
    for number, planned in enumerate(plan, start=1):

        def tell(progress: Progress, number: int = number, planned: PlannedRecording = planned) -> None:
            on_progress(CampaignProgress(planned.name, number, len(plan), planned.path, progress))

        item = _carried_out(bench, planned, after_failure, tell, stop)
        items.append(item)
        on_item(item)
        if item.result is Item.STOPPED:
            break
    return tuple(items)


def planned_recordings(campaign: Campaign, folder: Path, existing: Existing) -> tuple[PlannedRecording, ...]:
    """Say which recordings are to be made and which are there; touches nothing.

    Raises
    ------
    RecordingError
        When recordings exist and ``existing`` refuses that, or a complete one was made by another plan.

    """
    wanted = [(name, measurement, _attempts(folder, name)) for name, measurement in campaign.recordings()]
    match existing:
        case Existing.REFUSE:
            present = [str(path) for _, _, attempts in wanted for path in attempts]
            if present:
                raise RecordingError(
                    f"{', '.join(present)} exist already, and nothing is ever overwritten. "
                    "Nothing was recorded; give another folder, or resume the campaign"
                )
            return tuple(PlannedRecording(name, each, _attempt(folder, name, 1)) for name, each, _ in wanted)
        case Existing.RESUME:
            return tuple(_resumed(folder, name, each, attempts) for name, each, attempts in wanted)
        case _:
            assert_never(existing)


def _attempts(folder: Path, name: str) -> tuple[Path, ...]:
    """Paths of recordings that this one's name has been given to, finished or not, in order."""
    attempts: list[Path] = []
    while _is_taken(candidate := _attempt(folder, name, len(attempts) + 1)):
        attempts.append(candidate)
    return tuple(attempts)


def _attempt(folder: Path, name: str, number: int) -> Path:
    # A measurement's name holds no dot, so that no second attempt takes another one's name.
    return folder / (f"{name}{SUFFIX}" if number == 1 else f"{name}.{number}{SUFFIX}")


def _is_taken(path: Path) -> bool:
    return any(each.exists() for each in (path, part_of(path), tmp_of(path)))


def _resumed(
    folder: Path, name: str, measurement: Measurement, attempts: tuple[Path, ...]
) -> PlannedRecording:
    for path in attempts:
        if not path.exists():
            continue
        with open_recording(path) as recording:
            if recording.state is not RecordingState.COMPLETE:
                continue
            if recording.plan != measurement.model_dump(mode="json"):
                raise RecordingError(
                    f"{path} is complete, but was made by another plan than the campaign's {name!r}. "
                    "Nothing was recorded; give the measurement another name, or another folder"
                )
            return PlannedRecording(name, measurement, path, is_complete=True)
    return PlannedRecording(name, measurement, _attempt(folder, name, len(attempts) + 1))


def _carried_out(
    bench: RunBench,
    planned: PlannedRecording,
    after_failure: AfterFailure,
    tell: Callable[[Progress], None],
    switch: StopSwitch,
) -> CampaignItem:
    if planned.is_complete:
        return CampaignItem(planned.name, Item.KEPT, planned.path, "complete before")
    try:
        outcome = run_measurement(bench, planned.measurement, planned.path, on_progress=tell, switch=switch)
    except InstrumentLost:
        raise
    except AcquisitionError as error:
        if after_failure is AfterFailure.STOP:
            raise
        return CampaignItem(planned.name, Item.FAILED, planned.path, str(error))
    result = Item.RECORDED if outcome.state is RunState.FINISHED else Item.STOPPED
    return CampaignItem(planned.name, result, planned.path, outcome.reason)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"{folder} cannot be made a folder for recordings ({error.strerror}). Nothing was played; "
            "give a folder that exists, or the name of a new one"
        ) from error


def _require_all_within_limits(campaign: Campaign, bench: RunBench) -> None:
    complaints: list[str] = []
    for measurement in campaign.measurements:
        try:
            require_within_limits(measurement, bench.rig)
            drive_for(bench, measurement)  # refuses what nothing on this bench can play
        except LimitExceeded as error:
            complaints.append(str(error))
    if complaints:
        raise LimitExceeded(" ".join(complaints))
