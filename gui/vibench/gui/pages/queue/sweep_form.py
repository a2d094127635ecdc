"""One axis of a sweep: what varies, from where to where, in how many points."""

from pydantic import ValidationError
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFormLayout, QGroupBox, QLabel, QPushButton

from vibench.acquisition.plan import Range, RangeSpacing, SweepAxis

from ...forms.editor import Choice
from ...forms.model_form import complaints_of
from ...forms.quantity_edit import QuantityEdit

_AXES = {
    SweepAxis.LEVEL: ("level", "Vpp", 0.05, 10.0),
    SweepAxis.FREQUENCY: ("frequency", "Hz", 150.0, 350.0),
}


class SweepForm(QGroupBox):
    """Asks for a sweep of the test on the Test page."""

    wanted = Signal(object, object)
    """The `Axis` and its `Range`."""
    refused = Signal(str)

    def __init__(self) -> None:
        super().__init__("Sweep the test over")
        self.axis, self.spacing = Choice(), Choice()
        for name, _unit, _low, _high in _AXES.values():
            self.axis.addItem(name)
        for spacing in RangeSpacing:
            self.spacing.addItem(spacing.value)
        self.start, self.stop = QuantityEdit("Vpp", float), QuantityEdit("Vpp", float)
        self.count = QuantityEdit("", int)
        self.count.set_value(5)
        layout = QFormLayout(self)
        for text, widget in (
            ("Axis", self.axis),
            ("From", self.start),
            ("To", self.stop),
            ("Points", self.count),
            ("Distances", self.spacing),
        ):
            label = QLabel(text)
            label.setBuddy(widget)
            widget.setAccessibleName(f"{text} of the sweep")
            layout.addRow(label, widget)
        add = QPushButton("Add &sweep")
        add.setToolTip("Add a sweep of the test on the Test page")
        add.clicked.connect(self._add)
        layout.addRow(add)
        self.axis.currentIndexChanged.connect(self._turn)
        self._turn()

    def _turn(self, *_: object) -> None:
        """Show the unit of the axis, and values that suit it."""
        _word, unit, low, high = list(_AXES.values())[self.axis.currentIndex()]
        for edit, value in ((self.start, low), (self.stop, high)):
            edit.show_unit(unit)
            edit.set_value(value)

    def _add(self) -> None:
        unit = list(_AXES.values())[self.axis.currentIndex()][1]
        fields = {
            "start": (f"From ({unit})", self.start),
            "stop": (f"To ({unit})", self.stop),
            "count": ("Points", self.count),
        }
        unread = [f"{name}: {edit.complaint}" for name, edit in fields.values() if edit.complaint]
        if unread:
            self.refused.emit("; ".join(unread))
            return
        given = {
            "start": self.start.value(),
            "stop": self.stop.value(),
            "count": self.count.value(),
            "spacing": self.spacing.currentText(),
        }
        try:
            values = Range.model_validate(given)
        except ValidationError as error:
            named = {loc: fields[str(loc[0])][0] if loc else "Range" for loc in complaints_of(error)}
            self.refused.emit(
                "; ".join(f"{named[loc]}: {text}" for loc, text in complaints_of(error).items())
            )
        else:
            self.wanted.emit(list(_AXES)[self.axis.currentIndex()], values)
