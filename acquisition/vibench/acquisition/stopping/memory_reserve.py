"""Memory reserved for silencing the drive: it is released when memory is exhausted."""

import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

from ..errors import AcquisitionError

RESERVE_BYTES = 16_000_000
"""Commands of a generator take some kB; the rest is what other threads may take meanwhile."""


class MemoryReserve:
    """Reserved address space."""

    def __init__(self) -> None:
        self._held: mmap.mmap | None = None
        self._changing = Lock()

    def hold(self) -> None:
        """Reserve it before anything drives. Raises AcquisitionError when memory is too short."""
        with self._changing:
            if self._held is None:
                try:
                    self._held = mmap.mmap(-1, RESERVE_BYTES)
                except (OSError, MemoryError) as error:
                    raise AcquisitionError(
                        f"this process can get no more memory ({error}), and needs {RESERVE_BYTES / 1e6:g} "
                        "MB to be sure of silencing the drive. Nothing was played; close other programs, or "
                        "raise its limit (ulimit -v)"
                    ) from error

    def release(self) -> None:
        """Release the reserve. Legal at any time."""
        held, self._held = self._held, None
        if held is not None:
            held.close()

    @contextmanager
    def released_when_short(self) -> Iterator[None]:
        """Release the reserve at a MemoryError inside, and re-raise it."""
        try:
            yield
        except MemoryError:
            self.release()
            raise


MEMORY_RESERVE = MemoryReserve()
"""Of this process."""
