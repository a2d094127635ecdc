"""Cancellable simulations for a page, in a separate process; partial results are shown as they arrive."""

from collections.abc import Callable

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from vibench.analysis.prediction.progress import PartialResult
from vibench.analysis.prediction.worker import Asked, answer
from vibench.sim.background import Job

from ..background.background import Background
from ..widgets.boxes import push_button
from ..widgets.notice import Notice, NoticeKind
from .app_context import AppContext


class Simulator(QObject):
    """Process that computes the newest request of a page; it ends when the page is deleted.

    ``grown`` receives the results so far, ``ended`` is called after the last result, and ``said`` receives
    messages about starting, cancelling and failures.
    """

    def __init__(
        self,
        page: QWidget,
        context: AppContext,
        grown: Callable[[tuple[PartialResult, ...]], None],
        ended: Callable[[], None],
        said: Callable[[str], None],
    ) -> None:
        super().__init__(page)
        self._context = context
        self._grown, self._ended, self._said = grown, ended, said
        self._job: Job | None = None
        self.cancel_button = push_button("&Cancel", "Stop at once; keep the results so far", self.cancel)
        self.cancel_button.setEnabled(False)
        self.background = Background(1, self)
        page.destroyed.connect(self.background.close)

    @property
    def is_busy(self) -> bool:
        """Whether a request is still being computed."""
        return self._job is not None and not self._job.is_over

    def begin(self, request: Asked) -> None:
        """Start a request, and cancel an earlier one."""
        self._drop()
        self._job = self.background.stream(answer, self._grown, self._end, self._die, request)
        self.cancel_button.setEnabled(True)
        self._said("Computing; the first result appears once the program is loaded…")

    def cancel(self) -> None:
        """Cancel the request; the results obtained so far stay on the page."""
        self._drop()
        self._said("Cancelled; the results so far are shown.")

    def _drop(self) -> None:
        if self._job is not None:
            self._job.drop()
        self.cancel_button.setEnabled(False)

    def _end(self, _answer: None) -> None:
        self.cancel_button.setEnabled(False)
        self._ended()

    def _die(self, error: BaseException) -> None:
        self.cancel_button.setEnabled(False)
        what, done = f"The simulation failed: {error}.", "The results so far are shown."
        self._context.say(Notice(NoticeKind.FAULT, what, done, "Compute again.", "SIMULATOR"))
        self._said("The simulation failed.")
