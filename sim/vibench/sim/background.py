"""Jobs in other processes, with progress reports, partial results and cancellation.

A job is a function call in a spawned process of low priority. The process ends when the parent process ends,
even if the parent is killed.
"""

import math
import os
import pickle
import signal
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from queue import Empty, Queue
from threading import Event, Thread
from time import monotonic
from typing import Any, ParamSpec, TypeVar

from .operating_system.this import bound_memory, lower_priority, use_one_heap

NICE = 10
MOST_BYTES = 6 << 30
"""Memory limit of a worker process [bytes], if the operating system supports such limits."""
MOST_WAITING = 200
"""Number of unread messages at which a worker waits until `Pool.poll` reads them."""
GRACE_S = 2.0
"""Time allowed for a cancelled job to end, before its process is killed [s]."""


@dataclass(frozen=True)
class Progress:
    """Progress report of a job: finished and total work, remaining time, and a note."""

    done: int
    of: int
    """Total amount of work of the job, in the unit of ``done``; 0 if unknown."""
    remaining_s: float | None = None
    """Expected remaining time of the job [s]; None if unknown."""
    note: str = ""


Observer = Callable[[Progress], None]
"""Function that receives progress reports; called in the thread that does the work."""
Cancelled = Callable[[], bool]
"""Function that returns True if a job should end early; called by the job several times per second."""


def ignore_progress(progress: Progress) -> None:
    """Ignore a progress report; default for callers that show no progress."""


def stage(observer: Observer, note: str) -> Callable[[int, int], None]:
    """Report the start of a stage; return a function that reports the stage's finished and total work."""
    observer(Progress(0, 0, note=note))
    return lambda done, of: observer(Progress(done, of, note=note))


Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")
Part = TypeVar("Part")
Question = TypeVar("Question")


def ignore(*_: object) -> None:
    """Ignore an answer or an error."""


@dataclass(eq=False)
class Job:
    """Function call for another process, with the callbacks that receive the messages of the call."""

    work: Callable[..., Any]
    on_part: Callable[[Any], None]
    on_answer: Callable[[Any], None]
    on_error: Callable[[BaseException], None]
    longest_s: float
    is_wanted: bool = True
    is_answered: bool = False
    """Whether the job's result or error has been delivered to the job's owner."""
    end_s: float = math.inf
    """Value of `monotonic` at which the process is killed if the job is still running [s]."""
    cancel: Callable[[], None] = ignore

    @property
    def is_over(self) -> bool:
        """Whether the job has delivered its result or error, or was dropped."""
        return self.is_answered or not self.is_wanted

    def drop(self) -> None:
        """Cancel the job and ignore all further messages from the job."""
        if not self.is_over:
            self.is_wanted, self.end_s = False, monotonic() + GRACE_S
            self.cancel()


class Pool:
    """Pool of worker processes; the owner of the pool must call `poll` regularly.

    Functions, arguments and results must be picklable. ``on_error`` receives ChildProcessError if the worker
    died, TimeoutError or MemoryError if a limit was exceeded, otherwise the exception of the function.
    """

    def __init__(self, workers: int, longest_s: float = math.inf) -> None:
        self._most, self._longest_s = workers, longest_s
        self._arrived = Event()
        self._waiting: deque[Job] = deque()
        self._is_closed = False
        self.workers: list[Worker] = []

    @property
    def is_busy(self) -> bool:
        """Whether a job is waiting or running."""
        return bool(self._waiting) or any(worker.job is not None for worker in self.workers)

    def prepare(self) -> None:
        """Start all processes before the first job."""
        while len(self.workers) < self._most:
            self.workers.append(Worker(self._arrived))

    def ask(
        self,
        function: Callable[Asked, Answer],
        on_answer: Callable[[Answer], None],
        on_error: Callable[[BaseException], None],
        *args: Asked.args,
        **kwargs: Asked.kwargs,
    ) -> Job:
        """Run ``function`` in a worker for at most ``longest_s``; then call ``on_answer`` or ``on_error``."""
        work = partial(_without_parts, partial(function, *args, **kwargs))
        return self.begin(Job(work, ignore, on_answer, on_error, self._longest_s))

    def stream(
        self,
        function: Callable[[Question, Callable[[Part], None], Cancelled], None],
        on_part: Callable[[Part], None],
        on_end: Callable[[None], None],
        on_error: Callable[[BaseException], None],
        question: Question,
    ) -> Job:
        """Run ``function(question, tell, cancelled)`` in a worker; ``tell`` passes results to ``on_part``."""
        return self.begin(Job(partial(function, question), on_part, on_end, on_error, math.inf))

    def begin(self, job: Job) -> Job:
        """Queue a job to be started when a worker is free; a closed pool drops the job."""
        self._waiting.append(job)
        if self._is_closed:
            job.drop()
        self._hand_out()
        return job

    def poll(self, wait_s: float = 0.0) -> None:
        """Deliver messages, waiting for them at most ``wait_s``; end jobs that exceed their time limit."""
        self._arrived.wait(wait_s)
        self._arrived.clear()
        for worker in tuple(self.workers):
            self._take(worker)
            if worker.job is not None and monotonic() > worker.job.end_s:
                reason = f"the job took more than {worker.job.longest_s / 60:.0f} minutes and was stopped"
                self._drop_worker(worker, TimeoutError(reason))
        self._hand_out()

    def close(self) -> None:
        """Drop all unfinished jobs and kill all worker processes."""
        self._is_closed = True
        for job in (*self._waiting, *(worker.job for worker in self.workers)):
            if job is not None:
                job.drop()
        self._waiting.clear()
        while self.workers:
            self.workers.pop().end()

    def _hand_out(self) -> None:
        while self._waiting:
            free = next((worker for worker in self.workers if worker.job is None), None)
            if self._waiting[0].is_over:
                self._waiting.popleft()
            elif free is not None:
                free.begin(self._waiting.popleft())
            elif len(self.workers) < self._most:
                self.workers.append(Worker(self._arrived))
            else:
                return

    def _take(self, worker: "Worker") -> None:
        with suppress(Empty):
            for _ in range(MOST_WAITING):
                kind, value = worker.messages.get_nowait()
                job = worker.job
                if kind == "end":
                    self._drop_worker(worker, value)
                    return
                if kind != "part":
                    worker.job = None
                if job is not None:
                    _call_back(job, kind, value)

    def _drop_worker(self, worker: "Worker", error: BaseException) -> None:
        if worker in self.workers:  # unless a callback has closed the pool
            self.workers.remove(worker)
            worker.end()
            if worker.job is not None:
                _call_back(worker.job, "error", error)


