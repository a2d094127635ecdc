"""Stop requests written as files for a program that drives, and how their sender learns the result.

A file ``PID.START.stop-LEVEL`` in the folder of engines is a stop for the process of that number that began
then. The program renames it to ``.taken-LEVEL`` when it obeys, touches it while it ramps down, and removes it
when its output was read back as off. Only the standard library is imported here, and little of it:
`vibench stop` must not wait for anything else.
"""

import os
import time
from collections.abc import Callable
from enum import Enum, auto

LONGEST_REASON = 500
TAKEN_S = 1.0
"""Longest time for a program to accept a stop; it checks twenty times a second [s]."""
HEEDED_S = 5.0
"""Longest time without progress until its output is off; a block and a setting take some tenths [s]."""
LOOK_S = 0.01
SWITCH_OFF = "The generator may still be driving: switch the amplifier off, then open the bench again"


class Fate(Enum):
    """Result of a stop."""

    SILENT = auto()
    """The program accepted it and confirmed that its output is off."""
    UNCONFIRMED = auto()
    """The program accepted it but did not confirm that its output is off."""
    NOT_TAKEN = auto()


def stop_path(folder: str, pid: int | str, start: str, level: str) -> str:
    """Return the path of a stop file."""
    return os.path.join(folder, f"{pid}.{start}.stop-{level}")  # noqa: PTH118 - pathlib takes 8 ms to load


def taken_path(stop: str) -> str:
    """Return the path of a stop file once the stop is obeyed."""
    return ".taken-".join(stop.rsplit(".stop-", 1))


def write_stop_file(stop: str, reason: str) -> None:
    """Write a stop file, completely or not at all; raises OSError when the folder has no room for it."""
    coming = f"{stop}-{os.getpid()}-{time.monotonic_ns()}"
    descriptor = os.open(coming, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    try:
        os.write(descriptor, reason.encode(errors="replace")[:LONGEST_REASON])
    except OSError:  # a full disk: the name says what matters
        pass
    finally:
        os.close(descriptor)
    try:
        os.replace(coming, stop)  # noqa: PTH105 - as above
    except OSError:  # a network folder may report an error of a rename that was made
        if not os.path.exists(stop):  # noqa: PTH110 - as above
            os.unlink(coming)  # noqa: PTH108 - as above
            raise


def fate_of(stop: str, is_alive: Callable[[], bool] = lambda: True) -> Fate:
    """Wait until a program has obeyed a stop, or fails to."""
    give_up_s = time.monotonic() + TAKEN_S
    while _changed_ns(stop) is not None:
        if time.monotonic() > give_up_s:
            return Fate.NOT_TAKEN
        time.sleep(LOOK_S)
    taken, seen_ns = taken_path(stop), 0
    while (changed_ns := _changed_ns(taken)) is not None:
        if changed_ns != seen_ns:
            seen_ns, give_up_s = changed_ns, time.monotonic() + HEEDED_S
        if time.monotonic() > give_up_s or not is_alive():
            return Fate.SILENT if _changed_ns(taken) is None else Fate.UNCONFIRMED
        time.sleep(LOOK_S)
    return Fate.SILENT


def _changed_ns(path: str) -> int | None:
    try:
        return os.stat(path).st_mtime_ns  # noqa: PTH116 - as above
    except FileNotFoundError:
        return None
