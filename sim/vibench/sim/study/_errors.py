"""Errors of a study. Every command loads these errors, so this module imports nothing."""


class StudyError(Exception):
    """Error: a study cannot be run, stored, resumed or opened; the message is a sentence for the user."""


class InvalidStudy(StudyError, ValueError):
    """Error: a study is not allowed; nothing was computed."""


class ClusterLost(StudyError, ConnectionError):
    """Error: the cluster cannot be reached or was lost; stored results are kept."""
