"""What a page of the window is: a widget that follows the engine and the theme, whole or in two parts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLayout, QSplitter, QWidget

from ..widgets.boxes import Scrolled, column, title_of
from ..widgets.theme import Theme
from .app_context import AppContext, Remembered
from .file_kind import FileKind


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


@runtime_checkable
class Themed(Protocol):
    """A part of a page that draws with colours of the theme."""

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""


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
        for part in self.findChildren(QWidget):
            if isinstance(part, Themed):
                part.retheme(theme)

    def entered(self) -> None:
        """Come into sight."""

    def left(self) -> None:
        """Go out of sight, or end with the window: keep what was typed."""


class SideAndPicture(QSplitter):
    """A page in two parts, each of which scrolls by itself; keeps where the line between them was put.

    Parameters
    ----------
    context
        Of the page.
    page
        Its name, which is the title of the left part.
    side
        Scrolled below the title.
    picture
        The right part.
    foot
        What stays in sight below the left part: the buttons that act on it.

    """

    WIDEST_SIDE = 0.55
    """Part of the width that the left part may take by itself."""

    def __init__(
        self,
        context: AppContext,
        page: str,
        side: QWidget,
        picture: QWidget,
        foot: QWidget | QLayout | None = None,
    ) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._settings, self._page = context.settings, page
        self._was_moved = False
        self.setAccessibleName(f"Parts of the {page} page")
        self.side = Scrolled(f"Choices of the {page} page", side)
        feet = () if foot is None else (foot,)
        self.addWidget(column(title_of(page), (self.side, 1), *feet))
        self.addWidget(Scrolled(f"Pictures of the {page} page", picture))
        self.setStretchFactor(1, 1)
        self.setChildrenCollapsible(False)
        self.splitterMoved.connect(self._move)
        kept = self._settings.state(Remembered.SPLITTERS, page)
        self._was_moved = not kept.isEmpty() and self.restoreState(kept)

    def keep(self) -> None:
        """Keep how the page is divided, for next time, where somebody has divided it."""
        if self._was_moved:
            self._settings.keep_state(Remembered.SPLITTERS, self.saveState(), self._page)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the left part the width that it needs, unless somebody has chosen another."""
        super().resizeEvent(event)
        self._divide()

    def event(self, event: QEvent) -> bool:
        """Follow the font at once, also where it changed while the page was out of sight."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.Show):
            # Afterwards: what is inside has not been told yet.
            QTimer.singleShot(0, self, self._divide)
        return super().event(event)

    def _move(self, *_: object) -> None:
        self._was_moved = True

    def _divide(self) -> None:
        if not self._was_moved:
            wanted = min(self.side.sizeHint().width(), round(self.WIDEST_SIDE * self.width()))
            self.setSizes([wanted, self.width() - wanted])
