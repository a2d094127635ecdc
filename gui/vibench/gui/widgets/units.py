"""The units that people read: one choice for each quantity, for axes, fields, tables and sentences.

Values come in SI, sentences of other packages in the units of the paper (µm, m/s²). Here alone they are given
the units that somebody has chosen; files and reports keep those of their own.
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
"""Of g [m/s²]; ISO 80000-3."""
AUTOMATIC = "automatic"
"""Displacements as they were written: µm on axes, with a prefix that suits their size elsewhere."""
CHOICES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"m": (AUTOMATIC, "µm", "mm", "m"), "m/s": ("mm/s", "m/s"), "m/s²": ("m/s²", "g")}
)
"""By the SI unit of a quantity, what it may be shown in; the first if nothing is chosen."""
POWERS = {"p": -12, "n": -9, "µ": -6, "u": -6, "μ": -6, "m": -3, "": 0, "k": 3, "M": 6}
"""Of ten, by prefix; three letters are written for millionths."""
_FITTED = ("p", "n", "µ", "m", "", "k", "M")
PREFIXED = frozenset({"m", "V", "Vpp", "s", "A", "N", "Hz", "W"})
"""Units that are given a prefix where the number would be small or large."""
_PLAIN_FROM, _PLAIN_TO = 0.1, 1e5
_SPELLED = {"m s-1": "m/s", "m s-2": "m/s²", "m/s2": "m/s²", "um": "µm"}
"""Units as files and headless sentences spell them."""
_SI_OF = {"m": "m", "mm": "m", "µm": "m", "m/s": "m/s", "mm/s": "m/s", "m/s²": "m/s²"}
_NUMBER = r"[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
_QUANTITY = re.compile(
    rf"(?<![\w.])(\(?{_NUMBER}(?: ?(?:±|–|to|and) ?{_NUMBER})*\)?) ?"
    rf"({'|'.join(sorted((*_SI_OF, *_SPELLED), key=len, reverse=True))})(?![\w/²·-])"
)
_LEAST_DIGITS = 3
_LONG_WORD = re.compile(r"[^\s\u200b]{25,}")
_BREAK = "\u200b"
"""A place where a word may be broken, without a sign."""
_LONG_FROM, _LONG_TO = Decimal("1e-6"), Decimal("1e7")


@dataclass(frozen=True)
class ShownUnit:
    """A unit as it is written, and how many of it one SI unit is."""

    name: str
    per_si: float = 1.0

    def text(self, value: float, digits: int = 3) -> str:
        """Write a value given in SI."""
        shown = value * self.per_si
        # A count is written whole: 8192 points are not 8190.
        number = f"{shown:.0f}" if self.name == "points" else f"{shown:.{digits}g}"
        return f"{_written(Decimal(number))} {self.name}".strip()


def plain_unit(unit: str) -> str:
    """Write a unit of a file as people do."""
    return _SPELLED.get(unit, unit)


def fitted_unit(unit: str, value: float) -> ShownUnit:
    """Give a unit of a file the prefix that suits a value, whatever was chosen: for sentences to be told."""
    si = plain_unit(unit)
    is_plain = si not in PREFIXED or value == 0.0 or _PLAIN_FROM <= abs(value) < _PLAIN_TO
    place = 0 if is_plain else floor(log10(abs(value)) / 3)
    prefix = _FITTED[min(max(place + _FITTED.index(""), 0), len(_FITTED) - 1)]
    return ShownUnit(f"{prefix}{si}", 10.0 ** -POWERS[prefix])


class DisplayUnits:
    """What was chosen for each quantity; whatever shows a quantity listens, as it does to Qt's own font."""

    def __init__(self) -> None:
        self._chosen = {si: choices[0] for si, choices in CHOICES.items()}
        # Not a signal of Qt: this object outlives every window, and nothing of a closed one may be called.
        self._listeners: dict[WeakMethod[Callable[[], None]], None] = {}

    def on_change(self, listener: Callable[[], None]) -> None:
        """Call a method of a widget whenever other units are chosen, as long as there is the widget."""
        self._listeners[WeakMethod(listener, self._forget)] = None

    def _forget(self, listener: WeakMethod[Callable[[], None]]) -> None:
        self._listeners.pop(listener, None)

    @property
    def chosen(self) -> Mapping[str, str]:
        """The choice for each quantity, by its SI unit."""
        return MappingProxyType(self._chosen)

    def choose(self, chosen: Mapping[str, str]) -> None:
        """Show quantities in these units from now on; where one is missing or unknown, in the first."""
        names = {si: chosen.get(si, "") for si in CHOICES}
        wanted = {si: name if name in CHOICES[si] else CHOICES[si][0] for si, name in names.items()}
        if wanted != self._chosen:
            self._chosen = wanted
            for each in tuple(self._listeners):
                listener = each()
                if isinstance(listener, MethodType) and isValid(listener.__self__):
                    listener()

    def on_axis(self, unit: str) -> ShownUnit:
        """Return the unit of an axis, or of a column: one for small values and large ones."""
        si = plain_unit(unit)
        name = self._chosen.get(si, si)
        return _shown(si, "µm" if name == AUTOMATIC else name)

    def of(self, unit: str, value: float) -> ShownUnit:
        """Return the unit in which a field writes a value of this size."""
        name = self._chosen.get(unit, AUTOMATIC)
        return fitted_unit(unit, value) if name == AUTOMATIC else _shown(unit, name)

    def in_field(self, unit: str) -> str:
        """Return the unit of a plain number that is typed into an empty field of this SI unit."""
        return self.on_axis(unit).name

    def told(self, sentence: str) -> str:
        """Write a sentence with its displacements, velocities and accelerations in the chosen units."""
        return _QUANTITY.sub(self._retold, sentence)

    def _retold(self, found: re.Match[str]) -> str:
        given = plain_unit(found[2])
        si = _SI_OF[given]
        name = self._chosen[si]
        name = given if name == AUTOMATIC else name
        factor = _shown(si, name).per_si / _shown(si, given).per_si
        return f"{re.sub(_NUMBER, lambda number: _rewritten(number[0], factor), found[1])} {name}"


