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
    """Level of a stop, from the gentlest to the hardest."""

    HOLD = "hold"
    """Keep the present drive until released or stopped."""
    RAMP = "ramp"
    """The half-cosine ramp at the end of the plan."""
    ABORT = "abort"
    """The shortest ramp without a shock: three periods of the loaded shaker on its suspension."""
    OFF = "off"
    """The output is switched off at once, with a step."""

    def is_harder_than(self, other: "StopLevel") -> bool:
        """Whether this level ends the drive sooner."""
        return _HARDNESS[self] > _HARDNESS[other]


_HARDNESS = {level: number for number, level in enumerate(StopLevel)}


class Cause(StrEnum):
    """Cause of a stop."""

    OPERATOR = "operator"
    """Somebody pressed stop."""
    EMERGENCY = "emergency key"
    """Esc, or the large button."""
    KEYBOARD = "ctrl-c"
    TERMINATED = "terminated"
    """The system ended the process."""
    VIEWER_GONE = "viewer gone"
    """No request for too long in an attended run: the window froze, was closed or was killed."""
    PARENT_GONE = "parent gone"
    """The program that started the engine has ended."""
    PROGRAM = "program left"
    """The program that carried out the run left it."""
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
"""Level of each cause. Where nothing can be read any more (instrument, disk, fault), instruments that still
answer are lowered as fast as they accept commands before their output is switched off.
"""


@dataclass(frozen=True)
class StopRequest:
    """A request to end a run, with its cause."""

    cause: Cause
    level: StopLevel
    reason: str

    @classmethod
    def by(cls, cause: Cause, reason: str) -> "StopRequest":
        """Return a request with the level of its cause."""
        return cls(cause, LEVELS[cause], reason)


class StopSwitch:
    """Switch by which any thread or signal handler can hold, mark or end a run or a campaign.

    It takes no lock, so that a signal handler cannot wait for one. A stop cannot be withdrawn, only replaced
    by a harder one.
    """

    def __init__(self) -> None:
        self._requests: dict[StopLevel, StopRequest] = {}
        self._holding = False
        self._marks: deque[str] = deque()
        self._changes: deque[str] = deque()

    @property
    def request(self) -> StopRequest | None:
        """The hardest stop requested so far; None without one."""
        # One slot for each level: two threads at the same time cannot lose the harder request.
        for level in reversed(StopLevel):
            if level in self._requests:
                return self._requests[level]
        return None

    @property
    def is_holding(self) -> bool:
        """Whether the run is held; a stop ends a hold."""
        return self._holding and not self._requests

    def ask(self, request: StopRequest) -> None:
        """Request a stop; the first of each level counts."""
        if request.level is StopLevel.HOLD:
            self.hold()
        else:
            self._requests.setdefault(request.level, request)

    def hold(self) -> None:
        """Hold the run."""
        self._holding = True

    def resume(self) -> None:
        """End a hold."""
        self._holding = False

    def mark(self, text: str) -> None:
        """Note an event at the next recorded sample."""
        self._marks.append(text)

    def take_marks(self) -> Iterator[str]:
        """Yield each mark once, oldest first."""
        while self._marks:
            yield self._marks.popleft()

    def tell_change(self, text: str) -> None:
        """Report that the specimen has changed; a run with ``on_changed_specimen = "stop"`` then ends."""
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
        return bool(self._drives)

    def begin(self, drive: object) -> None:
        """Note that a drive may be on, and forget earlier drives that were not confirmed as off."""
        self._drives = {drive}

    def confirm_silence(self, drive: object) -> None:
        """Note that the output of a drive was read back as off. Legal at any time."""
        self._drives.discard(drive)

    def note_advance(self) -> None:
        """Note that the run of a drive continues, or ramps down."""
        self._has_advanced = True

    def take_advance(self) -> bool:
        """Return whether a run has continued since the last call."""
        advanced, self._has_advanced = self._has_advanced, False
        return advanced


DRIVES_ON = DrivesOn()
"""Drives of this process that may be on."""


RESERVE_BYTES = 16_000_000
"""Memory reserve. Generator commands take some kB; other threads may use the rest meanwhile."""


class MemoryReserve:
    """Reserved address space, released so that a drive can be silenced when memory is exhausted."""

    def __init__(self) -> None:
        self._held: mmap.mmap | None = None
        self._changing = Lock()

    def hold(self) -> None:
        """Reserve memory before any drive. Raises AcquisitionError when memory is too short."""
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
"""Reserved memory of this process."""