def _without_parts(work: Callable[[], Answer], _tell: object, _cancelled: object) -> Answer:
    return work()


def _call_back(job: Job, kind: str, value: Any) -> None:
    if not job.is_wanted:
        return
    job.is_answered = kind != "part"
    match kind, value:
        case "part", _:
            job.on_part(value)
        case "answer", _:
            job.on_answer(value)
        case _, MemoryError():
            job.on_error(MemoryError(f"it needs more than {MOST_BYTES >> 30} GB of memory; request less"))
        case _:
            job.on_error(value)


class Worker:
    """Worker process, the worker's current job, and the thread that receives the worker's messages here."""

    def __init__(self, arrived: Event) -> None:
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), name="background", daemon=True)
        self.process.start()
        theirs.close()
        self.job: Job | None = None
        self.messages: Queue[tuple[str, Any]] = Queue(MOST_WAITING)
        self._is_ended = False
        self._arrived = arrived
        self._thread = Thread(target=self._receive, name="background answers", daemon=True)
        self._thread.start()

    def begin(self, job: Job) -> None:
        """Start a job in this worker, which must be idle."""
        self._send(job.work)
        self.job = job
        job.end_s = monotonic() + job.longest_s
        job.cancel = partial(self._send, None)

    def end(self) -> None:
        """Kill the worker process and end the receiving thread."""
        self._is_ended = True
        self.process.kill()
        with suppress(Empty):
            while True:  # empty the queue: a full queue blocks the thread
                self.messages.get_nowait()
        self._thread.join()
        self.process.join()
        self._connection.close()

    def _send(self, order: Callable[..., Any] | None) -> None:
        with suppress(OSError):  # the process has ended, as the receiving thread reports
            self._connection.send(order)

    def _receive(self) -> None:
        try:
            with suppress(EOFError, OSError):
                while not self._is_ended:
                    self.messages.put(self._connection.recv())
                    self._arrived.set()
        finally:
            reason = "the process of this job has ended: it was killed, or memory ran out"
            self.messages.put(("end", ChildProcessError(reason)))
            self._arrived.set()


def _serve(connection: Any) -> None:
    """Run jobs in a worker process until the parent process closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C
    with suppress(OSError):
        lower_priority(NICE)
    bound_memory(MOST_BYTES)
    use_one_heap()
    executor, dropped = ThreadPoolExecutor(1), Event()
    with suppress(EOFError, OSError):
        while True:
            work = connection.recv()
            if work is None:
                dropped.set()
                continue
            dropped = Event()
            done = executor.submit(_pack_answer, work, partial(_send_part, connection), dropped.is_set)
            done.add_done_callback(partial(_send_answer, connection))
    os._exit(0)  # the parent process has ended


def _send_part(connection: Any, part: object) -> None:
    connection.send(("part", part))


def _pack_answer(work: Callable[..., Any], *asker: Callable[..., Any]) -> bytes:
    return pickle.dumps(("answer", work(*asker)))


def _send_answer(connection: Any, done: Future[bytes]) -> None:
    error = done.exception()
    with suppress(OSError):  # the parent process has ended
        if error is None:
            connection.send_bytes(done.result())
        else:
            connection.send(("error", error))
