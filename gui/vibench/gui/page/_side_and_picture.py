"""A page in two parts: what is chosen at the left, scrolled where the window is low, and its picture."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QScrollArea, QSplitter, QVBoxLayout, QWidget

from ._desk import Desk
from ._settings import Remembered


class SideAndPicture(QSplitter):
    """Keeps for each page where the line between its parts was put."""

    def __init__(self, desk: Desk, page: str, side: QWidget, picture: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._settings, self._page = desk.settings, page
        self.setAccessibleName(f"Parts of the {page} page")
        self.addWidget(_scrolled(page, side))
        self.addWidget(picture)
        self.setStretchFactor(1, 1)
        self.setChildrenCollapsible(False)
        kept = self._settings.state(Remembered.SPLITTERS, page)
        if not kept.isEmpty():
            self.restoreState(kept)

    def keep(self) -> None:
        """Keep how the page is divided, for next time."""
        self._settings.keep_state(Remembered.SPLITTERS, self.saveState(), self._page)


def _scrolled(page: str, side: QWidget) -> QScrollArea:
    """Put the title of the page above its left part, and let both be scrolled upright only."""
    title = QLabel(page)
    title.setProperty("rank", "title")
    whole = QWidget()
    layout = QVBoxLayout(whole)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.addWidget(title)
    layout.addWidget(side, 1)
    area = QScrollArea()
    area.setAccessibleName(f"Choices of the {page} page")
    area.setWidgetResizable(True)
    area.setFrameShape(QScrollArea.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setWidget(whole)
    bar = area.verticalScrollBar().sizeHint().width()
    area.setMinimumWidth(whole.minimumSizeHint().width() + bar + area.fontMetrics().height() // 2)
    return area
