"""The line at the foot: rate, losses, room on the disk, the file, frames a second."""

from collections.abc import Mapping
from enum import StrEnum

from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy

from ..widgets.elided_label import ElidedLabel
from ..widgets.theme import Tone


class StatusField(StrEnum):
    """What has a place on the line, from left to right."""

    RIG = "rig"
    OVERRUNS = "overruns"
    CLIPPED = "clipped"
    DISK = "disk"
    FILE = "file"
    FRAMES = "frames"


class StatusLine(QFrame):
    """A place for each field; a field that is not well is marked by symbol and colour."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("statusLine")
        self.setAccessibleName("Status line")
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 3, 10, 3)
        layout.setSpacing(18)
        self._labels: dict[StatusField, ElidedLabel] = {}
        for field in StatusField:
            label = ElidedLabel()
            label.setAccessibleName(f"Status: {field.value}")
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            self._labels[field] = label
            layout.addWidget(label)
        frames = self._labels[StatusField.FRAMES]
        frames.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._fit()
        # The file takes what is left, and gives way first.
        self._labels[StatusField.FILE].setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout.setStretchFactor(self._labels[StatusField.FILE], 1)

    def changeEvent(self, event: QEvent) -> None:
        """Follow the font at once."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange and self._labels:
            self._fit()

    def _fit(self) -> None:
        """Keep the last field as wide as it ever gets: numbers that change all the time move nothing."""
        frames = self._labels[StatusField.FRAMES]
        frames.setMinimumWidth(frames.fontMetrics().horizontalAdvance("00 fps, latency 0000 ms "))

    def text_of(self, field: str) -> str:
        """Give what a field shows."""
        return self._labels[StatusField(field)].text()

    def tip_of(self, field: str) -> str:
        """Give what is said more of it."""
        return self._labels[StatusField(field)].toolTip()

    def explain(self, field: StatusField, text: str) -> None:
        """Say more of a field where somebody points at it."""
        if self._labels[field].toolTip() != text:
            self._labels[field].setToolTip(text)

    def show_fields(
        self, texts: Mapping[StatusField, str], marked: frozenset[StatusField] = frozenset()
    ) -> None:
        """Show texts; ``marked`` fields ask for a look."""
        for field, label in self._labels.items():
            text = texts.get(field, "")
            tone = Tone.CAUTION.value if field in marked else ""
            shown = f"⚠ {text}" if tone else text
            if label.text() != shown:
                label.setText(shown)
                if field is not StatusField.FRAMES:
                    label.setToolTip(shown)
            if (label.property("tone") or "") != tone:
                label.setProperty("tone", tone)
                label.style().polish(label)
