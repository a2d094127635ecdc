"""Limits for commands that read damaged files: allowed exit codes, time, memory, and faults."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

LONGEST_S = 10.0
"""Processor time that a command may take over one damaged file [s]."""
HANGS_S = 60.0
"""Time limit in real time [s]; it allows for other programs, and for waiting without processor time."""
MOST_BYTES = 1_000_000_000
"""Peak resident memory that such a command may use."""
LONGEST_COMPLAINT = 2_000
"""Allowed number of characters on standard error: a sentence and its list."""
STOPPED = 3
"""Exit code of a command that was stopped."""


@dataclass(frozen=True)
class Case:
    """A command, and the files of the folder in which it runs."""

    arguments: tuple[str, ...]
    files: Mapping[str, bytes] = field(default_factory=dict)
    prepare: tuple[str, ...] = ()
    """A module and arguments of its `prepare`, called before the command in its process; `prepare` returns a
    function that is called after the command."""
    hangs_s: float = HANGS_S

    def write(self, folder: Path) -> None:
        """Write the files."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


@dataclass(frozen=True)
class Ending:
    """How the process of a command ended."""

    code: int
    """Exit code, or the negative number of the signal that ended the process."""
    out: str
    err: str
    took_s: float
    """Processor time [s]."""
    clock_s: float
    peak_bytes: int
    """Peak resident memory, including that of the interpreter and libraries."""
    made: tuple[str, ...] = ()
    """Files in the folder that did not exist before."""

    @property
    def faults(self) -> tuple[str, ...]:
        """All violations of the limits; empty if there is none."""
        return tuple(said for said, is_so in self._possible_faults() if is_so)

    def _possible_faults(self) -> tuple[tuple[str, bool], ...]:
        complaint = [line for line in self.err.splitlines() if line.startswith("error: ")]
        return (
            (f"took {self.took_s:.1f} s", self.took_s > LONGEST_S or self.clock_s > HANGS_S),
            (f"took {self.peak_bytes / 1e6:.0f} MB", self.peak_bytes > MOST_BYTES),
            ("a traceback", "Traceback (most recent call last)" in self.err),
            (f"exit code {self.code}", self.code not in {0, 1, 2, STOPPED} and self.clock_s <= HANGS_S),
            ("an error, and exit code 0", self.code == 0 and bool(complaint)),
            (f"{len(complaint)} sentences, and exit code 1", self.code == 1 and len(complaint) != 1),
            (f"{len(self.err)} letters of complaint", len(self.err) > LONGEST_COMPLAINT),
        )
