"""Work that takes longer than a frame: done in other processes, and asked after by a timer."""

from collections.abc import Callable
from typing import Generic, TypeVar

from PySide6.QtCore import QObject, QTimer

from vibench.sim.background import Job, Pool

POLL_MS = 20
LONGEST_S = 900.0
"""Nothing that a page asks for takes so long; what does is given up."""

Question = TypeVar("Question")
Answer = TypeVar("Answer")


class Background(Pool, QObject):
    """Spawned processes without Qt; answers come in the thread of the window."""

    def __init__(self, workers: int, parent: QObject | None = None) -> None:
        QObject.__init__(self, parent)
        Pool.__init__(self, workers, LONGEST_S)
        self._timer = QTimer(self, interval=POLL_MS)
        self._timer.timeout.connect(self.poll)

    def prepare(self) -> None:
        """Start the processes now, those of its children too: no frame of a run has time for that."""
        super().prepare()
        for beside in self.findChildren(Background):
            beside.prepare()

    def begin(self, job: Job) -> Job:
        """Do a job as soon as a process is free."""
        begun = super().begin(job)
        if self.is_busy:
            self._timer.start()
        return begun

    def poll(self, wait_s: float = 0.0) -> None:
        """Hand over what has come."""
        super().poll(wait_s)
        if not self.is_busy:
            self._timer.stop()

    def close(self) -> None:
        """End the processes, those of its children too; what has not been answered is dropped."""
        for beside in self.findChildren(Background):
            beside.close()
        self._timer.stop()
        super().close()


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
