"""Errors of a measurement. Each error states what happened, what was done, and what to do next."""

from dataclasses import dataclass


class AcquisitionError(Exception):
    """Base class of all errors from reading a plan to writing its recording.

    The text is one or two sentences for the person at the bench: what happened (given and allowed value),
    what the program did about it, and what to do next.
    """


class ConfigurationError(AcquisitionError, ValueError):
    """A configuration, plan or campaign file contains something that is not allowed.

    Raised before any instrument is used. The text names file, key, given value and allowed values.
    """


class MissingLibrary(AcquisitionError, ImportError):
    """A library of an optional extra is not installed; the text names the extra."""


class InstrumentError(AcquisitionError):
    """An instrument refused a command, sent an invalid reply, or did not reply in time."""


class InstrumentLost(InstrumentError, ConnectionError):
    """An instrument cannot be reached: cable out, power off, server down. Its output may still be on."""


class InstrumentBusy(InstrumentError):
    """The instrument is in use by another program, or by a task that was never closed."""


class BrokenPromise(InstrumentError):
    """A plug-in raised an unexpected error, or violated its protocol."""


class SettingRefused(InstrumentError):
    """The value read back from the instrument differs from the requested value."""


class DriveLate(AcquisitionError):
    """The generator needs more time to change a setting than the plan allows: the drive would be late."""


class RunStalled(AcquisitionError):
    """A run or a bench check read no samples for too long, and its output was switched off."""


class DataLost(AcquisitionError):
    """Samples were overwritten before they were read; the recording ends at this gap."""


@dataclass(frozen=True)
class LimitTrip:
    """A limit that a running measurement has exceeded, with the measured value."""

    channel: str
    """Role of the channel, for example ``"base_acceleration"``."""
    quantity: str
    """Quantity that exceeded its limit, for example ``"stroke"``."""
    value: float
    """Largest magnitude in the block of samples that exceeded the limit, in ``unit``."""
    limit: float
    unit: str
    sample: int
    """Number of the first sample above the limit, counted from the start of the run."""
    time_s: float
    """Time of the first sample above the limit, by the converter's clock [s]."""


class LimitExceeded(AcquisitionError):
    """A plan, or the running measurement, exceeds a limit of shaker, amplifier or specimen.

    The text names the quantity, its value, the limit, and the source of the limit. If a running measurement
    was stopped, ``trip`` contains the limit and the measured value; ``trip`` is None for a refused plan.
    """

    def __init__(self, text: str, trip: LimitTrip | None = None) -> None:
        super().__init__(text)
        self.trip = trip


class CheckFailed(AcquisitionError):
    """The bench check before arming found a difference from the configuration."""


class CheckStopped(CheckFailed):
    """The bench check was stopped before its end and has no result."""


class RecordingError(AcquisitionError, OSError):
    """A recording cannot be created, written, finished or read."""


class RecordingUnreachable(RecordingError):
    """The operating system could not read a recording; the recording itself may be intact."""
