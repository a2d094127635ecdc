"""Whether a process lives: its number alone does not say, since numbers are given again."""

from ._this import process_start

UNKNOWN = ""
"""The start of a process that lives, where the system does not tell it."""


def is_process(pid: int, start: str) -> bool:
    """Whether the process that began then still lives; with `UNKNOWN`, whether any of that number does."""
    now = process_start(pid)
    return now is not None and (UNKNOWN in (now, start) or now == start)
