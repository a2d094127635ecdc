"""Why a point stands as it does: one word for programs, beside the sentence for people."""

from enum import StrEnum

from ..errors import (
    AcquisitionError,
    CheckFailed,
    ConfigurationError,
    DataLost,
    InstrumentError,
    InstrumentLost,
    LimitExceeded,
    RecordingError,
)


class Why(StrEnum):
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


_WHY_BY_ERROR: tuple[tuple[type[AcquisitionError], Why], ...] = (
    (DataLost, Why.DATA_LOST),
    (InstrumentLost, Why.INSTRUMENT_LOST),
    (InstrumentError, Why.INSTRUMENT_FAULT),
    (CheckFailed, Why.CHECK_FAILED),
    (LimitExceeded, Why.LIMIT),
    (RecordingError, Why.DISK),
    (ConfigurationError, Why.PLAN),
)


def why_of(error: AcquisitionError) -> Why:
    """Name the reason that an error stands for."""
    return next((why for kind, why in _WHY_BY_ERROR if isinstance(error, kind)), Why.FAULT)
