"""What a campaign tells: how each recording came out, and where it stands."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from ..plan import Measurement
from ..recording import Recording
from ..run import Progress
from ._reason_code import Why


class Existing(StrEnum):
    """What to do about recordings that are in the folder already."""

    REFUSE = "refuse"
    """Begin no campaign over an older one."""
    RESUME = "resume"
    """Leave out what is complete; make another attempt, beside the old one, at what is not."""


class AfterFailure(StrEnum):
    """What to do when a measurement fails, and its attempts are used up."""

    STOP = "stop"
    GO_ON = "go_on"
    """Make the next one, unless an instrument or the disk is lost: nothing can be measured then."""


class ChangedBench(StrEnum):
    """What to do when a campaign is resumed on another bench than it was begun on."""

    REFUSE = "refuse"
    ACCEPT = "accept"
    """Go on, and keep both in the journal."""


class Item(StrEnum):
    """How one recording of a campaign came out."""

    RECORDED = "recorded"
    KEPT = "kept"
    """It was complete before."""
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class CampaignItem:
    """One recording of a campaign, as it came out."""

    name: str
    result: Item
    path: Path
    reason: str
    why: Why


@dataclass(frozen=True, eq=False)
class CampaignProgress:
    """Where a campaign stands after each block."""

    name: str
    number: int
    """Of this recording, from 1."""
    count: int
    """Recordings in all."""
    path: Path
    """Of the recording that is being made."""
    run: Progress


@dataclass(frozen=True)
class DonePoint:
    """A point whose recording is complete."""

    name: str
    measurement: Measurement
    path: Path


@dataclass(frozen=True)
class Finished:
    """What a callback is told when a point is done: the point, and all that are."""

    point: DonePoint
    done: tuple[DonePoint, ...]
    """In the order of the campaign, ``point`` included; the same after a resume."""


After = Callable[[Finished, Recording], Iterable[Measurement]]
"""Asked after every point with its open recording; gives the measurements to be made next, or none."""


def ignore_campaign_progress(progress: CampaignProgress) -> None:
    """Watch nothing."""


def ignore_item(item: CampaignItem) -> None:
    """Do nothing about a recording."""
