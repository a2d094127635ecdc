"""What is asked of an engine, done one after the other by the engine's own thread."""

from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue

from ..errors import AcquisitionError
from ..stopping.stop import Cause
from ._engine import Engine

Job = Callable[[], object]
ENDING_CAUSES = frozenset({Cause.TERMINATED, Cause.KEYBOARD, Cause.PARENT_GONE})
"""After a campaign that one of these has stopped, the process ends too."""


class JobQueue:
    """A queue of jobs for an engine: filled from any thread, emptied by the one that calls `run`."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()

    def put(self, job: Job) -> None:
        """Do this after everything asked before; from any thread."""
        self._jobs.put(job)

    def leave(self) -> None:
        """End after everything asked before; from any thread, and from a signal handler."""
        self._jobs.put(None)

    def run(self) -> None:
        """Do jobs until told to leave. The bench is closed then, whatever happened."""
        try:
            while (job := self._jobs.get()) is not None:
                self._do(job)
        finally:
            with suppress(AcquisitionError):  # the engine has shown it
                self._engine.close()

    def _do(self, job: Job) -> None:
        try:
            job()
        except AcquisitionError:
            pass  # the engine has shown it
        except Exception as error:  # noqa: BLE001 - whatever it is: silence, and an engine that can tell of it
            self._engine.fault(error)
        request = self._engine.switch.request
        if request is not None and request.cause in ENDING_CAUSES:
            self.leave()
