"""Errors of an analysis; each message states what was given, what is allowed, and what to do next."""


class AnalysisError(Exception):
    """Base class of all errors that stop an analysis; the message is one sentence for the analyst."""


class InvalidRequest(AnalysisError, ValueError):
    """A setting, or a combination of settings, that is invalid for this analysis."""


class NotEnoughData(AnalysisError, ValueError):
    """The recording is too short for the requested result, or too much of it is invalid."""


class UnusableData(AnalysisError, ValueError):
    """The samples cannot be analysed: for example, the drive channel is dead or values are not finite."""
