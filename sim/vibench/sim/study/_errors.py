"""The errors of a study: each says what was given, what is allowed, and what to do next."""


class StudyError(Exception):
    """A study cannot be run, kept, resumed or opened; the text is one sentence for the person who asked."""


class InvalidStudy(StudyError, ValueError):
    """A study asks for something that is not allowed; nothing was computed."""


class ClusterLost(StudyError, ConnectionError):
    """The cluster cannot be reached, or is gone; what was kept before is kept."""
