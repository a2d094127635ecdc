"""Functions that build box layouts, and common widgets: scroll areas, buttons, labels, progress bars."""

from collections.abc import Callable
from html import escape
from pathlib import Path
from time import monotonic
from typing import TypeVar

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QBoxLayout,
    QCheckBox,
    QFileDialog,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QLayout,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSplitter,
    QStyle,
    QStyleOption,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition import printable

from .notice import clock

Box = TypeVar("Box", bound=QBoxLayout)
Content = QWidget | QLayout
Part = Content | tuple[Content, int] | int
"""Widget or layout, with or without a stretch factor; a number alone means empty space that stretches."""


def fill_box(box: Box, *parts: Part, margin: int | None = None) -> Box:
    """Add parts to a box, in order; ``margin`` is in pixels, by default the style's margin."""
    if margin is not None:
        box.setContentsMargins(margin, margin, margin, margin)
    for part in parts:
        match part:
            case int():
                box.addStretch(part)
            case (QWidget() as widget, share):
                box.addWidget(widget, share)
            case (QLayout() as layout, share):
                box.addLayout(layout, share)
            case QWidget():
                box.addWidget(part)
            case QLayout():
                box.addLayout(part)
    return box


def row(*parts: Part) -> QHBoxLayout:
    """Return a layout with the parts side by side."""
    return fill_box(QHBoxLayout(), *parts)


def column(*parts: Part) -> QWidget:
    """Return a widget with the parts one above the other, without a margin."""
    whole = QWidget()
    fill_box(QVBoxLayout(whole), *parts, margin=0)
    return whole


def titled_box(title: str, *parts: Part) -> QGroupBox:
    """Return a titled frame with the parts one above the other."""
    frame = QGroupBox(title)
    fill_box(QVBoxLayout(frame), *parts)
    return frame


def title_of(page: str) -> QLabel:
    """Return the title label of a page."""
    title = QLabel(page)
    title.setProperty("rank", "title")
    return title


class ScrollArea(QScrollArea):
    """Scrolling part of a page, which never widens the window.

    Parameters
    ----------
    name
        Name for screen readers.
    content
        Widget that scrolls.
    """

    LEAST_EM = 7, 3

    def __init__(self, name: str, content: QWidget) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.setWidget(content)
        self._content = content

    def minimumSizeHint(self) -> QSize:
        """Return a small size that does not depend on the content."""
        em = self.fontMetrics().height()
        return QSize(self.LEAST_EM[0] * em, self.LEAST_EM[1] * em)

    def sizeHint(self) -> QSize:
        """Return the width of the content plus a scroll bar."""
        bar = self.verticalScrollBar().sizeHint().width() + self.fontMetrics().height() // 2
        least = self._content.minimumSizeHint()
        return QSize(least.width() + bar, least.height())


def push_button(text: str, tip: str, act: Callable[[], object], rank: str = "") -> QPushButton:
    """Return a button that calls ``act`` without arguments."""
    button = QPushButton(text)
    button.setProperty("rank", rank)
    button.setToolTip(tip)
    button.setAccessibleName(text.replace("&", "").rstrip("…"))
    button.clicked.connect(lambda _checked=False: act())
    return button


def tick_box(text: str, tip: str, act: Callable[[bool], object]) -> QCheckBox:
    """Return a check box that calls ``act`` with its new state."""
    box = QCheckBox(text)
    box.setToolTip(tip)
    box.toggled.connect(act)
    return box


def label_for(text: str, field: QWidget, name: str = "") -> QLabel:
    """Return a label whose shortcut moves the focus to ``field``; ``name`` is for screen readers."""
    label = QLabel(text)
    label.setBuddy(field)
    field.setAccessibleName(name or text.replace("&", ""))
    return label


def splitter(
    name: str,
    first: QWidget,
    second: QWidget,
    sizes: tuple[int, int],
    orientation: Qt.Orientation = Qt.Orientation.Vertical,
) -> QSplitter:
    """Return two parts with a movable divider, by default one above the other."""
    parts = QSplitter(orientation)
    parts.setAccessibleName(name)
    parts.addWidget(first)
    parts.addWidget(second)
    parts.setSizes(sizes)
    return parts


def keep_space(widget: QWidget) -> None:
    """Keep the space of a widget while it is hidden, so that nothing around it moves."""
    policy = widget.sizePolicy()
    policy.setRetainSizeWhenHidden(True)
    widget.setSizePolicy(policy)


def set_tone(widget: QWidget, tone: str) -> None:
    """Give a widget the colours of a `Tone`; an empty text removes these colours."""
    if (widget.property("tone") or "") != tone:
        widget.setProperty("tone", tone)
        widget.style().polish(widget)


