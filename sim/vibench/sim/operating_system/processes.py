"""Whether a process lives: its number alone does not say, since numbers are given again."""

import os
from enum import Enum, auto

from .this import process_start

UNKNOWN = ""
"""The start of a process that lives, where the system does not tell it."""


class Place(Enum):
    """Where a process was started, as its start says it; numbers of processes are known `HERE` only."""

    HERE = auto()
    CONTAINER = auto()
    """On this computer since it was switched on, in another container than this program."""
    ELSEWHERE = auto()
    """On another computer, or before this one was switched on."""


def place_of(start: str) -> Place:
    """Return where a process was started; `Place.HERE` where the system does not say."""
    own, other = ((each or "").split("_") for each in (process_start(os.getpid()), start))
    if len(own) != len(other) or own[:-1] == other[:-1]:
        return Place.HERE
    return Place.CONTAINER if own[0] == other[0] else Place.ELSEWHERE


def is_process(pid: int, start: str) -> bool:
    """Whether the process that began then still lives; with `UNKNOWN`, whether any of that number does."""
    now = process_start(pid)
    return now is not None and (UNKNOWN in (now, start) or now == start)
