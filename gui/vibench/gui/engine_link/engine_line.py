"""The line to the engine: one thread that asks, so that the window never waits for an answer."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import count
from queue import Empty, PriorityQueue, SimpleQueue
from typing import Any

from vibench.acquisition import AcquisitionError
from vibench.acquisition.engine import AdoptedEngine, Attendant, EngineClient, EngineProcess, start_engine

Starter = Callable[[], EngineProcess | AdoptedEngine]
Question = Callable[[EngineClient], Any]
Listener = Callable[[Any], None]


class Urgency(IntEnum):
    """Whose turn it is when several wait."""

    STOP = 0
    ORDER = 1
    LOOK = 2
    END = 3
    LEAVE = 4


@dataclass(order=True)
class _Call:
    urgency: Urgency
    number: int
    question: Question = field(compare=False)
    on_answer: Listener = field(compare=False)
    on_refusal: Callable[[AcquisitionError], None] = field(compare=False)


class EngineLine:
    """Starts an engine and asks it, in a thread without Qt; answers wait until `drain` fetches them.

    Nothing is asked unless the window asks: a window that hangs falls silent, and the engine notices.
    """

    def __init__(self, start: Starter = start_engine) -> None:
        self._start = start
        self._calls: PriorityQueue[_Call] = PriorityQueue()
        self._answers: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._numbers = count()
        self._engine: EngineProcess | AdoptedEngine | None = None
        self._attendant: Attendant | None = None
        self._thread = threading.Thread(target=self._run, name="engine line", daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int | None:
        """The engine's process, None before it runs."""
        return None if self._engine is None else self._engine.pid

    @property
    def attendant(self) -> Attendant | None:
        """Tells the engine that the window is alive; None before there is an engine."""
        return self._attendant

    def ask(
        self,
        urgency: Urgency,
        question: Question,
        on_answer: Listener,
        on_refusal: Callable[[AcquisitionError], None],
    ) -> None:
        """Ask when it is its turn; one of the two listeners is called by `drain`."""
        self._calls.put(_Call(urgency, next(self._numbers), question, on_answer, on_refusal))

    def drain(self) -> None:
        """Tell the answers that have come, in the thread that calls."""
        while True:
            try:
                tell = self._answers.get_nowait()
            except Empty:
                return
            tell()

    def leave(self, how: Urgency = Urgency.END) -> None:
        """Let the engine ramp down and end, or go on alone; nobody waits for that."""
        self._calls.put(_Call(how, next(self._numbers), _nothing, _nothing, _nothing))

    def close(self, how: Urgency = Urgency.END) -> None:
        """Let the engine ramp down and end, or go on alone, and wait for that."""
        self.leave(how)
        self._thread.join()

    def _run(self) -> None:
        while (call := self._calls.get()).urgency not in (Urgency.END, Urgency.LEAVE):
            self._answer(call)
        if self._attendant is not None:
            self._attendant.close()
        if self._engine is None:
            return
        if call.urgency is Urgency.LEAVE:
            self._engine.leave()
        else:
            self._engine.close()

    def _answer(self, call: _Call) -> None:
        try:
            if self._engine is None:
                self._engine = self._start()
                self._attendant = Attendant(self._engine.address)
            answer = call.question(self._engine.client)
        except AcquisitionError as error:
            refusal = error
            self._answers.put(lambda: call.on_refusal(refusal))
        else:
            self._answers.put(lambda: call.on_answer(answer))


def _nothing(_: object) -> None:
    """Do nothing with an answer."""
