"""Boxes of a layout, filled in one expression: parts below or beside one another."""

from typing import TypeVar

from PySide6.QtCore import QSize
from PySide6.QtWidgets import (
    QBoxLayout,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QLayout,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

Box = TypeVar("Box", bound=QBoxLayout)
Content = QWidget | QLayout
Part = Content | tuple[Content, int] | int
"""A widget or a layout; with its share of the room that is left; or a share that stays empty."""


def filled(box: Box, *parts: Part, margin: int | None = None) -> Box:
    """Put parts into a box, in their order; ``margin`` [pixels] is the style's own where none is given."""
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
    """Put parts beside one another, within another layout."""
    return filled(QHBoxLayout(), *parts)


def column(*parts: Part) -> QWidget:
    """Put parts below one another, in a widget of their own without a margin."""
    whole = QWidget()
    filled(QVBoxLayout(whole), *parts, margin=0)
    return whole


def boxed(title: str, *parts: Part) -> QGroupBox:
    """Put parts below one another, in a frame with a title."""
    frame = QGroupBox(title)
    filled(QVBoxLayout(frame), *parts)
    return frame


def title_of(page: str) -> QLabel:
    """Give the title of a page."""
    title = QLabel(page)
    title.setProperty("rank", "title")
    return title


class Scrolled(QScrollArea):
    """A part of a page that scrolls where it finds too little room, so that it never widens the window.

    Parameters
    ----------
    name
        For screen readers.
    content
        What is scrolled.

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
        """Small, whatever is inside."""
        em = self.fontMetrics().height()
        return QSize(self.LEAST_EM[0] * em, self.LEAST_EM[1] * em)

    def sizeHint(self) -> QSize:
        """As wide as the content needs with a scroll bar beside it."""
        bar = self.verticalScrollBar().sizeHint().width() + self.fontMetrics().height() // 2
        least = self._content.minimumSizeHint()
        return QSize(least.width() + bar, least.height())
