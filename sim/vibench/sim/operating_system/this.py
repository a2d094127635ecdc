"""The functions of the system that runs this program."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import Enum, auto
from pathlib import Path

if sys.platform == "win32":
    from .windows import (
        allocate,
        bound_memory,
        is_locked_alone,
        lock_in_use,
        lock_sole_writer,
        lower_priority,
        open_for_all,
        open_to_write,
        process_start,
        read_at,
        sync_data,
        sync_folder,
        usual_shared_folder,
        usual_state_folder,
        write_at,
    )
else:
    from .posix import (
        allocate,
        bound_memory,
        is_locked_alone,
        lock_in_use,
        lock_sole_writer,
        lower_priority,
        open_for_all,
        open_to_write,
        process_start,
        read_at,
        sync_data,
        sync_folder,
        usual_shared_folder,
        usual_state_folder,
        write_at,
    )

__all__ = [
    "allocate",
    "bound_memory",
    "is_locked_alone",
    "lock_in_use",
    "lock_sole_writer",
    "lower_priority",
    "open_for_all",
    "open_to_write",
    "process_start",
    "read_at",
    "rename",
    "sync_data",
    "sync_folder",
    "usual_shared_folder",
    "usual_state_folder",
    "write_at",
]


Buffer = bytes | memoryview


def write_all(descriptor: int, data: Buffer, offset: int) -> None:
    """Write bytes at a place; a short write is continued."""
    rest = memoryview(data).cast("B")
    while len(rest):
        written = write_at(descriptor, rest, offset)
        rest, offset = rest[written:], offset + written


class OpenFile:
    """An existing file, open to be written; its marks vanish with the process, however that ends.

    Raises OSError when it cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = open_to_write(path)

    def lock_in_use(self) -> None:
        """Mark it as used; others may read. Raises OSError where another process has it alone."""
        lock_in_use(self._descriptor)

    def lock_sole_writer(self) -> None:
        """Mark it as written by this process alone; others may read. Raises OSError where one writes it."""
        lock_sole_writer(self._descriptor)

    def is_locked_alone(self) -> bool:
        """Take it for this process alone; False where another uses it."""
        return is_locked_alone(self._descriptor)

    def write(self, offset: int, data: Buffer) -> None:
        """Put ``data`` at ``offset``, in the system's cache at least."""
        write_all(self._descriptor, data, offset)

    def sync(self) -> None:
        """Return when everything written so far would survive a power cut."""
        sync_data(self._descriptor)

    @property
    def has_a_name(self) -> bool:
        """Whether it stands in a folder: what was removed can never be found again."""
        return os.fstat(self._descriptor).st_nlink > 0

    def reserve(self, offset: int, size: int) -> None:
        """Allocate blocks where the system can; elsewhere the check of free space must do."""
        allocate(self._descriptor, offset, size)

    def close(self) -> None:
        """Release the file and its marks."""
        os.close(self._descriptor)


def sync_file(path: Path) -> None:
    """Push a closed file, and its name, to the disk."""
    descriptor = open_to_write(path)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
    sync_folder(path.parent)


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """Yield a name to write to; the file then replaces an older one, which stays if there is an error."""
    target = path.resolve()  # a link stays one
    if target.exists():
        target.open("r+b").close()  # raises OSError where it is write-protected
    coming = target.with_name(f"{target.name}.{os.getpid()}.coming")
    try:
        yield coming
        rename(coming, target)
    except OSError as error:  # one of a write has no name, and nobody knows the other name
        error.filename = str(path) if error.filename in (None, str(coming)) else error.filename
        raise
    finally:
        with suppress(OSError):
            coming.unlink()


def rename(unfinished: Path, final: Path) -> None:
    """Rename a file, replacing `final`; ignore an error of a rename that was made, as on network folders."""
    made = unfinished.stat()
    try:
        os.replace(unfinished, final)  # noqa: PTH105 - the pair of os.fsync
    except OSError:
        if not final.exists() or not os.path.samestat(made, final.stat()):
            raise


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


VARIABLE = "VIBENCH_STATE_DIR"
LOCK_VARIABLE = "VIBENCH_LOCK_DIR"


def state_place() -> Path:
    """Return where the user's own folder is, or would be; ``VIBENCH_STATE_DIR`` names another place."""
    given = os.environ.get(VARIABLE)
    return Path(given) if given else usual_state_folder()


def state_folder() -> Path:
    """Return the user's own folder, made if need be; raises PermissionError where none can be made."""
    folder = state_place()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:  # a file in the way, a disk that makes no folders
        refused = PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
        refused.add_note(f"{VARIABLE} names another folder for locks, bench checks and learnt costs")
        raise refused from error
    return folder


def shared_folder() -> Path:
    """Return the folder where every user may make files; ``VIBENCH_LOCK_DIR`` names another."""
    return Path(os.environ.get(LOCK_VARIABLE) or usual_shared_folder())
