"""How much of its range each channel uses: a bar with the peak held, red and a word above 95 %."""

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from vibench.analysis.live import OVER_SHARE, Level, LevelVerdict, LiveView

from ...widgets import Theme, Tone, paint_hint
from ._channel_words import channel_word

_ROW = 1.9
"""Height of a meter, in heights of the font."""
_WORDS = {LevelVerdict.OVER: "✖ over", LevelVerdict.GOOD: "", LevelVerdict.QUIET: "⚠ quiet"}


class LevelMeters(QWidget):
    """One row a channel."""

    def __init__(self, theme: Theme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._theme = theme
        self._rows: tuple[tuple[str, Level], ...] = ()
        self.setAccessibleName("Level meters")
        self.setToolTip(f"Peak of each channel, of its full scale; red above {OVER_SHARE:.0%}")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_view(self, view: LiveView) -> None:
        """Show the newest levels."""
        words = [channel_word(channel.role) for channel in view.channels]
        rows = tuple(zip(words, view.levels, strict=False))
        if len(rows) != len(self._rows):
            self.updateGeometry()
        self._rows = rows
        said = ", ".join(f"{word} {level.held_share:.0%} {_WORDS[level.verdict]}" for word, level in rows)
        self.setAccessibleDescription(said)
        self.update()

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self._theme = theme
        self.update()

    def sizeHint(self) -> QSize:
        """Room for four channels, which most benches have."""
        height = self.fontMetrics().height()
        return QSize(12 * height, round(_ROW * height * max(4, len(self._rows))))

    def minimumSizeHint(self) -> QSize:
        """Never less than the words need."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint every row."""
        painter = QPainter(self)
        if not self._rows:
            paint_hint(painter, self.rect(), "Levels of all channels, while a test runs.", self._theme.muted)
        row_height = _ROW * self.fontMetrics().height()
        for number, (word, level) in enumerate(self._rows):
            self._paint_row(painter, QRectF(0, number * row_height, self.width(), row_height), word, level)

    def _paint_row(self, painter: QPainter, area: QRectF, word: str, level: Level) -> None:
        text_height = self.fontMetrics().height()
        painter.setPen(QColor(self._theme.text))
        line = QRectF(area.left(), area.top(), area.width(), text_height)
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft, word)
        said = f"{_WORDS[level.verdict]}  {100 * level.held_share:.1f} %"
        painter.drawText(line, Qt.AlignmentFlag.AlignRight, said)
        bar = QRectF(area.left(), area.top() + text_height + 1, area.width(), 0.45 * text_height)
        painter.fillRect(bar, QColor(self._theme.raised))
        tone = Tone.DANGER if level.verdict is LevelVerdict.OVER else Tone.GOOD
        used = QRectF(bar)
        used.setWidth(bar.width() * min(level.peak_share, 1.0))
        painter.fillRect(used, QColor(self._theme.tones[tone].ground))
        danger = self._theme.tones[Tone.DANGER].ground
        for share, colour in ((level.held_share, self._theme.text), (OVER_SHARE, danger)):
            mark = QRectF(bar.left() + bar.width() * min(share, 1.0) - 1, bar.top(), 2, bar.height())
            painter.fillRect(mark, QColor(colour))
