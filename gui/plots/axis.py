"""Axes with their unit in the label, no prefixes of their own, and 1-2-5 ticks where they are logarithmic."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from math import ceil, floor, log10

import pyqtgraph as pg
from PySide6.QtWidgets import QGraphicsItem


class Scale(Enum):
    """How values are laid out along an axis."""

    LINEAR = auto()
    LOGARITHMIC = auto()


@dataclass(frozen=True)
class Axis:
    """What an axis shows."""

    label: str
    unit: str = ""
    """As written on the label."""
    factor: float = 1.0
    """Shown value per plotted value: 1e6 shows metres as micrometres."""
    scale: Scale = Scale.LINEAR

    @property
    def text(self) -> str:
        """Label and unit."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


FREQUENCY = Axis("Frequency", "Hz")
LOG_FREQUENCY = Axis("Frequency", "Hz", scale=Scale.LOGARITHMIC)
TIME = Axis("Time", "s")


class AxisItem(pg.AxisItem):  # type: ignore[misc] # untyped library
    """An axis of a plot; in logarithmic mode positions are powers of ten."""

    def __init__(self, orientation: str, axis: Axis) -> None:
        super().__init__(orientation)
        self.enableAutoSIPrefix(False)
        self.setLabel(axis.text)
        self._factor = axis.factor
        # Painted when it changes, and copied otherwise: its text is the dearest part of a frame.
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)

    def show_unit(self, axis: Axis) -> None:
        """Change what the axis shows."""
        self.setLabel(axis.text)
        self._factor = axis.factor
        self.picture = None
        self.update()

    def tickValues(self, low: float, high: float, size: float) -> list[tuple[float, list[float]]]:
        """Choose the places of ticks: major ones carry a label, minor ones do not."""
        if not self.logMode:
            factor = self._factor
            # The labelled level alone: each line of a grid costs time in every frame.
            step, values = super().tickValues(low * factor, high * factor, size)[0]
            return [(step / factor, [value / factor for value in values])]
        shift = log10(self._factor)
        ticks = logarithmic_ticks(low + shift, high + shift)
        return [(step, [value - shift for value in values]) for step, values in ticks]

    def tickStrings(self, values: Sequence[float], scale: float, spacing: float) -> list[str]:
        """Write the labels of ticks."""
        if not self.logMode:
            factor = self._factor
            return list(super().tickStrings([v * factor for v in values], scale, spacing * factor))
        return [number_text(10**value * self._factor) for value in values]


def logarithmic_ticks(low: float, high: float) -> list[tuple[float, list[float]]]:
    """Places of ticks between two powers of ten: 1-2-5 over decades, evenly spaced numbers within one."""
    if high - low < 1.0:
        return [(0.1, _even(10**low, 10**high))]
    decades = range(floor(low), ceil(high) + 1)
    few = 5.0
    mantissas = (1, 2, 5) if high - low < few else (1,)
    major = [log10(m) + d for d in decades for m in mantissas if low <= log10(m) + d <= high]
    minor = [
        log10(m) + d
        for d in decades
        for m in range(1, 10)
        if m not in mantissas and low <= log10(m) + d <= high
    ]
    return [(1.0, major), (0.1, minor)]


def _even(low: float, high: float) -> list[float]:
    """Powers of round numbers at equal distances."""
    rough = (high - low) / 6
    decade = 10 ** floor(log10(rough))
    step = next(m * decade for m in (1, 2, 5, 10) if m * decade >= rough)
    edge = 1e-9  # An end that is a round number but for rounding gets its tick.
    first, last = ceil(low / step - edge), floor(high / step + edge)
    return [log10(n * step) for n in range(first, last + 1) if n > 0]


def number_text(value: float) -> str:
    """Write a number for a tick: 10, 100, 1k, 20k; powers of ten where zeros would be counted."""
    smallest, thousand, million = 1e-3, 1e3, 1e6
    if value == 0 or smallest <= abs(value) < thousand:
        return f"{value:.6g}"
    if thousand <= abs(value) < million:
        return f"{value / thousand:.6g}k"
    exponent = floor(log10(abs(value)) + 1e-9)
    mantissa = value / 10**exponent
    power = "10" + str(exponent).translate(_RAISED)
    return power if abs(mantissa - 1) < 1e-6 else f"{mantissa:.3g}·{power}"


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
