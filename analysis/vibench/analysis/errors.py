"""The errors of an analysis: each says what was given, what is allowed, and what to do next."""


class AnalysisError(Exception):
    """Base of everything that can stop an analysis; the text is one sentence for the analyst."""


class InvalidRequest(AnalysisError, ValueError):
    """A setting, or a combination of settings, that has no meaning for this analysis."""


class NotEnoughData(AnalysisError, ValueError):
    """The recording is too short, or too much of it is invalid, for the result that was requested."""


class UnusableData(AnalysisError, ValueError):
    """The samples do not hold what the analysis needs: a dead drive channel, values that are not finite."""
