"""Exit codes of all commands: docs/installation.md."""

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of commands."""

    DONE = 0
    """The command did everything that was requested."""
    FAILED = 1
    """An error, a value that is not allowed, or a failed part; standard error has a sentence about it."""
    MISUSED = 2
    """A command or an option is unknown or missing."""
    STOPPED = 3
    """The command was stopped without a failure; ``--resume`` continues."""
