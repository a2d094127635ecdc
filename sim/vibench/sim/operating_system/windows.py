"""Functions for Windows, which locks ranges of bytes and flushes a folder's file names by itself."""

import ctypes
import msvcrt
import os
import sys
from ctypes import wintypes
from pathlib import Path

assert sys.platform == "win32"  # on other systems, the type checker skips this module

LOCK_BYTE = 2**62
"""Offset of the locked byte, beyond the end of every file."""
_QUERY_LIMITED_INFORMATION = 0x1000
_BELOW_NORMAL = 0x4000
_STILL_ACTIVE = 259


def open_to_write(path: Path) -> int:
    """Return the descriptor of an existing file, opened for writing."""
    return os.open(path, os.O_RDWR | os.O_BINARY)


def open_for_all(path: Path) -> int:
    """Open a lock file for all users, or create it if missing; return its descriptor."""
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_BINARY, 0o666)
    except PermissionError:  # another user's file can be locked if open for reading
        return os.open(path, os.O_RDONLY | os.O_BINARY)


def write_at(descriptor: int, data: bytes | memoryview, offset: int) -> int:
    """Write bytes at an offset; return the number of bytes written."""
    os.lseek(descriptor, offset, os.SEEK_SET)
    return os.write(descriptor, data)


def read_at(descriptor: int, size: int, offset: int) -> bytes:
    """Return up to ``size`` bytes at an offset; fewer at the end of the file."""
    os.lseek(descriptor, offset, os.SEEK_SET)
    return os.read(descriptor, size)


def sync_data(descriptor: int) -> None:
    """Flush written data, and the metadata needed to read them, to the disk."""
    os.fsync(descriptor)


def sync_folder(folder: Path) -> None:
    """Do nothing, because Windows flushes the file names of a folder itself."""


def allocate(descriptor: int, offset: int, size: int) -> None:
    """Do nothing, because NTFS allocates a file when its length is set."""


def lock_in_use(descriptor: int) -> None:
    """Lock an open file for shared use. Raises OSError if another process has locked it exclusively."""
    os.lseek(descriptor, LOCK_BYTE, os.SEEK_SET)
    msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)


def lock_sole_writer(descriptor: int) -> None:
    """Lock a file as its only writer; others may read. Raises OSError if another process writes."""
    lock_in_use(descriptor)


def is_locked_alone(descriptor: int) -> bool:
    """Lock an open file exclusively; return False if another process uses it."""
    try:
        lock_in_use(descriptor)
    except OSError:
        return False
    return True


def lower_priority(by: int) -> None:  # noqa: ARG001 - Windows has priority classes, not numbers
    """Lower the priority of this process."""
    kernel = ctypes.windll.kernel32
    kernel.SetPriorityClass(kernel.GetCurrentProcess(), _BELOW_NORMAL)


def use_one_heap() -> None:
    """Do nothing: the threads share a heap already."""


def bound_memory(most_bytes: int) -> None:
    """Do nothing: only a job object limits memory, and a process cannot leave a job object."""


def usual_state_folder() -> Path:
    """Return vibench's folder within the system's folder for the state of a user's programs."""
    return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "vibench"


def usual_shared_folder() -> Path:
    """Return a folder in which every user may create files, but not remove files of other users."""
    return Path(os.environ.get("PROGRAMDATA", "C:\\ProgramData"))


def process_start(pid: int) -> str | None:
    """Return the start time of a process as text; None if there is no such process."""
    kernel = ctypes.windll.kernel32
    handle = kernel.OpenProcess(_QUERY_LIMITED_INFORMATION, 0, pid)
    if not handle:
        return None
    try:
        code = wintypes.DWORD()
        kernel.GetExitCodeProcess(handle, ctypes.byref(code))
        times = [wintypes.FILETIME() for _ in range(4)]
        kernel.GetProcessTimes(handle, *(ctypes.byref(each) for each in times))
    finally:
        kernel.CloseHandle(handle)
    began = times[0]
    return f"{began.dwHighDateTime}n{began.dwLowDateTime}" if code.value == _STILL_ACTIVE else None
