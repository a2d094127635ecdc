"""The errors of a measurement: each says what happened, what was done about it, and what to do next."""


class AcquisitionError(Exception):
    """Base of everything that can go wrong between a plan and its recording.

    The text is one or two sentences for the person at the bench: what happened (with the value
    that was given and what is allowed), what was done about it, and what to do next.
    """


class ConfigurationError(AcquisitionError, ValueError):
    """A configuration, plan or campaign file says something that is not allowed.

    Raised before any instrument is touched. The text names file, key, what was given, what is allowed.
    """


class InstrumentError(AcquisitionError):
    """An instrument refused a command, answered nonsense, or answered nothing in time."""


class InstrumentLost(InstrumentError, ConnectionError):
    """An instrument is gone: cable out, power off, server down. Its output state is unknown."""


class InstrumentBusy(InstrumentError):
    """Another program, or a task that was never closed, holds the instrument."""


class SettingRefused(InstrumentError):
    """A setting read back differs from what was sent: the instrument silently took another value."""


class DataLost(AcquisitionError):
    """Samples were overwritten before they were read: the record has a hole and ends here."""


class LimitExceeded(AcquisitionError):
    """A plan, or the running measurement, goes past a limit of shaker, amplifier or specimen.

    The text names the quantity, its value, the limit, and where the limit comes from.
    """


class CheckFailed(AcquisitionError):
    """The bench check before arming found something that does not fit the configuration."""


class RecordingError(AcquisitionError, OSError):
    """A recording cannot be created, written, finished or read."""
