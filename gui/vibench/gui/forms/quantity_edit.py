"""Field for one quantity as people type it ("12,5", "5 ms", "45 µm"); its tooltip shows the limits."""

import re
from decimal import Decimal
from math import isfinite, log10
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QPainter, QPaintEvent, QPalette, QValidator, QWheelEvent
from PySide6.QtWidgets import QAbstractSpinBox, QLineEdit, QWidget

from vibench.acquisition import ConfigurationError

from ..widgets.units import AUTOMATIC, CHOICES, POWERS, STANDARD_GRAVITY, UNITS

_ROUND = 2.0


class EdgedField(QWidget if TYPE_CHECKING else object):  # type: ignore[misc] # a mix-in for Qt's fields
    """A field with a border; only the focused field takes the mouse wheel, so scrolling changes no value."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the field, then its border."""
        super().paintEvent(event)
        role = QPalette.ColorRole.Highlight if self.hasFocus() else QPalette.ColorRole.Mid
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(self.palette().color(role))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), _ROUND, _ROUND)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Ignore the mouse wheel unless the field has focus, so that scrolling the page changes no value."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


class LineField(EdgedField, QLineEdit):
    """A line of text with a border."""


_NUMBER = re.compile(r"^\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*$")


def quantity_text(value: float, unit: str) -> str:
    """Return an SI value as text in the unit of a field, in full precision."""
    shown = UNITS.of(unit, value if abs(value) < _SMALL else 1.0)
    if shown.per_si != 1.0:
        # 4.5e-05 / 1e-06 is not exactly 45: write twelve digits if this text gives the same value.
        text = shown.text(value, 12)
        if parse_quantity(text, unit, shown.name) == value:
            return text
        if UNITS.chosen_units.get(unit, AUTOMATIC) != AUTOMATIC:
            return shown.text(value, _DIGITS)
        if unit in CHOICES:
            # Do not show the SI unit: a number typed over the text would be read in metres, for example.
            return f"{Decimal(repr(value)).scaleb(round(log10(shown.per_si))):f} {shown.name}"
    number = f"{value:.15g}" if float(f"{value:.15g}") == value else repr(value)
    return f"{number} {unit}".strip()


def unit_of(text: str, unit: str) -> str:
    """Return the unit in a field's text; if it has no unit, the unit of an empty field."""
    match = _NUMBER.match(text)
    return (match[2] if match else "") or UNITS.in_field(unit)


def parse_quantity(text: str, unit: str, shown: str = "", example: str = "") -> float:
    """Return the SI value of a text; a comma is a decimal point, and a unit may have a prefix.

    A number without a unit has the unit ``shown`` or, if ``shown`` is empty, the unit of an empty field.
    Raises ConfigurationError when the text is not a number or has another unit.
    """
    match, shown = _NUMBER.match(text), shown or UNITS.in_field(unit)
    if match is None:
        example = example or f"12.5 {shown}".strip()
        raise ConfigurationError(f"{_short(text)} is not a number; write, for example, {example}")
    number, given = match[1].replace(",", "."), match[2] or shown
    if given == unit:
        return float(number)
    if given == "g" and unit in CHOICES and "g" in CHOICES[unit]:
        return float(number) * STANDARD_GRAVITY
    if unit and given.endswith(unit) and given.removesuffix(unit) in POWERS:
        # Convert in the text: 45 µm then becomes exactly 45e-6.
        mantissa, _, exponent = number.lower().partition("e")
        return float(f"{mantissa}e{int(exponent or 0) + POWERS[given.removesuffix(unit)]}")
    raise ConfigurationError(
        f"{_short(given)} is not a unit of this field; give {shown or 'a plain number'}"
        + (f", for example {example}" if example else "")
    )


