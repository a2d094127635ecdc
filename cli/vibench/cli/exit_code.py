"""Exit codes of all commands: docs/installation.md."""

from enum import IntEnum


class ExitCode(IntEnum):
    """What a command says to the shell that called it."""

    DONE = 0
    """All that was asked for."""
    FAILED = 1
    """An error, or a part of what was asked for has failed; a sentence on standard error says which."""
    MISUSED = 2
    """The command line itself was not understood."""
    STOPPED = 3
    """Not everything was done, and nothing failed: somebody stopped it, and ``--resume`` goes on."""
