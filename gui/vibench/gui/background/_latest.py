"""Background work of which only the newest question counts: one at a time, none out of date."""

from collections.abc import Callable
from typing import Generic, TypeVar

from PySide6.QtCore import QObject, QTimer

from ._background import Background, Job

Question = TypeVar("Question")
Answer = TypeVar("Answer")


class Latest(QObject, Generic[Question, Answer]):
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
            self._job.is_wanted = False

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
