"""Work that takes longer than a frame: done in another process, and asked after by a timer."""

import os
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from time import monotonic
from typing import Any, Generic, ParamSpec, TypeVar

from PySide6.QtCore import QObject, QTimer

from vibench.acquisition import follow_parent
from vibench.sim.operating_system.this import bound_memory, lower_priority

POLL_MS = 50
NICE = 10
BEGUN_EACH = 2
"""Jobs handed to each process: the one that it does, and the next, so that it need not wait for a poll."""
GRACE_S = 2.0
"""A process that works so long on what nobody wants any more is ended, and another takes its place."""
LONGEST_S = 900.0
"""Nothing that a page asks for takes so long; what does is given up."""
MOST_BYTES = 6 << 30
"""Of memory for a process, where the system can bound it."""

Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")


@dataclass(eq=False)
class Job:
    """One piece of work; an answer that nobody wants any more is dropped."""

    work: Callable[[], Any]
    on_answer: Callable[[Any], None]
    on_error: Callable[[BaseException], None]
    is_wanted: bool = True
    future: Future[Any] | None = None
    begun_s: float = 0.0
    """When a process was seen to work on it."""
    """None until it is begun; never cancelled, since a process that dies chokes on that."""

    is_answered: bool = False
    """Whether its answer, or its error, has been handed over."""

    @property
    def is_over(self) -> bool:
        """Whether there is nothing to come: it was answered, or dropped."""
        return self.is_answered or not self.is_wanted

    @property
    def has_ended(self) -> bool:
        """Whether no process works on it, or will: what is done may still have to be handed over."""
        return not self.is_wanted if self.future is None else self.future.done()

    def drop(self) -> None:
        """Want the answer no more; work that has not begun is not done."""
        self.is_wanted = False


def give_way() -> None:
    """Let a measurement, and the window, have the processor first; end with the window, however it ends."""
    follow_parent()
    lower_priority(NICE)
    bound_memory(MOST_BYTES)


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
        for beside in self.findChildren(Background):
            beside.prepare()

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
            return Job(os.getpid, on_answer, on_error, is_wanted=False)
        job = Job(partial(function, *args, **kwargs), on_answer, on_error)
        self._jobs.append(job)
        self._begin()
        self._timer.start()
        return job

    def _begin(self) -> None:
        """Hand over as many jobs as keep the processes busy."""
        begun = sum(job.future is not None for job in self._jobs)
        waiting = [job for job in self._jobs if job.future is None and job.is_wanted]
        for job in waiting[: max(0, BEGUN_EACH * self._workers - begun)]:
            try:
                job.future = self._started().submit(job.work)
            except BrokenProcessPool:  # a process was killed; its jobs are told so, and others do the rest
                self._pool = None
                job.future = self._started().submit(job.work)

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._workers, mp_context=get_context("spawn"), initializer=give_way
            )
        return self._pool

    def close(self) -> None:
        """End the processes, those of its children too; what has not been answered is dropped."""
        for beside in self.findChildren(Background):
            beside.close()
        self._is_closed = True
        self._timer.stop()
        self._jobs.clear()
        self._end_processes()

    def _end_processes(self) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            # It offers no kill; and its thread, left alone, would outlive the pool that it works for.
            processes = list((pool._processes or {}).values())  # noqa: SLF001
            thread: Any = pool._executor_manager_thread  # noqa: SLF001
            answers: Any = pool._result_queue  # noqa: SLF001
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.kill()
            # Or the thread would wait for the rest of an answer that a process was just handing over.
            answers._writer.close()  # noqa: SLF001
            if thread is not None:
                thread.join()

    def _give_up(self) -> None:
        """End processes that work in vain or for ever; what they had still to do is begun again elsewhere."""
        now_s = monotonic()
        working = [job for job in self._jobs if job.future is not None and job.future.running()]
        for job in working:
            job.begun_s = job.begun_s or now_s
        vain = [job for job in working if not job.is_wanted and now_s - job.begun_s > GRACE_S]
        late = [job for job in working if job.is_wanted and now_s - job.begun_s > LONGEST_S]
        if not vain and not late:
            return
        self._jobs = [job for job in self._jobs if job not in vain and job not in late]
        unfinished = [job for job in self._jobs if job.future is not None and not job.future.done()]
        self._end_processes()
        for job in unfinished:
            job.future, job.begun_s = None, 0.0
        for job in late:
            job.is_answered = True
            job.on_error(TimeoutError(f"it took more than {LONGEST_S / 60:.0f} minutes and was given up"))

    def _poll(self) -> None:
        self._give_up()
        over = [job for job in self._jobs if job.has_ended]
        # Not asked again: one may have ended since.
        self._jobs = [job for job in self._jobs if job not in over]
        self._begin()
        if not self._jobs:
            self._timer.stop()
        for job in over:
            if job.future is None or not job.is_wanted:
                continue
            job.is_answered = True
            match job.future.exception():
                case None:
                    job.on_answer(job.future.result())
                case MemoryError():
                    most = f"{MOST_BYTES / (1 << 30):.0f} GB"
                    job.on_error(MemoryError(f"it needs more than {most} of memory; ask for less"))
                case error:
                    job.on_error(error)


Question = TypeVar("Question")


class LatestRequest(QObject, Generic[Question, Answer]):
    """Asks when a question has stood for a moment; never more than one question is out."""

    def __init__(
        self,
        background: Background,
        function: Callable[[Question], Answer],
        on_answer: Callable[[Answer], None],
        on_error: Callable[[BaseException], None],
        wait_ms: int,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._background, self._function = background, function
        self._on_answer, self._on_error = on_answer, on_error
        self._wanted: Question | None = None
        self._job: Job | None = None
        self._timer = QTimer(self, singleShot=True, interval=wait_ms)
        self._timer.timeout.connect(self._ask)

    @property
    def is_busy(self) -> bool:
        """Whether an answer to the newest question is still to come."""
        return self._wanted is not None or self._job is not None

    def ask(self, question: Question) -> None:
        """Ask this, in place of whatever was asked before."""
        self._wanted = question
        self._timer.start()

    def drop(self) -> None:
        """Ask nothing; what is being worked out is not wanted any more."""
        self._wanted = None
        self._timer.stop()
        if self._job is not None:
            self._job.drop()
            self._job = None

    def _ask(self) -> None:
        if self._wanted is None or self._job is not None:
            return
        question, self._wanted = self._wanted, None
        self._job = self._background.ask(self._function, self._answered, self._failed, question)

    def _answered(self, answer: Answer) -> None:
        self._job = None
        if self._wanted is None:
            self._on_answer(answer)
        self._ask()

    def _failed(self, error: BaseException) -> None:
        self._job = None
        if self._wanted is None:
            self._on_error(error)
        self._ask()
