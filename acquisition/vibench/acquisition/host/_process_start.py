"""Whether a process lives: its number alone does not say, since numbers are given again.

Windows is written from the documentation and has not been tried.
"""

import os
import subprocess
import sys
from pathlib import Path

if sys.platform == "win32":
    import ctypes
    from ctypes import wintypes

UNKNOWN = ""
"""The start of a process that lives, where the system does not tell it."""


def process_start(pid: int) -> str | None:
    """Say when a process began, in a form of the system's own; None when there is no such process.

    A process that has ended, and whose end nobody has taken note of yet, is none.
    """
    match sys.platform:
        case "linux":
            return _linux_start(pid)
        case "win32":
            return _windows_start(pid)
        case _:
            return _posix_start(pid)


def is_process(pid: int, start: str) -> bool:
    """Whether the process that began then still lives; with `UNKNOWN`, whether any of that number does."""
    now = process_start(pid)
    return now is not None and (UNKNOWN in (now, start) or now == start)


def _linux_start(pid: int) -> str | None:
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except FileNotFoundError:
        return None if Path("/proc/self/stat").exists() else _posix_start(pid)
    except ProcessLookupError:
        return None
    # The name before the last bracket may hold anything; proc(5) counts the state as 3 and the start as 22.
    state, *others = text.rpartition(")")[2].split()
    return None if state in "ZX" else others[18]


def _posix_start(pid: int) -> str | None:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        return UNKNOWN
    told = subprocess.run(  # noqa: S603 - a number, and a program by its full path
        ["/bin/ps", "-o", "lstart=", "-p", str(pid)],
        capture_output=True,
        text=True,
        check=False,
    )
    return "".join(filter(str.isalnum, told.stdout))


if sys.platform == "win32":

    def _windows_start(pid: int) -> str | None:
        kernel = ctypes.windll.kernel32
        handle = kernel.OpenProcess(0x1000, 0, pid)  # PROCESS_QUERY_LIMITED_INFORMATION
        if not handle:
            return None
        try:
            code = wintypes.DWORD()
            kernel.GetExitCodeProcess(handle, ctypes.byref(code))
            times = [wintypes.FILETIME() for _ in range(4)]
            kernel.GetProcessTimes(handle, *(ctypes.byref(each) for each in times))
        finally:
            kernel.CloseHandle(handle)
        still_active = 259
        began = times[0]
        return f"{began.dwHighDateTime}n{began.dwLowDateTime}" if code.value == still_active else None

else:

    def _windows_start(pid: int) -> str | None:
        raise NotImplementedError
