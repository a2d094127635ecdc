"""Stops of a run: their causes, the level for each cause, and the switch that passes them between threads."""

import mmap
import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from threading import Lock

from ..errors import AcquisitionError


class StopLevel(StrEnum):
    """Level of a stop, in order from the gentlest to the hardest."""

    HOLD = "hold"
    """Keep the present drive until the run is released or stopped."""
    RAMP = "ramp"
    """Ramp down with the half-cosine ramp of the plan."""
    ABORT = "abort"
    """Ramp down in three periods of the loaded shaker on its suspension: the shortest ramp without shock."""
    OFF = "off"
    """Switch the output off at once, with a step."""


_HARDNESS = {level: number for number, level in enumerate(StopLevel)}


class Cause(StrEnum):
    """Cause of a stop."""

    OPERATOR = "operator"
    """An operator requested a stop."""
    EMERGENCY = "emergency key"
    """The Esc key, or the large stop button of the window."""
    KEYBOARD = "ctrl-c"
    TERMINATED = "terminated"
    """The operating system ended the process."""
    VIEWER_GONE = "viewer gone"
    """An attended run received no request for too long: its window froze, was closed or was killed."""
    PARENT_GONE = "parent gone"
    """The program that started the engine has ended."""
    PROGRAM = "program left"
    """The program that ran the measurement abandoned it."""
    LIMIT = "limit"
    INSTRUMENT = "instrument"
    DISK = "disk"
    FAULT = "fault"
    """Any other fault during the run."""


LEVELS: Mapping[Cause, StopLevel] = {
    Cause.OPERATOR: StopLevel.RAMP,
    Cause.EMERGENCY: StopLevel.ABORT,
    Cause.KEYBOARD: StopLevel.RAMP,
    Cause.TERMINATED: StopLevel.ABORT,
    Cause.VIEWER_GONE: StopLevel.ABORT,
    Cause.PARENT_GONE: StopLevel.ABORT,
    Cause.PROGRAM: StopLevel.ABORT,
    Cause.LIMIT: StopLevel.ABORT,
    Cause.INSTRUMENT: StopLevel.OFF,
    Cause.DISK: StopLevel.OFF,
    Cause.FAULT: StopLevel.OFF,
}
"""Stop level for each cause. After a failure of an instrument, the disk or the program, nothing more can be
read. A generator that still responds is then ramped down as fast as it accepts commands and turned off.
"""


@dataclass(frozen=True)
class StopRequest:
    """A request to end a run, with its cause."""

    cause: Cause
    level: StopLevel
    reason: str

    @classmethod
    def of(cls, cause: Cause, reason: str) -> "StopRequest":
        """Return a stop request with the level that belongs to its cause."""
        return cls(cause, LEVELS[cause], reason)


class StopSwitch:
    """Switch by which any thread or signal handler can hold, mark or end a run or a campaign.

    The switch uses no lock, because a signal handler must not wait for a lock. A stop cannot be withdrawn,
    only replaced by a harder stop.
    """

    def __init__(self) -> None:
        self._requests: dict[StopLevel, StopRequest] = {}
        self._holding = False
        self.refusal_to_hold: Callable[[], str] = str
        """Function that returns the reason why the run cannot be held; empty if it can or nothing runs."""
        self._marks: deque[str] = deque()
        self._changes: deque[str] = deque()

    @property
    def request(self) -> StopRequest | None:
        """Hardest stop requested so far; None if no stop was requested."""
        # Each level has a separate entry: if two threads stop at once, the harder stop is not lost.
        for level in reversed(StopLevel):
            if level in self._requests:
                return self._requests[level]
        return None

    @property
    def is_holding(self) -> bool:
        """Whether the run is held (paused); a stop ends a hold."""
        return self._holding and not self._requests

    def ask(self, request: StopRequest) -> None:
        """Request a stop; the first request of each level is kept."""
        if request.level is StopLevel.HOLD:
            self.hold()
        else:
            self._requests.setdefault(request.level, request)

    def hold(self) -> None:
        """Hold (pause) the run."""
        self._holding = True

    def resume(self) -> None:
        """End a hold, so that the run continues."""
        self._holding = False

    def mark(self, text: str) -> None:
        """Add an event ``text`` to the recording, at its next sample."""
        self._marks.append(text)

    def take_marks(self) -> Iterator[str]:
        """Yield each requested event once, oldest first."""
        while self._marks:
            yield self._marks.popleft()

    def note_change(self, text: str) -> None:
        """Report a change of the specimen; the report ends a run with ``on_changed_specimen = "stop"``."""
        self._changes.append(text)

    def take_changes(self) -> Iterator[str]:
        """Yield each reported change of the specimen once, oldest first."""
        while self._changes:
            yield self._changes.popleft()

    def harder_than(self, level: StopLevel) -> StopRequest | None:
        """Return the requested stop if it is harder than ``level``, otherwise None."""
        request = self.request
        return request if request is not None and _HARDNESS[request.level] > _HARDNESS[level] else None


