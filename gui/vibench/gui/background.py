"""Work that takes longer than one frame of the display, done in spawned processes.

`Background` runs functions in a pool of processes and polls for results; `LatestRequest` computes only the
newest request. Functions, arguments and results must be importable and accepted by pickle. Their modules
must not import Qt widgets, because every worker process imports these modules.
"""

from collections.abc import Callable
from typing import Generic, TypeVar

from PySide6.QtCore import QObject, QTimer
from shiboken6 import isValid

from vibench.sim.background import Job, Pool

POLL_MS = 20
LONGEST_S = 900.0
"""Time limit of a job [s]; a job that takes longer is stopped."""

Question = TypeVar("Question")
Answer = TypeVar("Answer")


def in_next_pass(receiver: QObject, step: Callable[[], None]) -> None:
    """Call ``step`` in the next pass of the event loop, after all drawing and input have been handled."""
    # Do not wait 0 ms: Qt would then call two steps before calling another timer.
    QTimer.singleShot(1, receiver, step)


class Background(Pool, QObject):
    """Pool of spawned processes without Qt; results are delivered in the window's thread."""

    def __init__(self, workers: int, parent: QObject | None = None) -> None:
        QObject.__init__(self, parent)
        Pool.__init__(self, workers, LONGEST_S)
        self._timer = QTimer(self, interval=POLL_MS)
        self._timer.timeout.connect(self.poll)

    def prepare(self) -> None:
        """Start all worker processes now; processes that start during a run would delay the display."""
        super().prepare()
        for beside in self.findChildren(Background):
            beside.prepare()

    def begin(self, job: Job) -> Job:
        """Run a job as soon as a worker process is free."""
        begun = super().begin(job)
        if self.is_busy:
            self._timer.start()
        return begun

    def poll(self, wait_s: float = 0.0) -> None:
        """Call the listeners of all jobs whose results have arrived."""
        super().poll(wait_s)
        if not self.is_busy:
            self._timer.stop()

    def close(self) -> None:
        """End all worker processes and drop unfinished jobs."""
        for beside in self.findChildren(Background):
            beside.close()
        self._timer.stop()
        super().close()


class LatestRequest(QObject, Generic[Question, Answer]):
    """Executor that runs only the newest request, after a short time without another request."""

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
        """Whether the newest request has no result yet."""
        return self._wanted is not None or self._job is not None

    def ask(self, question: Question) -> None:
        """Replace the waiting request by this request."""
        self._wanted = question
        self._timer.start()

    def drop(self) -> None:
        """Cancel the waiting and the running request."""
        self._wanted = None
        self._timer.stop()
        if self._job is not None:
            self._job.drop()
            self._job = None

    def _ask(self) -> None:
        if self._wanted is None or self._job is not None:
            return
        question, self._wanted = self._wanted, None
        self._job = self._background.ask(self._function, self._take_answer, self._take_error, question)

    def _take_answer(self, answer: Answer) -> None:
        self._job = None
        if not isValid(self):  # this page has been deleted since
            return
        if self._wanted is None:
            self._on_answer(answer)
        self._ask()

    def _take_error(self, error: BaseException) -> None:
        self._job = None
        if not isValid(self):
            return
        if self._wanted is None:
            self._on_error(error)
        self._ask()
