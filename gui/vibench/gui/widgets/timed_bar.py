"""How far work is that takes longer than a second, and how long it will go on."""

from time import monotonic

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QProgressBar

from .clock import clock

LEAST_S = 1.0
"""Before this much of it is done nobody can say how long the rest takes [s]."""


class ProgressBar(QProgressBar):
    """A bar whose words end in dots where they find no room; the tooltip says them whole."""

    def text(self) -> str:
        """Give as many of the words as fit."""
        whole = super().text()
        room = self.width() - self.fontMetrics().averageCharWidth()
        shown = self.fontMetrics().elidedText(whole, Qt.TextElideMode.ElideRight, room)
        self.setToolTip(whole if shown != whole else "")
        return shown


class TimedBar(ProgressBar):
    """Counts pieces of work; the time left follows from those that are done."""

    def __init__(self, name: str, pieces: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._pieces = pieces
        self._begun_s = 0.0
        self._asked = 0
        self.show_done(0, 0)

    def begin(self) -> None:
        """Count the time from now on."""
        self._begun_s = monotonic()

    def show_done(self, done: int, asked: int) -> None:
        """Show how many pieces are done; 0 asked: nothing was begun."""
        if asked and not self._asked:
            self.begin()
        self._asked = asked
        self.setMaximum(max(asked, 1))
        self.setValue(done)
        if not asked:
            self.setFormat(f"no {self._pieces} yet")
            return
        elapsed_s = monotonic() - self._begun_s
        left = ""
        if 0 < done < asked and elapsed_s > LEAST_S:
            left = f", {clock(elapsed_s * (asked - done) / done)} left"
        self.setFormat(f"{done} of {asked} {self._pieces}{left}")
