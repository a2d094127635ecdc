"""Where a study stands, for whoever watches it."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class StudyProgress:
    """How much is done, and how long the rest will take."""

    points: int
    """That are wanted: of a study all, of a map more as it is refined."""
    kept: int
    """With an answer; those of earlier sessions too."""
    failed: int
    """Of these, how many have an error for an answer, or a run that did not reach its end."""
    elapsed_s: float
    """Since this session began."""
    left_s: float | None
    """Until everything has an answer, as far as can be told; None before the first answer."""


StudyObserver = Callable[[StudyProgress], None]
"""Told in the thread that runs the study, after every batch of answers."""
Cancelled = Callable[[], bool]
"""Asked in the thread that runs the study, several times a second."""
