"""The knobs that no instrument reports: each is confirmed by somebody who has looked at it."""

from datetime import UTC, datetime

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QCheckBox, QFormLayout, QGroupBox, QLabel, QVBoxLayout

from vibench.acquisition.instruments import Knob
from vibench.acquisition.rig import KnobSheet, Rig

from ...forms.field_edge import LineField


class KnobSheetForm(QGroupBox):
    """A tick for every knob, and who has looked."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__("Settings made by hand")
        self._note = QLabel("Look at each knob, then tick it. No instrument can report these.")
        self._note.setWordWrap(True)
        self._note.setProperty("rank", "second")
        self._operator = LineField()
        self._operator.setAccessibleName("Who has looked")
        self._operator.setToolTip("Your name; it goes into every recording")
        self._operator.textChanged.connect(self.changed)
        label = QLabel("Seen by")
        label.setBuddy(self._operator)
        self._ticks: dict[Knob, QCheckBox] = {}
        self._layout = QVBoxLayout(self)
        self._layout.addWidget(self._note)
        form = QFormLayout()
        form.addRow(label, self._operator)
        self._layout.addLayout(form)

    @property
    def ticks(self) -> tuple[QCheckBox, ...]:
        """A tick for every knob of the rig."""
        return tuple(self._ticks.values())

    @property
    def operator_field(self) -> LineField:
        """Where the name is typed."""
        return self._operator

    def show_rig(self, rig: Rig | None) -> None:
        """Ask about the knobs of another rig; nothing is confirmed yet."""
        for tick in self._ticks.values():
            self._layout.removeWidget(tick)
            tick.deleteLater()
        knobs = () if rig is None or rig.virtual is not None else rig.knobs
        self._ticks = {knob: self._tick(knob) for knob in knobs}
        self.setVisible(bool(knobs))

    def sheet(self) -> KnobSheet | None:
        """Say what was confirmed; None while a knob or the name is missing."""
        operator = self._operator.text().strip()
        if not self._ticks or not operator or not all(tick.isChecked() for tick in self.ticks):
            return None
        return KnobSheet(operator=operator, confirmed=datetime.now(UTC), knobs=tuple(self._ticks))

    def _tick(self, knob: Knob) -> QCheckBox:
        tick = QCheckBox(f"{knob.instrument}: {knob.setting} at {knob.value}")
        tick.setAccessibleName(f"{knob.instrument}: {knob.setting} is at {knob.value}")
        tick.setToolTip("Ticked: somebody has seen that this knob stands there")
        tick.toggled.connect(self.changed)
        # Between the note and the name.
        self._layout.insertWidget(self._layout.count() - 1, tick)
        return tick
