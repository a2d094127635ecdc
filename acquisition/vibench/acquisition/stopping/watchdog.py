"""Something that is looked at all the time, beside whatever else a process does."""

from collections.abc import Callable
from logging import getLogger
from threading import Event, Thread

from ..errors import AcquisitionError
from .memory_reserve import MEMORY_RESERVE

INTERVAL_S = 0.05
"""How often it is looked at [s]."""
LEFT_ALONE_S = 1.0


class Watchdog:
    """Calls a function at every `INTERVAL_S`, in a separate thread, until closed.

    Raises AcquisitionError when the system gives no thread.
    """

    def __init__(self, look: Callable[[], None], name: str) -> None:
        self._look = look
        self._closing = Event()
        self._thread = Thread(target=self._run, name=name, daemon=True)
        try:
            self._thread.start()
        except RuntimeError as error:
            raise AcquisitionError(
                f"the system gives this process no more threads ({error}), and the {name} needs one. Nothing "
                "was played; end other programs, or raise the limit (ulimit -u)"
            ) from error

    def close(self) -> None:
        """Stop watching; a look that hangs, in a folder that has gone away, is left alone."""
        self._closing.set()
        self._thread.join(LEFT_ALONE_S)

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                if not self._closing.wait(INTERVAL_S):
                    self._look()
            except MemoryError:  # a record of it would take more
                MEMORY_RESERVE.release()
            except Exception:
                getLogger(__name__).exception("%s", self._thread.name)
