"""Files by which one program asks another to stop its drive, and the result reported to the sender.

A file ``PID.START.stop-LEVEL`` in the folder of engines stops the process with number PID and start time
START. The program renames the file to ``.taken-LEVEL`` when it obeys, and updates the file's time while it
ramps down. When the generator's output reads back as off, the program renames the file to ``.silent-LEVEL``.
A missing file confirms nothing: somebody may have emptied the folder. This module imports only a small part
of the standard library, so that `vibench stop` starts without delay.
"""

import os
import time
from collections.abc import Callable
from enum import Enum, auto

LONGEST_REASON = 500
TAKEN_S = 1.0
"""Longest time for a program to accept a stop [s]; programs check 20 times per second."""
HEEDED_S = 5.0
"""Longest time without progress until the output is off [s]; a block and a setting take less than 1 s."""
LOOK_S = 0.01
SWITCH_OFF = "The generator may still be driving: switch the amplifier off, reopen the bench (docs/safety.md)"


class Fate(Enum):
    """Result of a stop request."""

    SILENT = auto()
    """The program accepted the stop and confirmed that its output is off."""
    UNCONFIRMED = auto()
    """The program accepted the stop but did not confirm that its output is off."""
    NOT_TAKEN = auto()


def stop_path(folder: str, pid: int | str, start: str, level: str) -> str:
    """Return the path of the stop file for a process and a stop level."""
    return os.path.join(folder, f"{pid}.{start}.stop-{level}")  # noqa: PTH118 - pathlib takes 8 ms to load


def answer_path(stop: str, answer: str) -> str:
    """Return the path of a stop file after the program's ``answer``: ``"taken"`` or ``"silent"``."""
    return f".{answer}-".join(stop.rsplit(".stop-", 1))


def write_stop_file(stop: str, reason: str) -> None:
    """Write a stop file, completely or not at all; raises OSError if the folder cannot be written."""
    coming = f"{stop}-{os.getpid()}-{time.monotonic_ns()}"
    descriptor = os.open(coming, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        os.write(descriptor, reason.encode(errors="replace")[:LONGEST_REASON])
        if hasattr(os, "fchown"):  # root must give the file to the user, whose program updates it
            os.fchown(descriptor, os.stat(os.path.dirname(stop)).st_uid, -1)  # noqa: PTH116, PTH120
    except OSError:  # for example, the disk is full; the file's name is enough for the stop
        pass
    finally:
        os.close(descriptor)
    try:
        os.replace(coming, stop)  # noqa: PTH105 - as above
    except OSError:  # on a network folder, the file may be renamed in spite of an error
        if not os.path.exists(stop):  # noqa: PTH110 - as above
            os.unlink(coming)  # noqa: PTH108 - as above
            raise


def fate_of(stop: str, is_alive: Callable[[], bool] = lambda: True) -> Fate:
    """Wait until the program has obeyed a stop request, or failed to obey; return the result."""
    written_ns, give_up_s = _modified_ns(stop) or 0, time.monotonic() + TAKEN_S
    while _modified_ns(stop) is not None:
        if time.monotonic() > give_up_s:
            return Fate.NOT_TAKEN
        time.sleep(LOOK_S)
    taken, silent, seen_ns = answer_path(stop, "taken"), answer_path(stop, "silent"), 0
    give_up_s = time.monotonic() + HEEDED_S
    # Ignore a confirmation that is older than this stop.
    while (_modified_ns(silent) or -1) < written_ns:
        if (changed_ns := _modified_ns(taken) or seen_ns) != seen_ns:
            seen_ns, give_up_s = changed_ns, time.monotonic() + HEEDED_S
        if time.monotonic() > give_up_s or not is_alive():
            return Fate.SILENT if (_modified_ns(silent) or -1) >= written_ns else Fate.UNCONFIRMED
        time.sleep(LOOK_S)
    return Fate.SILENT


def _modified_ns(path: str) -> int | None:
    try:
        return os.stat(path).st_mtime_ns  # noqa: PTH116 - as above
    except FileNotFoundError:
        return None
