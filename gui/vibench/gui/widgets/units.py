"""Displayed units: one choice per quantity, for axes, fields, tables and sentences.

Values are in SI units; sentences from other packages use the paper's units (µm, m/s²). Only this module
converts to the units that the user has chosen. Files and reports are not affected.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from math import floor, log10
from types import MappingProxyType, MethodType
from weakref import WeakMethod

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel
from shiboken6 import isValid

from .boxes import plain_lines, plain_tip

STANDARD_GRAVITY = 9.80665
"""Standard gravity [m/s²]; ISO 80000-3."""
AUTOMATIC = "automatic"
"""Name of the choice that shows displacements in µm on axes, and with a suitable prefix elsewhere."""
CHOICES: Mapping[str, tuple[str, ...]] = {
    "m": (AUTOMATIC, "µm", "mm", "m"),
    "m/s": ("mm/s", "m/s"),
    "m/s²": ("m/s²", "g"),
}
"""Units that the user can choose, by SI unit; the first is the default."""
POWERS = {"p": -12, "n": -9, "µ": -6, "u": -6, "μ": -6, "m": -3, "": 0, "k": 3, "M": 6}
"""Powers of ten by unit prefix; three different characters stand for "micro"."""
_FITTED = ("p", "n", "µ", "m", "", "k", "M")
PREFIXED = frozenset({"m", "V", "Vpp", "s", "A", "N", "Hz", "W"})
"""Units that take a prefix for small and large values."""
_PLAIN_FROM, _PLAIN_TO = 0.1, 1e5
_SPELLED = {"m s-1": "m/s", "m s-2": "m/s²", "m/s2": "m/s²", "um": "µm"}
"""Other spellings of units in files and sentences."""
_SI_OF = {"m": "m", "mm": "m", "µm": "m", "m/s": "m/s", "mm/s": "m/s", "m/s²": "m/s²"}
_NUMBER = r"[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
_QUANTITY = re.compile(
    rf"(?<![\w.])(\(?{_NUMBER}(?: ?(?:±|–|to|and) ?{_NUMBER})*\)?) ?"
    rf"({'|'.join(sorted((*_SI_OF, *_SPELLED), key=len, reverse=True))})(?![\w/²·-])"
)
_LEAST_DIGITS = 3
_LONG_WORD = re.compile(r"[^\s\u200b]{25,}")
_BREAK = "\u200b"
"""Zero-width space, at which Qt can break a long word."""
_LONG_FROM, _LONG_TO = Decimal("1e-6"), Decimal("1e7")


@dataclass(frozen=True)
class ShownUnit:
    """Unit in which a quantity is displayed, and the factor from SI values to this unit."""

    name: str
    per_si: float = 1.0

    def text(self, value: float, digits: int = 3) -> str:
        """Return an SI value in this unit as text."""
        shown = value * self.per_si
        # Do not round a number of points, such as 8192, to 8190.
        number = f"{shown:.0f}" if self.name == "points" else f"{shown:.{digits}g}"
        return f"{_number_text(Decimal(number))} {self.name}".strip()


def plain_unit(unit: str) -> str:
    """Return the usual spelling of a unit from a file."""
    return _SPELLED.get(unit, unit)


def prefixed_unit(unit: str, value: float) -> ShownUnit:
    """Return an SI unit with the prefix that suits the value, regardless of the user's choice."""
    si = plain_unit(unit)
    is_plain = si not in PREFIXED or value == 0.0 or _PLAIN_FROM <= abs(value) < _PLAIN_TO
    place = 0 if is_plain else floor(log10(abs(value)) / 3)
    prefix = _FITTED[min(max(place + _FITTED.index(""), 0), len(_FITTED) - 1)]
    return ShownUnit(f"{prefix}{si}", 10.0 ** -POWERS[prefix])


