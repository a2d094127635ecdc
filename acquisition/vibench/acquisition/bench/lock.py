"""One program at a bench: locks that vanish with the process that holds them, however that ends.

Each instrument has a file in the user's own state folder and one in a folder that all users of the computer
share. Who holds it is written there for the others to read; what counts is the system's lock on the file.
The file stays: if it were removed, two programs could each lock a file of that name.
"""

import os
import re
from collections.abc import Iterator
from getpass import getuser
from hashlib import sha256
from pathlib import Path

from vibench.sim.operating_system.state_folder import shared_folder, state_folder
from vibench.sim.operating_system.this import is_locked_alone, open_for_all, read_at, write_at

from ..errors import InstrumentBusy
from ..rig import Rig

_HOLDER = re.compile(rb"\d{1,10} of [\w.-]{1,32}")
"""Anybody may write into the file, and what it says is shown."""


class BenchLock:
    """Holds the instruments of a rig for this process. What is virtual or played back needs no lock."""

    def __init__(self, descriptors: list[int]) -> None:
        self._descriptors = descriptors

    @classmethod
    def of(cls, rig: Rig) -> "BenchLock":
        """Take the bench, or refuse with who has it.

        Raises
        ------
        InstrumentBusy
            When another process holds one of its instruments, or something else lies in a lock's place.

        """
        lock = cls([])
        if rig.virtual is not None or rig.plays_back:
            return lock
        try:
            for folder in sorted({each.resolve() for each in (state_folder(), shared_folder())}):
                for name in sorted(set(_instruments(rig))):
                    key = sha256(name.encode()).hexdigest()[:16]
                    lock._take(folder / f"vibench-{key}.lock", rig)
        except BaseException:
            lock.close()
            raise
        return lock

    def _take(self, path: Path, rig: Rig) -> None:
        try:
            descriptor = open_for_all(path)
            self._descriptors.append(descriptor)
            is_ours = is_locked_alone(descriptor)
            is_there = os.path.samestat(os.fstat(descriptor), path.stat())
        except OSError as error:
            raise InstrumentBusy(
                f"{rig.name} cannot be marked as in use: {path} is not to be locked ({error}). Nothing was "
                "opened; have it removed, by its owner or as root, when nobody measures"
            ) from error
        if not (is_ours and is_there):
            raise InstrumentBusy(
                f"{rig.name} is in use by process {_holder(descriptor)}. Nothing was opened; end that "
                "program, or let it finish"
            )
        try:
            os.ftruncate(descriptor, 0)
            write_at(descriptor, f"{os.getpid()} of {getuser()}".encode(), 0)
        except (OSError, KeyError, ImportError):  # another user's file, a full disk, a user without a name
            return

    def close(self) -> None:
        """Give the bench back. Legal at any time."""
        while self._descriptors:
            os.close(self._descriptors.pop())


def _instruments(rig: Rig) -> Iterator[str]:
    """Name what can be held, wherever its configuration lies and however that writes it."""
    for resource in (rig.generator.resource, rig.controller.resource if rig.controller else ""):
        if resource:
            yield _plain(resource)
    yield f"{rig.daq.driver} {rig.daq.server} {rig.daq.device}".casefold()


def _plain(resource: str) -> str:
    """Write a VISA name without what may be left out, and its numbers as decimal ones."""
    kind, *others = resource.upper().split("::")
    numbers = [str(int(each, 0)) if re.fullmatch(r"0X[0-9A-F]+", each) else each for each in others]
    return "::".join(
        [re.sub(r"(?<=\D)0$", "", kind), *(each for each in numbers if each not in ("0", "INST0"))]
    )


def _holder(descriptor: int) -> str:
    try:
        found = _HOLDER.match(read_at(descriptor, 64, 0))
    except OSError:
        found = None
    return found[0].decode() if found else "unknown"
