"""What the lines of a plot are: a line of text above the axes, where it covers no data."""

from dataclasses import dataclass
from html import escape

from PySide6.QtCore import Qt
from PySide6.QtGui import QFont, QPalette
from PySide6.QtWidgets import QLabel, QWidget

from vibench.acquisition import printable

_ROOM = 4
"""Pixels above and below the text."""


@dataclass(frozen=True)
class LegendEntry:
    """One curve: how it is drawn, in which colour, and its name."""

    sign: str
    """A piece of the line in letters: ``━━``, ``╍╍``, ``●``."""
    colour: str
    name: str


class LegendLine(QLabel):
    """Entries side by side, in as many lines as the width asks for; an entry is never broken."""

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
        """Write a little smaller than the rest."""
        font = QFont(self._of.font())
        font.setPointSizeF(0.85 * font.pointSizeF())
        self.setFont(font)

    def show_entries(self, entries: tuple[LegendEntry, ...]) -> None:
        """Name these curves."""
        said = "&nbsp;&nbsp;&nbsp; ".join(
            f'<span style="color:{each.colour}">{each.sign}</span>&nbsp;'
            f"{escape(printable(each.name)).replace(' ', '&nbsp;').replace('-', '&#8209;')}"
            for each in entries
        )
        if said != self.text():
            self.setText(said)
            self.setAccessibleName("Legend: " + ", ".join(printable(each.name) for each in entries))

    def height_for(self, width: int) -> int:
        """Height that the entries need; none without entries."""
        return self.heightForWidth(width) + 2 * _ROOM if self.text() else 0
