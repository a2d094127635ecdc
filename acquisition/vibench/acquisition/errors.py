"""The errors of a measurement: each says what happened, what was done about it, and what to do next."""

from dataclasses import dataclass


class AcquisitionError(Exception):
    """Base of everything that can go wrong between a plan and its recording.

    The text is one or two sentences for the person at the bench: what happened (with the value
    that was given and what is allowed), what was done about it, and what to do next.
    """


class ConfigurationError(AcquisitionError, ValueError):
    """A configuration, plan or campaign file says something that is not allowed.

    Raised before any instrument is touched. The text names file, key, what was given, what is allowed.
    """


class MissingLibrary(AcquisitionError, ImportError):
    """A library is not installed, as a plain installation leaves it out; the text names its extra."""


class InstrumentError(AcquisitionError):
    """An instrument refused a command, answered nonsense, or answered nothing in time."""


class InstrumentLost(InstrumentError, ConnectionError):
    """An instrument is gone: cable out, power off, server down. Its output state is unknown."""


class InstrumentBusy(InstrumentError):
    """Another program, or a task that was never closed, holds the instrument."""


class BrokenPromise(InstrumentError):
    """A plug-in raised an error of its own kind, or gave something else than its protocol says."""


class SettingRefused(InstrumentError):
    """A setting read back differs from what was sent: the instrument silently took another value."""


class DriveLate(AcquisitionError):
    """The generator takes longer for a setting than the plan leaves it: what it plays lags behind."""


class RunStalled(AcquisitionError):
    """A run or a bench check read no samples for too long, and its output was switched off."""


class DataLost(AcquisitionError):
    """Samples were overwritten before they were read: the record has a hole and ends here."""


@dataclass(frozen=True)
class LimitTrip:
    """The numbers of a limit that the running measurement has passed."""

    channel: str
    """Role of the channel that showed it: ``"base_acceleration"``."""
    quantity: str
    """What passed its limit: ``"stroke"``."""
    value: float
    """Largest magnitude of the block, in ``unit``."""
    limit: float
    unit: str
    sample: int
    """The first sample past the limit, counted from the first of the run."""
    time_s: float
    """The same, in seconds of the converter's clock."""


class LimitExceeded(AcquisitionError):
    """A plan, or the running measurement, goes past a limit of shaker, amplifier or specimen.

    The text names the quantity, its value, the limit, and where the limit comes from. ``trip`` holds
    the numbers when a running measurement was stopped; it is None for a plan that was refused.
    """

    def __init__(self, text: str, trip: LimitTrip | None = None) -> None:
        super().__init__(text)
        self.trip = trip


class CheckFailed(AcquisitionError):
    """The bench check before arming found something that does not fit the configuration."""


class CheckStopped(CheckFailed):
    """Somebody ended the bench check before it was through: it says nothing about the bench."""


class RecordingError(AcquisitionError, OSError):
    """A recording cannot be created, written, finished or read."""


class RecordingUnreachable(RecordingError):
    """The system could not read a recording, which may be intact."""