def new_path(parent: QWidget, title: str, wish: Path, filters: str) -> Path | None:
    """Ask for the path of a new file; if it has no suffix, add the suffix of the selected filter."""
    options = QFileDialog.Option.DontConfirmOverwrite
    given, kind = QFileDialog.getSaveFileName(parent, title, str(wish), filters, options=options)
    if not given:
        return None
    path = Path(given)
    return path if path.suffix else path.with_suffix(kind[kind.index("*") + 1 : kind.index(")")])


_WIDEST = 0.8
"""Largest width of a hint's text, relative to the empty area."""


def hint_in_list(view: QAbstractItemView, text: str) -> None:
    """Draw a hint in an empty list or table."""
    colour = view.palette().placeholderText().color()
    paint_hint(QPainter(view.viewport()), view.viewport().rect(), text, colour)


def paint_hint(painter: QPainter, area: QRect, text: str, colour: str | QColor) -> None:
    """Draw a hint in the middle of an area."""
    margin = round(0.5 * (1 - _WIDEST) * area.width())
    painter.setPen(QColor(colour))
    flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
    painter.drawText(area.adjusted(margin, 0, -margin, 0), flags, text)


def plain_lines(text: str) -> str:
    """Return the text without control characters other than line breaks."""
    return text if text.isprintable() else "\n".join(map(printable, text.split("\n")))


def plain_tip(text: str) -> str:
    """Return a tooltip in which markup is shown as plain text."""
    lines = plain_lines(text)
    return f"<p style='white-space:pre-wrap'>{escape(lines)}</p>" if "<" in lines else lines


class ElidedLabel(QLabel):
    """Label of one line; text that does not fit ends in dots, and the tooltip shows the whole text."""

    LETTERS = 3

    def __init__(self, text: str = "", rank: str = "") -> None:
        super().__init__()
        self.setProperty("rank", rank)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setText(text)

    def setText(self, text: str) -> None:
        """Show a text on one line, cut off if necessary."""
        super().setText(printable(text))

    def setToolTip(self, text: str) -> None:
        """Set the text of the tooltip."""
        super().setToolTip(plain_tip(text))

    def minimumSizeHint(self) -> QSize:
        """Return the width of a few letters, so that a long text does not widen the window."""
        hint = super().minimumSizeHint()
        least = self.LETTERS * self.fontMetrics().averageCharWidth()
        return QSize(min(hint.width(), least), hint.height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the text, cut off if necessary."""
        room = self.contentsRect()
        if self.sizeHint().width() <= self.width() or room.width() <= 0:
            super().paintEvent(event)
            return
        painter, option = QPainter(self), QStyleOption()
        option.initFrom(self)
        self.style().drawPrimitive(QStyle.PrimitiveElement.PE_Widget, option, painter, self)
        painter.setPen(self.palette().color(self.foregroundRole()))
        text = self.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, room.width())
        painter.drawText(room, self.alignment(), text)
        if not self.toolTip():
            self.setToolTip(self.text())


LEAST_S = 1.0
"""Elapsed time at which a progress bar begins to estimate the remaining time [s]."""


class ProgressBar(QProgressBar):
    """Progress bar with a text; text that does not fit ends in dots, and the tooltip shows the whole text."""

    def __init__(self, name: str, text: str = "") -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setRange(0, 1000)
        self.show_share(0.0, text)

    def show_share(self, share: float, text: str) -> None:
        """Show the finished fraction of the work, 0 to 1 (larger values count as 1), with a text."""
        self.setValue(round(1000 * min(1.0, share)))
        self.setFormat(text)

    def text(self) -> str:
        """Return as much of the text as fits."""
        whole = super().text()
        room = self.width() - self.fontMetrics().averageCharWidth()
        shown = self.fontMetrics().elidedText(whole, Qt.TextElideMode.ElideRight, room)
        self.setToolTip(whole if shown != whole else "")
        return shown


class TimedBar(ProgressBar):
    """Progress bar that estimates the remaining time from the number of finished pieces."""

    def __init__(self, name: str, pieces: str) -> None:
        super().__init__(name)
        self._pieces = pieces
        self._begun_s = 0.0
        self._total = 0
        self.show_done(0, 0)

    def begin(self) -> None:
        """Restart the measurement of the elapsed time."""
        self._begun_s = monotonic()

    def show_done(self, done: int, total: int) -> None:
        """Show the number of finished pieces; ``total`` is 0 if no work was started."""
        if total and not self._total:
            self.begin()
        self._total = total
        self.setMaximum(max(total, 1))
        self.setValue(done)
        if not total:
            self.setFormat(f"no {self._pieces} yet")
            return
        elapsed_s = monotonic() - self._begun_s
        left = ""
        if 0 < done < total and elapsed_s > LEAST_S:
            left = f", {clock(elapsed_s * (total - done) / done)} left"
        self.setFormat(f"{done} of {total} {self._pieces}{left}")
