"""Errors of a study. Each message states what was given, what is allowed, and what to do next."""


class StudyError(Exception):
    """A study cannot be run, stored, resumed or opened; the message is one sentence for the user."""


class InvalidStudy(StudyError, ValueError):
    """A study is not allowed; nothing was computed."""


class ClusterLost(StudyError, ConnectionError):
    """The cluster cannot be reached or was lost; stored results are kept."""
