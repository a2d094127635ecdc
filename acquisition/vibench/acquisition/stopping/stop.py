"""Stops of a run: their causes, the level of each cause, and the switch between threads."""

import mmap
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from threading import Lock

from ..errors import AcquisitionError


class StopLevel(StrEnum):
    """How hard a run is stopped, from the gentlest to the hardest."""

    HOLD = "hold"
    """Stay as it is, drive included, until resumed or stopped."""
    RAMP = "ramp"
    """The half-cosine ramp that the plan ends with."""
    ABORT = "abort"
    """The shortest ramp that is no blow: three periods of the loaded shaker on its suspension."""
    OFF = "off"
    """The output is switched off at once, whatever the step does to the specimen."""

    def is_harder_than(self, other: "StopLevel") -> bool:
        """Whether this one ends sooner."""
        return _HARDNESS[self] > _HARDNESS[other]


_HARDNESS = {level: number for number, level in enumerate(StopLevel)}


class Cause(StrEnum):
    """What made a run end before its plan did."""

    OPERATOR = "operator"
    """Somebody pressed stop."""
    EMERGENCY = "emergency key"
    """Esc, or the large button."""
    KEYBOARD = "ctrl-c"
    TERMINATED = "terminated"
    """The system asked the process to end."""
    VIEWER_GONE = "viewer gone"
    """Attended, and nobody has looked for too long: the window froze, was closed or was killed."""
    PARENT_GONE = "parent gone"
    """The program that started the engine has ended."""
    PROGRAM = "program left"
    """The program that carried the run out went away from it."""
    LIMIT = "limit"
    INSTRUMENT = "instrument"
    DISK = "disk"
    FAULT = "fault"
    """Anything else that went wrong."""


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
"""How hard each cause stops. Where nothing can be read any more (instrument, disk, fault), what still answers
is lowered as fast as it takes commands before its output goes off."""


@dataclass(frozen=True)
class StopRequest:
    """A wish to end, and who has it."""

    cause: Cause
    level: StopLevel
    reason: str

    @classmethod
    def by(cls, cause: Cause, reason: str) -> "StopRequest":
        """Stop as hard as the cause asks for."""
        return cls(cause, LEVELS[cause], reason)


class StopSwitch:
    """What anybody may use to hold, to mark or to end a run, or a campaign: any thread, and signal handlers.

    It takes no lock, so that a signal handler cannot wait for one. A stop cannot be taken back, only
    be made harder.
    """

    def __init__(self) -> None:
        self._asked: dict[StopLevel, StopRequest] = {}
        self._holding = False
        self._marks: deque[str] = deque()
        self._changes: deque[str] = deque()

    @property
    def request(self) -> StopRequest | None:
        """The hardest stop asked for so far; None while nobody has asked."""
        # One slot a level: two threads that ask at once cannot lose the harder wish.
        for level in reversed(StopLevel):
            if level in self._asked:
                return self._asked[level]
        return None

    @property
    def is_holding(self) -> bool:
        """Whether the run should stay where it is; a stop ends a hold."""
        return self._holding and not self._asked

    def ask(self, request: StopRequest) -> None:
        """Ask for a stop; the first of each level is the one that counts."""
        if request.level is StopLevel.HOLD:
            self.hold()
        else:
            self._asked.setdefault(request.level, request)

    def hold(self) -> None:
        """Stay as it is."""
        self._holding = True

    def resume(self) -> None:
        """Go on after a hold."""
        self._holding = False

    def mark(self, text: str) -> None:
        """Note an event at the next sample that is recorded."""
        self._marks.append(text)

    def take_marks(self) -> Iterator[str]:
        """Yield each mark once, oldest first."""
        while self._marks:
            yield self._marks.popleft()

    def tell_change(self, text: str) -> None:
        """Note that the specimen has changed; a run whose plan asks for it ends then."""
        self._changes.append(text)

    def take_changes(self) -> Iterator[str]:
        """Yield each change once, oldest first."""
        while self._changes:
            yield self._changes.popleft()

    def harder_than(self, level: StopLevel) -> StopRequest | None:
        """Return a request that is harder than ``level``, if there is one."""
        request = self.request
        return request if request is not None and request.level.is_harder_than(level) else None


class DrivesOn:
    """Drives that have started and are not yet confirmed as off."""

    def __init__(self) -> None:
        self._drives: set[object] = set()
        self._has_advanced = False

    def __bool__(self) -> bool:
        """Whether any drive may be on."""
        return bool(self._drives)

    def begin(self, drive: object) -> None:
        """Note that a drive may be on. The output was read back as off before, whatever was unconfirmed."""
        self._drives = {drive}

    def confirm_silence(self, drive: object) -> None:
        """Note that its output was read back as off. Legal at any time."""
        self._drives.discard(drive)

    def note_advance(self) -> None:
        """Note that the run of a drive goes on, or ramps down."""
        self._has_advanced = True

    def take_advance(self) -> bool:
        """Return whether a run has gone on since the last call."""
        advanced, self._has_advanced = self._has_advanced, False
        return advanced


DRIVES_ON = DrivesOn()
"""Of this process."""


RESERVE_BYTES = 16_000_000
"""Commands of a generator take some kB; the rest is what other threads may take meanwhile."""


class MemoryReserve:
    """Reserved address space."""

    def __init__(self) -> None:
        self._held: mmap.mmap | None = None
        self._changing = Lock()

    def hold(self) -> None:
        """Reserve it before anything drives. Raises AcquisitionError when memory is too short."""
        with self._changing:
            if self._held is None:
                try:
                    self._held = mmap.mmap(-1, RESERVE_BYTES)
                except (OSError, MemoryError) as error:
                    raise AcquisitionError(
                        f"this process can get no more memory ({error}), and needs {RESERVE_BYTES / 1e6:g} "
                        "MB to be sure of silencing the drive. Nothing was played; close other programs, or "
                        "raise its limit (ulimit -v)"
                    ) from error

    def release(self) -> None:
        """Release the reserve. Legal at any time."""
        held, self._held = self._held, None
        if held is not None:
            held.close()

    @contextmanager
    def released_when_short(self) -> Iterator[None]:
        """Release the reserve at a MemoryError inside, and re-raise it."""
        try:
            yield
        except MemoryError:
            self.release()
            raise


MEMORY_RESERVE = MemoryReserve()
"""Of this process."""
