"""Run the Windows implementation on Linux, without the functions of Python missing on Windows.

    python -m tests.windows_here measure campaign.toml --out recordings

runs a command of vibench, and

    pytest -p tests.windows_here -o timeout_method=thread tests/acquisition/recording

runs the tests of a package. Libraries (HDF5, Qt), Python's own modules and programs started by a test still
use the real system. Their locks are of another kind; neither side sees the other's locks (`sees_locks`).
"""

import errno
import fcntl
import importlib.util
import os
import signal
import struct
import sys
from pathlib import Path
from types import ModuleType

import pytest

import vibench.sim

POSIX_ONLY = (
    "pwrite", "pread", "pwritev", "preadv", "nice", "fdatasync", "posix_fallocate", "posix_fadvise", "sync",
    "getuid", "geteuid", "getgid", "getegid", "setsid", "setpgid", "getpgid", "getpriority", "setpriority",
    "sched_getaffinity", "sched_setaffinity", "mkfifo", "mknod", "chown", "lchown", "fchown", "wait", "wait3",
    "killpg", "ctermid", "forkpty", "openpty", "fork",
)  # fmt: skip
POSIX_MODULES = ("resource", "pwd", "grp", "termios", "tty", "pty", "syslog", "readline")
POSIX_SIGNALS = ("SIGHUP", "SIGALRM", "SIGUSR1", "SIGUSR2", "SIGQUIT", "setitimer", "alarm", "pause")


def locking(descriptor: int, mode: int, count: int) -> None:
    """Lock bytes from the current file position on, for this descriptor only, as Windows does."""
    place = os.lseek(descriptor, 0, os.SEEK_CUR)
    is_readable_only = fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY
    kind = fcntl.F_RDLCK if is_readable_only else fcntl.F_WRLCK
    try:
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", kind, os.SEEK_SET, place, count, 0))
    except OSError as error:
        raise PermissionError(errno.EACCES, "Permission denied") from error


def windows() -> ModuleType:
    """Load the Windows implementation."""
    runtime = ModuleType("msvcrt")
    runtime.locking, runtime.LK_NBLCK = locking, 2
    sys.modules["msvcrt"] = runtime
    os.O_BINARY = 0
    place = Path(vibench.sim.__file__).parent / "operating_system" / "windows.py"
    spec = importlib.util.spec_from_file_location("vibench.sim.operating_system.windows", place)
    module = importlib.util.module_from_spec(spec)
    here, sys.platform = sys.platform, "win32"
    spec.loader.exec_module(module)
    sys.platform = here
    del sys.modules["msvcrt"]  # Python's own modules would take this system for Windows
    module.LOCK_BYTE = 2**40  # the largest file position of Linux is smaller than that of Windows
    # These two functions call the Windows kernel.
    module.process_start = lambda pid: "1" if Path(f"/proc/{pid}").exists() else None
    module.lower_priority = lambda by: None
    return module


sees_locks = pytest.mark.skipif(
    "sys.platform != 'win32' and not hasattr(os, 'fork')",
    reason="programs that are started here lock as the true system does",
)
"""Mark of tests that look for locks of programs which they start."""


def become_windows() -> None:
    """Replace the POSIX implementation, and remove the functions missing on Windows."""
    sys.modules["vibench.sim.operating_system.posix"] = windows()
    for name in POSIX_ONLY:
        if hasattr(os, name):
            delattr(os, name)
    for name in POSIX_MODULES:
        sys.modules[name] = None
    for name in POSIX_SIGNALS:
        if hasattr(signal, name):
            delattr(signal, name)


@pytest.hookimpl(tryfirst=True)
def pytest_load_initial_conftests() -> None:
    """Start tests with the Windows implementation before a conftest imports the POSIX one."""
    import _pytest.tmpdir

    _pytest.tmpdir.get_user_id = lambda: None
    become_windows()


def main() -> None:
    """Run a command of vibench."""
    become_windows()
    from vibench.cli.__main__ import main as run

    run()


if __name__ == "__main__":
    main()
