"""Windows: it locks bytes of a file rather than files, and pushes names in a folder to the disk itself."""

import ctypes
import msvcrt
import os
import sys
from ctypes import wintypes
from pathlib import Path

assert sys.platform == "win32"  # told to a type checker

LOCK_BYTE = 2**62
"""Locked byte, beyond the end of every file."""
_QUERY_LIMITED_INFORMATION = 0x1000
_BELOW_NORMAL = 0x4000
_STILL_ACTIVE = 259


def open_to_write(path: Path) -> int:
    """Open an existing file; the descriptor comes back."""
    return os.open(path, os.O_RDWR | os.O_BINARY)


def open_for_all(path: Path) -> int:
    """Open a file that programs of all users lock, made if need be; the descriptor comes back."""
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_BINARY, 0o666)
    except PermissionError:  # another user's: what may be read can be locked
        return os.open(path, os.O_RDONLY | os.O_BINARY)


def write_at(descriptor: int, data: bytes | memoryview, offset: int) -> int:
    """Write bytes at a place; tells how many were written."""
    os.lseek(descriptor, offset, os.SEEK_SET)
    return os.write(descriptor, data)


def read_at(descriptor: int, size: int, offset: int) -> bytes:
    """Read bytes at a place; fewer at the end of the file."""
    os.lseek(descriptor, offset, os.SEEK_SET)
    return os.read(descriptor, size)


def sync_data(descriptor: int) -> None:
    """Push what was written, and what is needed to find it, to the disk."""
    os.fsync(descriptor)


def sync_folder(folder: Path) -> None:
    """Do nothing: the system does it."""


def allocate(descriptor: int, offset: int, size: int) -> None:
    """Do nothing: NTFS has allocated the file when its length was set."""


def lock_in_use(descriptor: int) -> None:
    """Mark a file as used for as long as it is open; others may read. Raises OSError where one has it."""
    os.lseek(descriptor, LOCK_BYTE, os.SEEK_SET)
    msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)


def lock_sole_writer(descriptor: int) -> None:
    """Mark a file as written by this process alone; others may read. Raises OSError where one writes it."""
    lock_in_use(descriptor)


def is_locked_alone(descriptor: int) -> bool:
    """Take a file for this process alone, for as long as it is open; False where another uses it."""
    try:
        lock_in_use(descriptor)
    except OSError:
        return False
    return True


def lower_priority(by: int) -> None:  # noqa: ARG001 - there are classes of priority, and no numbers
    """Let other processes have the processor first."""
    kernel = ctypes.windll.kernel32
    kernel.SetPriorityClass(kernel.GetCurrentProcess(), _BELOW_NORMAL)


def bound_memory(most_bytes: int) -> None:
    """Do nothing: only a job object could, and a process cannot leave one."""


def usual_state_folder() -> Path:
    """Return the place for what a user's programs leave behind."""
    return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "vibench"


def usual_shared_folder() -> Path:
    """Return a place where every user may make files and nobody removes those of others."""
    return Path(os.environ.get("PROGRAMDATA", "C:\\ProgramData"))


def process_start(pid: int) -> str | None:
    """Return when a process began, in a form of the system's own; None when there is no such process."""
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
