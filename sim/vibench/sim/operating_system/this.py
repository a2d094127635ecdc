"""Functions that differ between operating systems, chosen for the current system."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import Enum, auto
from pathlib import Path

if sys.platform == "win32":
    from . import windows as system
else:
    from . import posix as system

allocate = system.allocate
bound_memory = system.bound_memory
is_locked_alone = system.is_locked_alone
lock_in_use = system.lock_in_use
lock_sole_writer = system.lock_sole_writer
lower_priority = system.lower_priority
open_for_all = system.open_for_all
open_to_write = system.open_to_write
process_start = system.process_start
read_at = system.read_at
sync_data = system.sync_data
sync_folder = system.sync_folder
use_one_heap = system.use_one_heap
usual_shared_folder = system.usual_shared_folder
usual_state_folder = system.usual_state_folder
write_at = system.write_at


Buffer = bytes | memoryview


def write_all(descriptor: int, data: Buffer, offset: int) -> None:
    """Write all bytes at an offset, in several calls if the system writes only part of the bytes."""
    rest = memoryview(data).cast("B")
    while len(rest):
        written = write_at(descriptor, rest, offset)
        rest, offset = rest[written:], offset + written


class OpenFile:
    """Existing file opened for writing; the system releases its locks when the process ends.

    Raises OSError when the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = open_to_write(path)

    def lock_in_use(self) -> None:
        """Lock the file for shared use. Raises OSError if another process has locked it exclusively."""
        lock_in_use(self._descriptor)

    def lock_sole_writer(self) -> None:
        """Lock the file for writing; others may read. Raises OSError if another process writes to it."""
        lock_sole_writer(self._descriptor)

    def is_locked_alone(self) -> bool:
        """Lock the file exclusively; return False if another process uses it."""
        return is_locked_alone(self._descriptor)

    def write(self, offset: int, data: Buffer) -> None:
        """Write ``data`` at ``offset``; only after `sync` are the data certain to be on the disk."""
        write_all(self._descriptor, data, offset)

    def sync(self) -> None:
        """Flush all written data to the disk, so that the data survive a power cut."""
        sync_data(self._descriptor)

    @property
    def has_a_name(self) -> bool:
        """Whether the file still has a name in a folder; False after the file was deleted."""
        return os.fstat(self._descriptor).st_nlink > 0

    def reserve(self, offset: int, size: int) -> None:
        """Allocate disk blocks for a range of the file, if the operating system can."""
        allocate(self._descriptor, offset, size)

    def close(self) -> None:
        """Close the file and release its locks."""
        os.close(self._descriptor)


def sync_file(path: Path) -> None:
    """Flush a closed file and its name to the disk."""
    descriptor = open_to_write(path)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    sync_folder(path.parent)


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """Yield a path for a new file, which finally replaces ``path``; after an error ``path`` is unchanged."""
    target = path.resolve()  # if this is a link, replace its target
    if target.exists():
        target.open("r+b").close()  # raises OSError if the file is write-protected
    coming = target.with_name(f"{target.name}.{os.getpid()}.coming")
    try:
        yield coming
        rename(coming, target)
    except OSError as error:  # name the target in the error, not the temporary file
        error.filename = str(path) if error.filename in (None, str(coming)) else error.filename
        raise
    finally:
        with suppress(OSError):
            coming.unlink()


def rename(unfinished: Path, final: Path) -> None:
    """Rename a file, replacing `final`; ignore a network folder's error if the file was renamed."""
    made = unfinished.stat()
    try:
        os.replace(unfinished, final)  # noqa: PTH105 - used with os.fsync
    except OSError:
        if not final.exists() or not os.path.samestat(made, final.stat()):
            raise


UNKNOWN = ""
"""Text used as a process's start time if the process runs but the system does not report the time."""


class Place(Enum):
    """Place where a process was started; a process number is unique only within one place."""

    HERE = auto()
    CONTAINER = auto()
    """The process was started on this computer since its last boot, but in another container."""
    ELSEWHERE = auto()
    """The process was started on another computer, or on this computer before its last boot."""


def place_of(start: str) -> Place:
    """Return the place where a process was started; `Place.HERE` if the place is unknown."""
    own, other = ((each or "").split("_") for each in (process_start(os.getpid()), start))
    if len(own) != len(other) or own[:-1] == other[:-1]:
        return Place.HERE
    return Place.CONTAINER if own[0] == other[0] else Place.ELSEWHERE


def is_process(pid: int, start: str) -> bool:
    """Return whether a process is alive; if a start time is `UNKNOWN`, compare only the process number."""
    now = process_start(pid)
    return now is not None and (UNKNOWN in (now, start) or now == start)


VARIABLE = "VIBENCH_STATE_DIR"
LOCK_VARIABLE = "VIBENCH_LOCK_DIR"


def state_place() -> Path:
    """Return the path of the user's state folder; ``VIBENCH_STATE_DIR`` overrides this path."""
    given = os.environ.get(VARIABLE)
    return Path(given) if given else usual_state_folder()


def state_folder() -> Path:
    """Return the user's state folder, created if missing; raises PermissionError if that fails."""
    folder = state_place()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:  # for example, a file has the name of the folder
        refused = PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
        refused.add_note(f"{VARIABLE} sets another folder for locks, bench checks, measured run times")
        raise refused from error
    return folder


def shared_folder() -> Path:
    """Return the folder in which every user may create files; ``VIBENCH_LOCK_DIR`` overrides this path."""
    return Path(os.environ.get(LOCK_VARIABLE) or usual_shared_folder())
