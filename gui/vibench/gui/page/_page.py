"""What a page of the window is: a widget that follows the engine and the theme, whole or in two parts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QScrollArea, QSplitter, QWidget

from ..widgets import Theme, column, title_of
from ._app_context import AppContext
from ._file_kind import FileKind
from ._settings import Remembered


@dataclass(frozen=True)
class Shown:
    """Numbers or a picture, and what they were computed from.

    ``inputs`` are None while nothing is shown. While they are not ``wanted``, the widget is disabled: a stale
    number must never look like a true one.
    """

    widget: QWidget
    inputs: object
    wanted: object

    @property
    def is_true(self) -> bool:
        """Whether it belongs to what is asked for now, or does not look as if it did."""
        return self.inputs is None or self.inputs == self.wanted or not self.widget.isEnabled()


class Page(QWidget):
    """One step of the job. It keeps no truth of its own: what is shown is asked for at every tick."""

    def __init__(self, context: AppContext) -> None:
        super().__init__()
        self.context = context

    @property
    def is_done(self) -> bool:
        """Whether the rail ticks this page."""
        return False

    def refresh(self) -> None:
        """Show what is true now; called some twenty times a second while the page is in sight."""

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """What this page does with files of which kind."""
        return {}

    def undo(self) -> None:
        """Take back the last edit of the plan; pages without one have none."""

    def redo(self) -> None:
        """Make it again."""

    @property
    def shown(self) -> tuple[Shown, ...]:
        """What the page shows that was computed, with what it was computed from."""
        return ()

    @property
    def styled(self) -> tuple[QWidget, ...]:
        """Its parts, for a style sheet: one after the other, where the whole would hold the window up."""
        return (self,)

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours; widgets follow the palette by themselves, plots do not."""

    def entered(self) -> None:
        """Come into sight."""

    def left(self) -> None:
        """Go out of sight, or end with the window: keep what was typed."""


class SideAndPicture(QSplitter):
    """Keeps for each page where the line between its parts was put."""

    def __init__(self, context: AppContext, page: str, side: QWidget, picture: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._settings, self._page = context.settings, page
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
    whole = column(title_of(page), (side, 1))
    area = QScrollArea()
    area.setAccessibleName(f"Choices of the {page} page")
    area.setWidgetResizable(True)
    area.setFrameShape(QScrollArea.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setWidget(whole)
    bar = area.verticalScrollBar().sizeHint().width()
    area.setMinimumWidth(whole.minimumSizeHint().width() + bar + area.fontMetrics().height() // 2)
    return area
