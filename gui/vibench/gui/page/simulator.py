"""Simulations for a page, run in one process; partial results are shown, and the page can cancel them."""

from collections.abc import Callable

from PySide6.QtCore import QObject

from vibench.analysis.prediction.progress import PartialResult
from vibench.analysis.prediction.worker import Asked, answer
from vibench.sim.background import Job

from ..background.background import Background


class Simulator(QObject):
    """Process that computes the newest request of a page, and lives as long as the page.

    ``grown`` receives partial results, ``ended`` is called after the last one, ``died`` after a failure.
    """

    def __init__(
        self,
        page: QObject,
        grown: Callable[[tuple[PartialResult, ...]], None],
        ended: Callable[[], None],
        died: Callable[[str], None],
    ) -> None:
        super().__init__(page)
        self._grown, self._ended, self._died = grown, ended, died
        self._job: Job | None = None
        self.background = Background(1, self)
        page.destroyed.connect(self.background.close)

    @property
    def is_busy(self) -> bool:
        """Whether an answer is incomplete."""
        return self._job is not None and not self._job.is_over

    def begin(self, request: Asked) -> None:
        """Start a request; the answer to an earlier one is dropped."""
        self.cancel()
        self._job = self.background.stream(answer, self._grown, self._end, self._die, request)

    def cancel(self) -> None:
        """Cancel the request."""
        if self._job is not None:
            self._job.drop()

    def _end(self, _answer: None) -> None:
        self._ended()

    def _die(self, error: BaseException) -> None:
        self._died(f"The simulation failed: {error}.")
