"""Functions for Linux and macOS."""

import ctypes
import errno
import fcntl
import os
import resource
import stat
import subprocess
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

assert sys.platform != "win32"  # on Windows, the type checker skips this module

_ARENA_MAX = -8
"""Option M_ARENA_MAX of mallopt(3)."""


def open_to_write(path: Path) -> int:
    """Return the descriptor of an existing file, opened for writing."""
    return os.open(path, os.O_RDWR)


def open_for_all(path: Path) -> int:
    """Open a lock file for all users, or create it if missing; return its descriptor.

    Raises OSError unless the path is a regular file with one name; a link or a pipe is refused.
    """
    flags = os.O_NOFOLLOW | os.O_NONBLOCK
    try:
        descriptor = os.open(path, os.O_RDWR | flags)
    except PermissionError:  # a file open for reading can be locked too
        descriptor = os.open(path, os.O_RDONLY | flags)
    except FileNotFoundError:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | flags, 0o666)
        except FileExistsError:  # another process has created the file since
            return open_for_all(path)
        # The sticky bit protects a file from automatic deletion (systemd-tmpfiles, XDG base directories).
        for mode in (0o666, 0o1666):
            with suppress(OSError):
                os.fchmod(descriptor, mode)
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1:
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it is not a separate regular file", str(path))
    return descriptor


def write_at(descriptor: int, data: bytes | memoryview, offset: int) -> int:
    """Write bytes at an offset; return the number of bytes written."""
    return os.pwrite(descriptor, data, offset)


def read_at(descriptor: int, size: int, offset: int) -> bytes:
    """Return up to ``size`` bytes at an offset; the result is shorter at the end of the file."""
    return os.pread(descriptor, size, offset)


def sync_data(descriptor: int) -> None:
    """Flush written data, and the metadata needed to read them, to the disk."""
    getattr(os, "fdatasync", os.fsync)(descriptor)


def sync_folder(folder: Path) -> None:
    """Flush the file names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def allocate(descriptor: int, offset: int, size: int) -> None:
    """Allocate disk blocks for a range of a file, if the operating system can."""
    if sys.platform == "linux":
        try:
            os.posix_fallocate(descriptor, offset, size)
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                raise


def lock_in_use(descriptor: int) -> None:
    """Lock an open file for shared use. Raises OSError if another process has locked it exclusively."""
    fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)


def lock_sole_writer(descriptor: int) -> None:
    """Lock a file as its only writer, while others may read. Raises OSError if another process writes.

    The exclusive lock is then replaced by a shared one, so that h5py can open the file for reading. Replacing
    the lock fails if another process locks the file in between.
    """
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    lock_in_use(descriptor)


def is_locked_alone(descriptor: int) -> bool:
    """Lock an open file exclusively; return False if another process uses it."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def lower_priority(by: int) -> None:
    """Lower the priority of this process."""
    os.nice(by)


def use_one_heap() -> None:
    """Let glibc serve all threads from one heap: each other heap keeps up to 64 MB of freed memory."""
    if hasattr(library := ctypes.CDLL(None), "mallopt"):
        library.mallopt(_ARENA_MAX, 1)


def bound_memory(most_bytes: int) -> None:
    """Limit the memory of this process, where the operating system supports limits."""
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    bound = most_bytes if most == resource.RLIM_INFINITY else min(most, most_bytes)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, most))


def usual_state_folder() -> Path:
    """Return vibench's folder inside the operating system's folder for user-specific program state."""
    home = Path.home()
    linux = home / ".local" / "state" / os.environ.get("XDG_STATE_HOME", "")  # never in the current folder
    return (home / "Library" / "Application Support" if sys.platform == "darwin" else linux) / "vibench"


def usual_shared_folder() -> Path:
    """Return a folder in which every user may create files, but not remove files of other users."""
    return Path("/tmp")  # noqa: S108 - TMPDIR may be each user's own


def process_start(pid: int) -> str | None:
    """Return the start time of a process as text; None if no such process is alive.

    A zombie counts as ended. The text is empty if the process is alive but its start time is unknown. On
    Linux, the text begins with identifiers of the boot and the container, which `place_of` reads.
    """
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except FileNotFoundError:
        return None if Path("/proc/self/stat").exists() else _start_by_ps(pid)
    except ProcessLookupError:
        return None
    # Split at the last bracket, because a process name may contain brackets and spaces. In proc(5), the state
    # is field 3, and the start time is field 22.
    state, *others = text.rpartition(")")[2].split()
    return None if state in "ZX" else f"{_here()}_{others[18]}"


@cache
def _here() -> str:
    """Return the identifiers of this boot and container, within which process numbers are unique."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")[:8]
        return f"{boot}_{Path('/proc/self/ns/pid').stat().st_ino}"
    except OSError:  # a sandbox may refuse this
        return "unknown"


def _start_by_ps(pid: int) -> str | None:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        return ""
    result = subprocess.run(  # noqa: S603 - a number, and a program by its full path
        ["/bin/ps", "-o", "lstart=", "-p", str(pid)],
        capture_output=True,
        text=True,
        check=False,
    )
    return "".join(filter(str.isalnum, result.stdout))