def _short(text: str) -> str:
    return repr(text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…")


_LONGEST_SHOWN = 40
_SMALL = 1e-2
"""Smallest absolute SI value that is shown without a unit prefix."""
_DIGITS = 6
"""Number of digits that are displayed of a long number; the stored value keeps all digits."""
MOST_WHOLE = 1 << 53
"""Largest integer up to which every integer is exact as a float."""
MOST_TIMES = 1000.0
"""Factor of change above which the user must confirm a value, because wrong units are common mistakes."""
STEP = 0.05
"""Relative change of the value per press of an arrow key; such steps never reach zero."""


class QuantityEdit(EdgedField, QAbstractSpinBox):
    """Field for a number in full precision; some fields may be empty.

    The value changes when typing is finished, not with every key.
    """

    changed = Signal()

    def __init__(self, unit: str, kind: type[float] | type[int], empty: str = "") -> None:
        super().__init__()
        self._unit, self._kind, self._empty = unit, kind, empty
        self._shown_unit = ""
        self._value: float | int | None = None
        self.complaint = ""
        """Reason why the typed text is not an allowed quantity; empty if the quantity is allowed."""
        self._value_to_confirm: float | int | None = None
        """Value that is accepted when the user presses Return again; None if there is no such value."""
        self._is_confirmed = False
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.show_content(None)
        self.editingFinished.connect(self._take)

    @property
    def widget(self) -> QWidget:
        """The field itself, which is the editor of a number in a form."""
        return self

    def content(self) -> float | int | None:
        """Return the number; None if the field is empty."""
        return self._value

    def show_content(self, value: float | int | None) -> None:
        """Set the number that the field shows."""
        self._value, self.complaint, self._value_to_confirm = value, "", None
        text = "" if value is None else quantity_text(value, self._unit)
        self._shown_unit = unit_of(text, self._unit)
        in_unit = f"in {UNITS.in_field(self._unit)}" if self._unit else ""
        self.lineEdit().setPlaceholderText(", ".join(part for part in (self._empty, in_unit) if part))
        self.lineEdit().setText(text)

    def show_unit(self, unit: str) -> None:
        """Change the unit of the quantity and clear the field."""
        self._unit = unit
        self.show_content(None)

    def stepBy(self, steps: int) -> None:
        """Change the value by five per cent per step, or by one for integers."""
        self._take()
        if self._value is None:
            return
        if self._kind is int:
            self.show_content(int(self._value) + steps)
        else:
            self.show_content(float(f"{self._value * (1 + STEP) ** steps:.4g}"))
        self.changed.emit()

    def stepEnabled(self) -> QAbstractSpinBox.StepEnabledFlag:
        """Allow steps up and down; the plan's model checks the limits."""
        flag = QAbstractSpinBox.StepEnabledFlag
        return flag.StepUpEnabled | flag.StepDownEnabled

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept every key; the text is read when typing is finished."""
        return QValidator.State.Acceptable, text, position

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take a second Return as confirmation of the value; leaving the field does not confirm it."""
        self._is_confirmed = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        super().keyPressEvent(event)
        self._is_confirmed = False

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Select the number, so that typing replaces it."""
        super().focusInEvent(event)
        self.selectAll()

    def _take(self) -> None:
        before = (self._value, self.complaint)
        text = self.lineEdit().text()
        try:
            value = self._read(text)
        except ConfigurationError as error:
            self.complaint, self._value_to_confirm = str(error), None
        else:
            if self._is_far(value) and not (self._is_confirmed and value == self._value_to_confirm):
                assert value is not None
                assert self._value is not None
                self._value_to_confirm = value
                self.complaint = (
                    f"{quantity_text(value, self._unit)} is {abs(value / self._value):.3g} times the last "
                    f"value, {quantity_text(self._value, self._unit)}; press Return again to accept it, or "
                    "type another"
                )
            else:
                self.show_content(value)
        if (self._value, self.complaint) != before:
            self.changed.emit()

    def _is_far(self, value: float | int | None) -> bool:
        if not value or not self._value:
            return False
        times = abs(value / self._value)
        return not 1.0 / MOST_TIMES < times < MOST_TIMES

    def _read(self, text: str) -> float | int | None:
        if not text.strip():
            return None
        example = "" if self._value is None else quantity_text(self._value, self._unit)
        value = parse_quantity(text, self._unit, self._shown_unit, example)
        if not isfinite(value):
            raise ConfigurationError(f"{_short(text)} is too large; write a number such as {example or 12}")
        if self._kind is int:
            if value != int(value) or abs(value) > MOST_WHOLE:
                raise ConfigurationError(f"{_short(text)} is not allowed; give a whole number below 2^53")
            return int(value)
        # Compare texts: the displayed number is rounded, which must not change the value.
        return (
            self._value
            if self._value is not None and text == quantity_text(self._value, self._unit)
            else value
        )
