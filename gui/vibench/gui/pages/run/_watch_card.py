"""Beside the pictures: progress, impacts, levels; freeze the picture, mark an event."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QFormLayout,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition.engine import DRIVING, EngineStatus, RunStatus
from vibench.analysis.live import LiveView

from ...forms import Choice, LineField
from ...widgets import Theme, clock
from ._lanes import USUAL_SPAN_S
from ._level_meters import LevelMeters

SPANS_S = (0.05, 0.2, 1.0, 2.0, 5.0, 10.0)
"""Seconds in a lane."""


class WatchCard(QGroupBox):
    """What is watched in numbers, and what may be done about the picture."""

    mark_wanted = Signal(str)

    def __init__(self, theme: Theme, parent: QWidget | None = None) -> None:
        super().__init__("Watch", parent)
        self.progress = QProgressBar()
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
        self.span.setToolTip("Seconds in a lane")
        self.freeze = QCheckBox("Freeze the picture  (Space)")
        self.freeze.setToolTip("Only the picture stands still; the recording goes on")
        self.mark = LineField("event")
        self.mark.setToolTip("What the mark in the recording says")
        self.mark_button = QPushButton("Mark  (M)")
        self.mark_button.setToolTip("Put the mark at the next sample of the recording")
        self.mark_button.clicked.connect(self.wish_mark)
        self._lay_out()

    @property
    def span_s(self) -> float:
        """Seconds in a lane."""
        return SPANS_S[self.span.currentIndex()]

    def wish_mark(self) -> None:
        """Ask for a mark with the text of the field."""
        self.mark_wanted.emit(self.mark.text().strip() or "event")

    def show_status(self, status: EngineStatus | None) -> None:
        """Show where the run stands."""
        run = None if status is None else status.run
        is_running = status is not None and status.state in DRIVING
        self.mark_button.setEnabled(is_running)
        if run is not None:
            self.progress.setValue(round(1000 * min(1.0, run.elapsed_s / max(run.total_s, 1e-9))))
            self.progress.setFormat(_progress_text(run) if is_running else "the last run has ended")

    def show_view(self, view: LiveView) -> None:
        """Show impacts and levels."""
        self.impacts.setText(f"{view.impacts}")
        self.meters.show_view(view)

    def retheme(self, theme: Theme) -> None:
        """Draw in other colours."""
        self.meters.retheme(theme)

    def _lay_out(self) -> None:
        form = QFormLayout()
        for text, widget in (("Impacts", self.impacts), ("Lanes show", self.span)):
            label = QLabel(text)
            label.setBuddy(widget)
            widget.setAccessibleName(text)
            form.addRow(label, widget)
        marks = QHBoxLayout()
        self.mark.setAccessibleName("Text of the mark")
        marks.addWidget(self.mark, 1)
        marks.addWidget(self.mark_button)
        layout = QVBoxLayout(self)
        layout.addWidget(self.progress)
        layout.addLayout(form)
        layout.addWidget(self.meters)
        layout.addWidget(self.freeze)
        layout.addLayout(marks)


def _progress_text(run: RunStatus) -> str:
    left = clock(run.total_s - run.elapsed_s)
    return f"{run.run_state.value.replace('_', ' ')}, {left} left"
