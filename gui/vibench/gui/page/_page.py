"""What a page of the window is: a widget that follows the engine and the theme."""

from PySide6.QtWidgets import QWidget

from ..widgets import Theme
from ._desk import Desk


class Page(QWidget):
    """One step of the job. It keeps no truth of its own: what is shown is asked for at every tick."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk

    @property
    def is_done(self) -> bool:
        """Whether the rail ticks this page."""
        return False

    def refresh(self) -> None:
        """Show what is true now; called some twenty times a second while the page is in sight."""

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours; widgets follow the palette by themselves, plots do not."""

    def entered(self) -> None:
        """Come into sight."""

    def left(self) -> None:
        """Go out of sight, or end with the window: keep what was typed."""
