"""Beside the pictures: progress, impacts, levels; freeze the picture, mark an event."""

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFormLayout,
    QGroupBox,
    QLabel,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition.engine import DRIVING, EngineStatus, RunStatus, TwinSwitch
from vibench.analysis.live import OVER_SHARE, Level, LevelVerdict, LiveView

from ...forms.editor import Choice
from ...forms.field_edge import LineField
from ...widgets.boxes import filled, row
from ...widgets.clock import clock
from ...widgets.hint import paint_hint
from ...widgets.push_button import push_button
from ...widgets.theme import Theme, Tone
from ...widgets.timed_bar import ProgressBar
from .time_histories import USUAL_SPAN_S, channel_word

_ROW = 1.9
"""Height of a meter, in heights of the font."""
_WORDS = {LevelVerdict.OVER: "✖ over", LevelVerdict.GOOD: "", LevelVerdict.QUIET: "⚠ quiet"}


class LevelMeters(QWidget):
    """One row a channel."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
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
        ink = self._theme.text if self.isEnabled() else self._theme.muted
        painter.setPen(QColor(ink))
        line = QRectF(area.left(), area.top(), area.width(), text_height)
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft, word)
        said = f"{_WORDS[level.verdict]}  {100 * level.held_share:.1f} %"
        painter.drawText(line, Qt.AlignmentFlag.AlignRight, said)
        bar = QRectF(area.left(), area.top() + text_height + 1, area.width(), 0.45 * text_height)
        painter.fillRect(bar, QColor(self._theme.raised))
        tone = Tone.DANGER if level.verdict is LevelVerdict.OVER else Tone.GOOD
        used = QRectF(bar)
        used.setWidth(bar.width() * min(level.peak_share, 1.0))
        painter.fillRect(used, QColor(self._theme.tones[tone].ground if self.isEnabled() else ink))
        danger = self._theme.tones[Tone.DANGER].ground
        for share, colour in ((level.held_share, ink), (OVER_SHARE, danger)):
            mark = QRectF(bar.left() + bar.width() * min(share, 1.0) - 1, bar.top(), 2, bar.height())
            painter.fillRect(mark, QColor(colour))


SPANS_S = (0.05, 0.2, 1.0, 2.0, 5.0, 10.0)
"""Seconds in a time history."""


class WatchCard(QGroupBox):
    """What is watched in numbers, and what may be done about the picture."""

    mark_wanted = Signal(str)
    reject_wanted = Signal()
    """Take no result from the average of noise that is played."""
    twin_wanted = Signal(object)
    """A `TwinSwitch`."""

    def __init__(self, theme: Theme) -> None:
        super().__init__("Watch")
        self.progress = ProgressBar()
        self.progress.setAccessibleName("Progress of the run")
        self.progress.setRange(0, 1000)
        self.progress.setFormat("no run yet")
        self.progress.setValue(0)
        self.impacts = QLabel("0")
        self.impacts.setAccessibleName("Impacts so far")
        self.impacts.setProperty("rank", "title")
        self.impacts.setToolTip("Kinks in the acceleration of m0, as the vibrometer sees them")
        self.meters = LevelMeters(theme)
        self.span = Choice()
        for span_s in SPANS_S:
            self.span.addItem(f"{span_s:g} s")
        self.span.setCurrentIndex(SPANS_S.index(USUAL_SPAN_S))
        self.span.setToolTip("Seconds in a time history")
        self.freeze = QCheckBox("Freeze the picture  (Space)")
        self.freeze.setToolTip("Only the picture stands still; the recording goes on")
        self.twin = QCheckBox("Live twin")
        self.twin.setToolTip(
            "Follow m1 between its stops, and note when the specimen changes. It is a process of its own: "
            "the measurement does not wait for it"
        )
        self.twin.clicked.connect(
            lambda is_on: self.twin_wanted.emit(TwinSwitch.ON if is_on else TwinSwitch.OFF)
        )
        self._begun = 0
        self.averages = QLabel("–")
        self.averages.setToolTip("Averages of noise begun and planned")
        self.reject_button = push_button(
            "Reject this one", "Exclude the current average from all results", self.reject_wanted.emit
        )
        self.mark = LineField("event")
        self.mark.setToolTip("What the mark in the recording says")
        self.mark_button = QPushButton("Mark  (M)")
        self.mark_button.setToolTip("Put the mark at the next sample of the recording")
        self.mark_button.clicked.connect(self.wish_mark)
        self._lay_out()

    @property
    def span_s(self) -> float:
        """Seconds in a time history."""
        return SPANS_S[self.span.currentIndex()]

    def wish_mark(self) -> None:
        """Ask for a mark with the text of the field."""
        self.mark_wanted.emit(self.mark.text().strip() or "event")

    def show_status(self, status: EngineStatus | None, averages: int) -> None:
        """Show where the run stands; so many averages of noise are planned, 0 for anything else."""
        run = None if status is None else status.run
        is_running = status is not None and status.state in DRIVING
        self.mark_button.setEnabled(is_running)
        if run is None or not is_running or not averages:
            self._begun = 0
        else:
            # While the next one settles, the last one counts.
            self._begun = int(run.numbers.get("realisation", self._begun - 1)) + 1
        self.reject_button.setEnabled(self._begun > 0)
        self.averages.setText(f"{self._begun} of {averages}" if self._begun else "–")
        self.twin.setEnabled(status is not None and status.bench is not None)
        self.twin.setChecked(status is not None and status.twin is not None)
        if run is not None and is_running:
            self.progress.setValue(round(1000 * min(1.0, run.elapsed_s / max(run.total_s, 1e-9))))
            self.progress.setFormat(_progress_text(run))
        elif self.progress.value():
            self.progress.setFormat("the last run has ended")

    def show_view(self, view: LiveView) -> None:
        """Show impacts and levels."""
        self.impacts.setText(f"{view.impacts}")
        self.meters.show_view(view)

    def _lay_out(self) -> None:
        form = QFormLayout()
        averages = row((self.averages, 1), self.reject_button)
        for text, widget, field in (
            ("Impacts", self.impacts, self.impacts),
            ("Averages", self.averages, averages),
            ("Histories show", self.span, self.span),
        ):
            label = QLabel(text)
            label.setBuddy(widget)
            widget.setAccessibleName(text)
            form.addRow(label, field)
        self.mark.setAccessibleName("Text of the mark")
        marks = row((self.mark, 1), self.mark_button)
        filled(QVBoxLayout(self), self.progress, form, self.meters, self.freeze, self.twin, marks)


def _progress_text(run: RunStatus) -> str:
    left = clock(run.total_s - run.elapsed_s)
    return f"{run.run_state.value.replace('_', ' ')}, {left} left"