class DisplayUnits:
    """Units chosen for display; widgets register a method that is called after a change."""

    def __init__(self) -> None:
        self._chosen = {si: choices[0] for si, choices in CHOICES.items()}
        # Keep weak references, because this object outlives every window and must not call a closed widget.
        self._listeners: dict[WeakMethod[Callable[[], None]], None] = {}

    def on_change(self, listener: Callable[[], None]) -> None:
        """Call a widget's method after every change of units, until the widget is deleted."""
        self._listeners[WeakMethod(listener, self._forget)] = None

    def _forget(self, listener: WeakMethod[Callable[[], None]]) -> None:
        self._listeners.pop(listener, None)

    @property
    def chosen_units(self) -> Mapping[str, str]:
        """The chosen units, keyed by their SI unit."""
        return MappingProxyType(self._chosen)

    def choose(self, chosen: Mapping[str, str]) -> None:
        """Choose the units, keyed by SI unit; if a unit is missing or unknown, the default is chosen."""
        names = {si: chosen.get(si, "") for si in CHOICES}
        wanted = {si: name if name in CHOICES[si] else CHOICES[si][0] for si, name in names.items()}
        if wanted != self._chosen:
            self._chosen = wanted
            for each in tuple(self._listeners):
                listener = each()
                if isinstance(listener, MethodType) and isValid(listener.__self__):
                    listener()

    def on_axis(self, unit: str) -> ShownUnit:
        """Return the unit of an axis or a column, which does not depend on the value."""
        si = plain_unit(unit)
        name = self._chosen.get(si, si)
        return _unit_of(si, "µm" if name == AUTOMATIC else name)

    def of(self, unit: str, value: float) -> ShownUnit:
        """Return the unit in which a field displays this value."""
        name = self._chosen.get(unit, AUTOMATIC)
        return prefixed_unit(unit, value) if name == AUTOMATIC else _unit_of(unit, name)

    def in_field(self, unit: str) -> str:
        """Return the unit of a number that is typed without a unit into an empty field."""
        return self.on_axis(unit).name

    def convert(self, sentence: str) -> str:
        """Return a sentence in which displacements, velocities and accelerations have the chosen units."""
        return _QUANTITY.sub(self._convert_match, sentence)

    def _convert_match(self, found: re.Match[str]) -> str:
        given = plain_unit(found[2])
        si = _SI_OF[given]
        name = self._chosen[si]
        name = given if name == AUTOMATIC else name
        factor = _unit_of(si, name).per_si / _unit_of(si, given).per_si
        return f"{re.sub(_NUMBER, lambda number: _scale_number(number[0], factor), found[1])} {name}"


def _unit_of(si: str, name: str) -> ShownUnit:
    if name == "g":
        return ShownUnit(name, 1.0 / STANDARD_GRAVITY)
    return ShownUnit(name, 10.0 ** -POWERS[name.removesuffix(si)])


def _scale_number(number: str, factor: float) -> str:
    """Multiply a number in a text; for a power of ten, shift the decimal point and keep all digits."""
    power = round(log10(factor))
    if factor == 1.0:
        return number
    if abs(factor / 10.0**power - 1.0) > 1e-9:
        digits = max(_LEAST_DIGITS, len(Decimal(number).normalize().as_tuple().digits))
        return _number_text(Decimal(f"{float(number) * factor:.{digits}g}"))
    return _number_text(Decimal(number).scaleb(power))


def _number_text(number: Decimal) -> str:
    """Return a number with all digits; very small or large numbers have an exponent."""
    if number == 0 or not number.is_finite() or _LONG_FROM <= abs(number) < _LONG_TO:
        return f"{number:f}"
    return f"{float(number):g}"


def _with_breaks(word: re.Match[str]) -> str:
    return _BREAK.join(re.findall(r".{1,12}?[/\\_.-]|.{1,12}", word[0]))


UNITS = DisplayUnits()
"""The displayed units of the whole program; all pages use the same units."""


class SentenceLabel(QLabel):
    """Wrapped text in which quantities are shown in the chosen units."""

    def __init__(self, text: str = "", rank: str = "", name: str = "") -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.sentence, self._tip = "", ""
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        if rank:
            self.setProperty("rank", rank)
        self.setText(text)
        UNITS.on_change(self._show_converted)

    def setText(self, text: str) -> None:
        """Set the text; its quantities are converted for display."""
        self.sentence = text
        self._show_converted()

    def setToolTip(self, text: str) -> None:
        """Set the tooltip; its quantities are converted for display."""
        self._tip = text
        self._show_converted()

    def text(self) -> str:
        """Return the displayed text."""
        return super().text().replace(_BREAK, "")

    def _show_converted(self) -> None:
        # Allow breaks in long words such as paths, which Qt would otherwise cut off.
        super().setText(_LONG_WORD.sub(_with_breaks, UNITS.convert(plain_lines(self.sentence))))
        super().setToolTip(plain_tip(UNITS.convert(self._tip)))
