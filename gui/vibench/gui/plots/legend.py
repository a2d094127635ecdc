"""Legend of a plot: a line of text above the axes, where it covers no data."""

from dataclasses import dataclass
from html import escape

from PySide6.QtCore import Qt
from PySide6.QtGui import QFont, QPalette
from PySide6.QtWidgets import QLabel, QWidget

from vibench.acquisition import printable

_ROOM = 4
"""Margin above and below the text [pixels]."""


@dataclass(frozen=True)
class LegendEntry:
    """A curve's name, with the colour and sign of its line."""

    sign: str
    """The line style as text: ``━━``, ``╍╍``, ``●``."""
    colour: str
    name: str


class LegendLine(QLabel):
    """Entries side by side in as many lines as the width requires; entries are never broken."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._of = parent
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setTextFormat(Qt.TextFormat.RichText)
        self.setWordWrap(True)
        self.setBackgroundRole(QPalette.ColorRole.Base)
        self.setAutoFillBackground(True)
        self.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.follow_font()

    def follow_font(self) -> None:
        """Use a slightly smaller font than the window."""
        font = QFont(self._of.font())
        font.setPointSizeF(0.85 * font.pointSizeF())
        self.setFont(font)

    def show_entries(self, entries: tuple[LegendEntry, ...]) -> None:
        """Show the names of these curves."""
        text = "&nbsp;&nbsp;&nbsp; ".join(
            f'<span style="color:{each.colour}">{each.sign}</span>&nbsp;'
            f"{escape(printable(each.name)).replace(' ', '&nbsp;').replace('-', '&#8209;')}"
            for each in entries
        )
        if text != self.text():
            self.setText(text)
            self.setAccessibleName("Legend: " + ", ".join(printable(each.name) for each in entries))

    def height_for(self, width: int) -> int:
        """Return the height of the entries; zero without entries."""
        return self.heightForWidth(width) + 2 * _ROOM if self.text() else 0
