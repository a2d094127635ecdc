"""One program at a bench: a lock that vanishes with the process that holds it, however that ends."""

import hashlib
import os
from pathlib import Path

from vibench.sim.operating_system import is_locked_alone, state_folder, write_at

from ..errors import InstrumentBusy
from ..rig import Rig


class BenchLock:
    """Holds the instruments of a rig for this process. A virtual rig is its own process's, and needs none."""

    def __init__(self, descriptor: int | None) -> None:
        self._descriptor = descriptor

    @classmethod
    def of(cls, rig: Rig) -> "BenchLock":
        """Take the bench, or refuse with who has it.

        Raises
        ------
        InstrumentBusy
            When another process holds it.

        """
        if rig.virtual is not None:
            return cls(None)
        path = state_folder() / f"bench-{_key(rig)}.lock"
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        if not is_locked_alone(descriptor):
            holder = _holder(path)
            os.close(descriptor)
            raise InstrumentBusy(
                f"{rig.name} is in use by process {holder}. Nothing was opened; end that program, "
                "or let it finish"
            )
        os.ftruncate(descriptor, 0)
        write_at(descriptor, str(os.getpid()).encode(), 0)
        return cls(descriptor)

    def close(self) -> None:
        """Give the bench back. Legal at any time."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)


def _key(rig: Rig) -> str:
    """Name the instruments, wherever their configuration lies."""
    what = f"{rig.generator.resource}\n{rig.daq.server}\n{rig.daq.device}"
    return hashlib.sha256(what.encode()).hexdigest()[:16]


def _holder(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii", errors="replace") or "unknown"
    except OSError:
        return "unknown"