class DrivesOn:
    """Drives that have started and are not yet confirmed as off."""

    def __init__(self) -> None:
        self._drives: dict[str | None, object] = {}
        self._has_advanced = False

    def __bool__(self) -> bool:
        return bool(self._drives)

    def begin(self, drive: object, generator: str = "") -> None:
        """Register that a drive may be on, and forget an earlier unconfirmed drive of the same generator."""
        self._drives[generator] = drive

    def confirm_silence(self, drive: object) -> None:
        """Register that the output of a drive was read back as off. May be called at any time."""
        generators = {each: generator for generator, each in tuple(self._drives.items())}
        self._drives.pop(generators.get(drive), None)

    def note_advance(self) -> None:
        """Register that the run of a drive is still reading blocks."""
        self._has_advanced = True

    def take_advance(self) -> bool:
        """Return whether a run has read blocks since the last call of this method."""
        advanced, self._has_advanced = self._has_advanced, False
        return advanced


DRIVES_ON = DrivesOn()
"""Drives of this process that may still be on."""


RESERVE_BYTES = 16_000_000
"""Size of the memory reserve: generator commands need some kB, and other threads may also use it."""


class MemoryReserve:
    """Reserved address space, released so that a drive can be silenced when memory is exhausted."""

    def __init__(self) -> None:
        self._held: mmap.mmap | None = None
        self._changing = Lock()

    def hold(self) -> None:
        """Reserve the memory before any drive starts; raise AcquisitionError if there is not enough."""
        with self._changing:
            if self._held is None:
                try:
                    self._held = mmap.mmap(-1, RESERVE_BYTES)
                except (OSError, MemoryError) as error:
                    raise AcquisitionError(
                        f"this process can get no more memory ({error}), but needs {RESERVE_BYTES / 1e6:g} "
                        "MB to silence the drive in every case. Nothing was played; close other programs, or "
                        "raise the limit (ulimit -v)"
                    ) from error

    def release(self) -> None:
        """Release the reserve. May be called at any time."""
        held, self._held = self._held, None
        if held is not None:
            held.close()


MEMORY_RESERVE = MemoryReserve()
"""Memory reserve of this process."""


class DescriptorReserve:
    """File descriptors kept in reserve, for use when the process may open no more files."""

    def __init__(self, descriptors: int = 1) -> None:
        self._descriptors = descriptors
        self._held: list[int] = []

    def hold(self) -> None:
        """Reserve all descriptors that are not reserved yet; raises OSError if there are not enough."""
        while len(self._held) < self._descriptors:
            self._held.append(os.open(os.devnull, os.O_RDONLY))

    def release(self) -> bool:
        """Release the descriptors, and return whether any were reserved. May be called at any time."""
        is_held = bool(self._held)
        while self._held:
            os.close(self._held.pop())
        return is_held
