"""Work that takes longer than a frame: done in another process, asked after by a timer."""

import os
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, ParamSpec, TypeVar

from PySide6.QtCore import QObject, QTimer

from acquisition.follow_parent import follow_parent

POLL_MS = 50
NICE = 10

Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")


@dataclass(eq=False)
class Job:
    """One piece of work; an answer that nobody wants any more is dropped."""

    future: Future[Any]
    on_answer: Callable[[Any], None]
    on_error: Callable[[BaseException], None]
    is_wanted: bool = True

    def drop(self) -> None:
        """Want the answer no more; work that has not begun is not done."""
        self.is_wanted = False
        self.future.cancel()


def give_way() -> None:
    """Let a measurement, and the window, have the processor first; end with the window, however it ends."""
    follow_parent()
    if hasattr(os, "nice"):
        os.nice(NICE)


class Background(QObject):
    """Spawned processes without Qt; answers come in the thread of the window.

    Functions and what they take and give must be importable and picklable: they cross processes.
    """

    def __init__(self, workers: int, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._workers = workers
        self._pool: ProcessPoolExecutor | None = None
        self._jobs: list[Job] = []
        self._is_closed = False
        self._timer = QTimer(self)
        self._timer.setInterval(POLL_MS)
        self._timer.timeout.connect(self._poll)

    @property
    def is_busy(self) -> bool:
        """Whether an answer is still to come."""
        return bool(self._jobs)

    def prepare(self) -> None:
        """Start the processes now: to start one costs a moment that no frame of a run has."""
        pool = self._started()
        for _ in range(self._workers):
            pool.submit(os.getpid)

    def ask(
        self,
        function: Callable[Asked, Answer],
        on_answer: Callable[[Answer], None],
        on_error: Callable[[BaseException], None],
        *args: Asked.args,
        **kwargs: Asked.kwargs,
    ) -> Job:
        """Call ``function`` elsewhere; then ``on_answer`` or ``on_error`` here."""
        if self._is_closed:
            # Asked by a timer that outlived the window: nobody is left to be told.
            return Job(Future(), on_answer, on_error, is_wanted=False)
        job = Job(self._started().submit(function, *args, **kwargs), on_answer, on_error)
        self._jobs.append(job)
        self._timer.start()
        return job

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._workers, mp_context=get_context("spawn"), initializer=give_way
            )
        return self._pool

    def close(self) -> None:
        """End the processes; what has not been answered is dropped."""
        self._is_closed = True
        self._timer.stop()
        self._jobs.clear()
        if self._pool is not None:
            processes = list((self._pool._processes or {}).values())  # noqa: SLF001 - it offers no kill
            self._pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.kill()
            self._pool = None

    def _poll(self) -> None:
        ended = [job for job in self._jobs if job.future.done()]
        self._jobs = [job for job in self._jobs if not job.future.done()]
        if not self._jobs:
            self._timer.stop()
        for job in ended:
            if not job.is_wanted or job.future.cancelled():
                continue
            error = job.future.exception()
            if error is None:
                job.on_answer(job.future.result())
            else:
                job.on_error(error)
