"""Linux and macOS."""

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

assert sys.platform != "win32"  # told to a type checker


def open_to_write(path: Path) -> int:
    """Open an existing file; the descriptor comes back."""
    return os.open(path, os.O_RDWR)


def open_for_all(path: Path) -> int:
    """Open a file that programs of all users lock, made if need be; the descriptor comes back.

    Raises OSError where somebody has put something else in its place: a link, a second name, a pipe.
    """
    flags = os.O_NOFOLLOW | os.O_NONBLOCK
    try:
        descriptor = os.open(path, os.O_RDWR | flags)
    except PermissionError:  # what may be read can be locked
        descriptor = os.open(path, os.O_RDONLY | flags)
    except FileNotFoundError:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | flags, 0o666)
        except FileExistsError:  # by now
            return open_for_all(path)
        # The sticky bit of a file keeps it from those who tidy up (systemd-tmpfiles, XDG base directories).
        for mode in (0o666, 0o1666):
            with suppress(OSError):
                os.fchmod(descriptor, mode)
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1:
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it is not a separate regular file", str(path))
    return descriptor


def write_at(descriptor: int, data: bytes | memoryview, offset: int) -> int:
    """Write bytes at a place; tells how many were written."""
    return os.pwrite(descriptor, data, offset)


def read_at(descriptor: int, size: int, offset: int) -> bytes:
    """Read bytes at a place; fewer at the end of the file."""
    return os.pread(descriptor, size, offset)


def sync_data(descriptor: int) -> None:
    """Push what was written, and what is needed to find it, to the disk."""
    getattr(os, "fdatasync", os.fsync)(descriptor)


def sync_folder(folder: Path) -> None:
    """Push the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def allocate(descriptor: int, offset: int, size: int) -> None:
    """Let the system give blocks to a range of a file, where it can."""
    if sys.platform == "linux":
        try:
            os.posix_fallocate(descriptor, offset, size)
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                raise


def lock_in_use(descriptor: int) -> None:
    """Mark a file as used while it is open; others may read. Raises OSError where one has it alone."""
    fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)


def lock_sole_writer(descriptor: int) -> None:
    """Mark a file as written by this process alone; others may read. Raises OSError where one writes it.

    First the lock alone, then a shared one, under which h5py opens the file to read. Between the two another
    process may slip in; then the second step is refused.
    """
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    lock_in_use(descriptor)


def is_locked_alone(descriptor: int) -> bool:
    """Take a file for this process alone, for as long as it is open; False where another uses it."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def lower_priority(by: int) -> None:
    """Let other processes have the processor first."""
    os.nice(by)


def bound_memory(most_bytes: int) -> None:
    """Let this process have no more memory than that, where the system counts it."""
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    bound = most_bytes if most == resource.RLIM_INFINITY else min(most, most_bytes)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, most))


def usual_state_folder() -> Path:
    """Return the place for what a user's programs leave behind."""
    home = Path.home()
    linux = Path(os.environ.get("XDG_STATE_HOME", home / ".local" / "state"))
    return (home / "Library" / "Application Support" if sys.platform == "darwin" else linux) / "vibench"


def usual_shared_folder() -> Path:
    """Return a place where every user may make files and nobody removes those of others."""
    return Path("/tmp")  # noqa: S108 - TMPDIR may be each user's own


def process_start(pid: int) -> str | None:
    """Return when a process began, in a form of the system's own; None when there is no such process.

    A process that has ended, and whose end nobody has taken note of yet, is none. Empty where it lives and
    nobody tells since when. On Linux the computer's start and the container come first (`Place`).
    """
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except FileNotFoundError:
        return None if Path("/proc/self/stat").exists() else _start_by_ps(pid)
    except ProcessLookupError:
        return None
    # The name before the last bracket may hold anything; proc(5) counts the state as 3 and the start as 22.
    state, *others = text.rpartition(")")[2].split()
    return None if state in "ZX" else f"{_here()}_{others[18]}"


@cache
def _here() -> str:
    """Say within what a process's number is its own: this start of this computer, and the container."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")[:8]
        return f"{boot}_{Path('/proc/self/ns/pid').stat().st_ino}"
    except OSError:  # a system call that a sandbox does not give
        return "unknown"


def _start_by_ps(pid: int) -> str | None:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        return ""
    told = subprocess.run(  # noqa: S603 - a number, and a program by its full path
        ["/bin/ps", "-o", "lstart=", "-p", str(pid)],
        capture_output=True,
        text=True,
        check=False,
    )
    return "".join(filter(str.isalnum, told.stdout))