def _shown(si: str, name: str) -> ShownUnit:
    if name == "g":
        return ShownUnit(name, 1.0 / STANDARD_GRAVITY)
    return ShownUnit(name, 10.0 ** -POWERS[name.removesuffix(si)])


def _rewritten(number: str, factor: float) -> str:
    """Scale a number as it is written; a power of ten moves the point and keeps every digit."""
    power = round(log10(factor))
    if factor == 1.0:
        return number
    if abs(factor / 10.0**power - 1.0) > 1e-9:
        digits = max(_LEAST_DIGITS, len(Decimal(number).normalize().as_tuple().digits))
        return _written(Decimal(f"{float(number) * factor:.{digits}g}"))
    return _written(Decimal(number).scaleb(power))


def _written(number: Decimal) -> str:
    """Write every digit, with a power of ten where zeros would have to be counted."""
    if number == 0 or not number.is_finite() or _LONG_FROM <= abs(number) < _LONG_TO:
        return f"{number:f}"
    return f"{float(number):g}"


def _with_breaks(word: re.Match[str]) -> str:
    return _BREAK.join(re.findall(r".{1,12}?[/\\_.-]|.{1,12}", word[0]))


UNITS = DisplayUnits()
"""Units of the whole program, as its font and its palette are: a person reads one unit on all pages."""


class SentenceLabel(QLabel):
    """A wrapped text whose quantities stand in the chosen units, and turn when others are chosen."""

    def __init__(self, text: str = "", rank: str = "") -> None:
        super().__init__()
        self.sentence, self._tip = "", ""
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        if rank:
            self.setProperty("rank", rank)
        self.setText(text)
        UNITS.on_change(self._tell)

    def setText(self, text: str) -> None:
        """Show a text as it was made: the units are seen to here."""
        self.sentence = text
        self._tell()

    def setToolTip(self, text: str) -> None:
        """Say more under the pointer, in the same units."""
        self._tip = text
        self._tell()

    def text(self) -> str:
        """Return what is shown."""
        return super().text().replace(_BREAK, "")

    def _tell(self) -> None:
        # A path is one word to Qt: unbroken it would be as wide as a window, or cut.
        super().setText(_LONG_WORD.sub(_with_breaks, UNITS.told(plain_lines(self.sentence))))
        super().setToolTip(plain_tip(UNITS.told(self._tip)))
