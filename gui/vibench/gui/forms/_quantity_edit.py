"""A field for one quantity: its unit stands in the field, its limits in the tooltip."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent, QPaintEvent, QValidator, QWheelEvent
from PySide6.QtWidgets import QAbstractSpinBox, QWidget

from vibench.acquisition import ConfigurationError

from ._field_edge import draw_edge
from ._quantity_text import parsed_quantity, quantity_text

STEP = 0.05
"""Share by which one step changes a quantity: small beside what matters, and never past zero."""


class QuantityEdit(QAbstractSpinBox):
    """Holds a number with every digit, or nothing where nothing is allowed.

    The value changes when the typing is finished, not at every key.
    """

    changed = Signal()

    def __init__(self, unit: str, kind: type[float] | type[int], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._unit, self._kind = unit, kind
        self._value: float | int | None = None
        self._complaint = ""
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.editingFinished.connect(self._take)

    @property
    def complaint(self) -> str:
        """What is wrong with the text; empty when it can be read."""
        return self._complaint

    def value(self) -> float | int | None:
        """Give the number, None when the field is empty."""
        return self._value

    def set_value(self, value: float | int | None) -> None:
        """Show a number."""
        self._value, self._complaint = value, ""
        self.lineEdit().setText("" if value is None else quantity_text(value, self._unit))

    def show_unit(self, unit: str) -> None:
        """Hold another quantity from now on."""
        self._unit = unit

    def stepBy(self, steps: int) -> None:
        """Change by five per cent a step, or by one where numbers are whole."""
        self._take()
        if self._value is None:
            return
        if self._kind is int:
            self.set_value(int(self._value) + steps)
        else:
            self.set_value(float(f"{self._value * (1 + STEP) ** steps:.4g}"))
        self.changed.emit()

    def stepEnabled(self) -> QAbstractSpinBox.StepEnabledFlag:
        """Both ways; the plan itself knows what is allowed."""
        flag = QAbstractSpinBox.StepEnabledFlag
        return flag.StepUpEnabled | flag.StepDownEnabled

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Let everything be typed; it is read when the typing is finished."""
        return QValidator.State.Acceptable, text, position

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the field, then its edge."""
        super().paintEvent(event)
        draw_edge(self)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Turn only in the field that has the focus: scrolling a form must change nothing."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Select the number, to be typed over."""
        super().focusInEvent(event)
        self.selectAll()

    def _take(self) -> None:
        before = (self._value, self._complaint)
        text = self.lineEdit().text()
        try:
            self.set_value(self._read(text))
        except ConfigurationError as error:
            self._complaint = str(error)
        if (self._value, self._complaint) != before:
            self.changed.emit()

    def _read(self, text: str) -> float | int | None:
        if not text.strip():
            return None
        value = parsed_quantity(text, self._unit)
        if self._kind is int:
            if value != int(value):
                raise ConfigurationError(f"{text!r} is not a whole number; give one")
            return int(value)
        # What is shown is what was typed: the same text must not change a value by rounding.
        return (
            self._value
            if self._value is not None and text == quantity_text(self._value, self._unit)
            else value
        )
