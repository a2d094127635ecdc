"""Exit codes of all commands: docs/installation.md."""

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of commands."""

    DONE = 0
    """The command did everything that was requested."""
    FAILED = 1
    """An error, or a part of the request failed; standard error has a sentence about it."""
    MISUSED = 2
    """The command line is invalid."""
    STOPPED = 3
    """The command was stopped without a failure; ``--resume`` continues."""
