"""How the points of a campaign came out: a sentence for people, a word for programs, and where it stands."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from ..errors import (
    AcquisitionError,
    CheckFailed,
    ConfigurationError,
    DataLost,
    DriveLate,
    InstrumentError,
    InstrumentLost,
    LimitExceeded,
    RecordingError,
)
from ..plan import Measurement
from ..recording import Recording
from ..run.ending import Progress


class ReasonCode(StrEnum):
    """The named reason of a point's state; the words of `plan.retry.Retryable` are among them."""

    NOT_YET = "not_yet"
    """Its turn has not come."""
    RUNNING = "running"
    CARRIED_OUT = "carried_out"
    OVER_RANGE = "over_range"
    """Carried out, with an input near its full scale while it counted."""
    FOUND = "found"
    """A complete recording of the same plan lay in the folder."""
    GONE = "gone"
    """It was done, and its recording has been taken away."""
    DAMAGED = "damaged"
    """It was done, and its recording is not as it was sealed; that one is kept, and it is made again."""
    STOPPED = "stopped"
    """Somebody asked for a stop; the sentence says who."""
    PROGRAM_ENDED = "program_ended"
    """The program ended without a word: killed, crashed, or without power."""
    DATA_LOST = "data_lost"
    INSTRUMENT_LOST = "instrument_lost"
    INSTRUMENT_FAULT = "instrument_fault"
    CHECK_FAILED = "check_failed"
    LIMIT = "limit"
    DISK = "disk"
    PLAN = "plan"
    """Nothing on this bench can play it."""
    FAULT = "fault"
    """Anything else that went wrong."""


_CODE_BY_ERROR: tuple[tuple[type[AcquisitionError], ReasonCode], ...] = (
    (DataLost, ReasonCode.DATA_LOST),
    (InstrumentLost, ReasonCode.INSTRUMENT_LOST),
    (InstrumentError, ReasonCode.INSTRUMENT_FAULT),
    (CheckFailed, ReasonCode.CHECK_FAILED),
    (LimitExceeded, ReasonCode.LIMIT),
    (RecordingError, ReasonCode.DISK),
    (ConfigurationError, ReasonCode.PLAN),
    (DriveLate, ReasonCode.PLAN),
)


def reason_code_of(error: AcquisitionError) -> ReasonCode:
    """Name the reason that an error stands for."""
    return next(
        (reason_code for kind, reason_code in _CODE_BY_ERROR if isinstance(error, kind)), ReasonCode.FAULT
    )


class ExistingRecordings(StrEnum):
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


class PointOutcome(StrEnum):
    """How one recording of a campaign came out."""

    RECORDED = "recorded"
    KEPT = "kept"
    """It was complete before."""
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class PointResult:
    """One recording of a campaign, as it came out."""

    name: str
    outcome: PointOutcome
    path: Path
    reason: str
    reason_code: ReasonCode


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


def ignore_result(point_result: PointResult) -> None:
    """Do nothing about a recording."""
