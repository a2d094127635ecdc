"""Work in other processes: how far it is, its answer piece by piece, and its end.

A job is a function with its arguments, called in a spawned process that gives way to all others. The
process ends with the one that asked, however that one ends.
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

from .operating_system.this import bound_memory, lower_priority

NICE = 10
MOST_BYTES = 6 << 30
"""Memory of a process, where the system can bound it."""
MOST_WAITING = 200
"""Messages of a process that wait for a poll before the process itself waits; a poll takes no more."""
GRACE_S = 2.0
"""A process that goes on with a dropped job is ended after this time [s]."""


@dataclass(frozen=True)
class Progress:
    """How far work has come."""

    done: int
    of: int
    """0 where it is not known yet."""
    left_s: float | None = None
    """Expected time until all is done [s]; None where it is not known."""
    note: str = ""


Observer = Callable[[Progress], None]
"""Called with each progress, in the thread that does the work."""
Cancelled = Callable[[], bool]
"""Whether to end early; called several times a second, in the thread that does the work."""


def ignore_progress(progress: Progress) -> None:
    """Observe nothing."""


def stage(observer: Observer, note: str) -> Callable[[int, int], None]:
    """Report that a stage begins; return the function that reports how much is done, and of how much."""
    observer(Progress(0, 0, note=note))
    return lambda done, of: observer(Progress(done, of, note=note))


Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")
Part = TypeVar("Part")
Question = TypeVar("Question")


def _ignore(*_: object) -> None:
    pass


@dataclass(eq=False)
class Job:
    """Work for another process, and whom to call back from `Pool.poll`."""

    work: Callable[..., Any]
    on_part: Callable[[Any], None]
    on_answer: Callable[[Any], None]
    on_error: Callable[[BaseException], None]
    longest_s: float
    is_wanted: bool = True
    is_answered: bool = False
    """Whether the answer or the error was handed over."""
    end_s: float = math.inf
    """When its process is ended, if it still works on it."""
    cancel: Callable[[], None] = _ignore

    @property
    def is_over(self) -> bool:
        """Whether nothing more will come."""
        return self.is_answered or not self.is_wanted

    def drop(self) -> None:
        """Ignore what comes from now on; end the work soon, or do not begin it."""
        if not self.is_over:
            self.is_wanted, self.end_s = False, monotonic() + GRACE_S
            self.cancel()


class Pool:
    """Processes that do jobs; the thread that owns the pool calls `poll` regularly.

    Functions, arguments and answers must be picklable. An error handed over is ChildProcessError when the
    process ended, TimeoutError or MemoryError beyond a bound, else what the function raised.
    """

    def __init__(self, workers: int, longest_s: float = math.inf) -> None:
        self._most, self._longest_s = workers, longest_s
        self._arrived = Event()
        self._waiting: deque[Job] = deque()
        self._is_closed = False
        self.workers: list[Worker] = []

    @property
    def is_busy(self) -> bool:
        """Whether a job is waiting or under way."""
        return bool(self._waiting) or any(worker.job is not None for worker in self.workers)

    def prepare(self) -> None:
        """Start the processes now, for that takes a moment."""
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
        """Call ``function`` elsewhere, for at most ``longest_s``; then ``on_answer`` or ``on_error`` here."""
        work = partial(_without_parts, partial(function, *args, **kwargs))
        return self.begin(Job(work, _ignore, on_answer, on_error, self._longest_s))

    def stream(
        self,
        function: Callable[[Question, Callable[[Part], None], Cancelled], None],
        on_part: Callable[[Part], None],
        on_end: Callable[[None], None],
        on_error: Callable[[BaseException], None],
        question: Question,
    ) -> Job:
        """Call ``function(question, tell, cancelled)`` elsewhere; ``on_part`` here with what it tells."""
        return self.begin(Job(partial(function, question), on_part, on_end, on_error, math.inf))

    def begin(self, job: Job) -> Job:
        """Do a job as soon as a process is free; not at all when the pool was closed."""
        self._waiting.append(job)
        if self._is_closed:
            job.drop()
        self._hand_out()
        return job

    def poll(self, wait_s: float = 0.0) -> None:
        """Call back with what has come, waiting at most ``wait_s`` for it; end what takes too long."""
        self._arrived.wait(wait_s)
        self._arrived.clear()
        for worker in tuple(self.workers):
            self._take(worker)
            if worker.job is not None and monotonic() > worker.job.end_s:
                said = f"it took more than {worker.job.longest_s / 60:.0f} minutes and was given up"
                self._lose(worker, TimeoutError(said))
        self._hand_out()

    def close(self) -> None:
        """End the processes at once; jobs without an answer are dropped."""
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
                    self._lose(worker, value)
                    return
                if kind != "part":
                    worker.job = None
                if job is not None:
                    _call_back(job, kind, value)

    def _lose(self, worker: "Worker", error: BaseException) -> None:
        if worker in self.workers:  # the pool was not closed by a callback
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
            job.on_error(MemoryError(f"it needs more than {MOST_BYTES >> 30} GB of memory; ask for less"))
        case _:
            job.on_error(value)


class Worker:
    """One process, the job that it does, and the thread that receives its messages."""

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
        """Do this job, the only one."""
        self._send(job.work)
        self.job = job
        job.end_s = monotonic() + job.longest_s
        job.cancel = partial(self._send, None)

    def end(self) -> None:
        """End the process at once, and the thread."""
        self._is_ended = True
        self.process.kill()
        with suppress(Empty):
            while True:  # or the thread might wait for room
                self.messages.get_nowait()
        self._thread.join()
        self.process.join()
        self._connection.close()

    def _send(self, order: Callable[..., Any] | None) -> None:
        with suppress(OSError):  # it has ended, which the thread notices
            self._connection.send(order)

    def _receive(self) -> None:
        try:
            with suppress(EOFError, OSError):
                while not self._is_ended:
                    self.messages.put(self._connection.recv())
                    self._arrived.set()
        finally:
            said = "the process that worked on it has ended: somebody ended it, or memory was short"
            self.messages.put(("end", ChildProcessError(said)))
            self._arrived.set()


def _serve(connection: Any) -> None:
    """Do jobs until the other end of the pipe is closed. A thread does them, so that this one hears of it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C belongs to the process that asks
    with suppress(OSError):
        lower_priority(NICE)
    bound_memory(MOST_BYTES)
    executor, dropped = ThreadPoolExecutor(1), Event()
    with suppress(EOFError, OSError):
        while True:
            work = connection.recv()
            if work is None:
                dropped.set()
                continue
            dropped = Event()
            done = executor.submit(_pack_answer, work, partial(_tell, connection), dropped.is_set)
            done.add_done_callback(partial(_send_answer, connection))
    os._exit(0)  # what is under way would reach nobody


def _tell(connection: Any, part: object) -> None:
    connection.send(("part", part))


def _pack_answer(work: Callable[..., Any], *asker: Callable[..., Any]) -> bytes:
    return pickle.dumps(("answer", work(*asker)))


def _send_answer(connection: Any, done: Future[bytes]) -> None:
    error = done.exception()
    with suppress(OSError):  # nobody is left to receive it
        if error is None:
            connection.send_bytes(done.result())
        else:
            connection.send(("error", error))
