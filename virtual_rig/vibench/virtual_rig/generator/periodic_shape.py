"""Periodic shapes between -1 and 1 and their exact mean over any stretch of phase.

Phase is counted in cycles. A mean over a stretch of length zero is the value at that phase.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .arbitrary_memory import TOP_CODE, Codes

Samples = NDArray[np.float64]


class PeriodicShape(Protocol):
    """A waveform that repeats every cycle."""

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the means from phases ``start`` (0 <= start < 1) over ``span`` >= 0 cycles."""


@dataclass(frozen=True)
class Sine:
    """sin(2 pi phase)."""

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean: the sine at the middle, lowered by sinc(span)."""
        return np.asarray(np.sin(np.pi * (2 * start + span)) * np.sinc(span))


@dataclass(frozen=True)
class Flat:
    """Zero at every phase: the built-in DC shape, whose level is the offset alone."""

    def mean(self, start: Samples, span: Samples) -> Samples:  # noqa: ARG002 - every mean is zero
        """Return zeros."""
        return np.zeros_like(start)


@dataclass(frozen=True)
class Rectangle:
    """1 for the first ``duty`` of the cycle, then -1."""

    duty: float = 0.5

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean from the share of the stretch that lies in the high part."""
        end = start + span
        cycles = np.floor(end)
        high = cycles * self.duty + np.minimum(end - cycles, self.duty) - np.minimum(start, self.duty)
        stretch = end - start
        share = np.divide(high, stretch, out=np.zeros_like(stretch), where=stretch > 0)
        now = np.where(start < self.duty, 1.0, 0.0)
        return np.asarray(np.where(stretch > 0, 2 * np.clip(share, 0, 1) - 1, 2 * now - 1))


@dataclass(frozen=True)
class Triangle:
    """Rises from 0 to 1 in a quarter of a cycle, falls to -1, returns to 0: the ramp with 50 % symmetry."""

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean: the middle value where no corner lies inside, else from the integral."""
        begin = start + 0.25  # counted from the lowest point
        end = begin + span
        straight = np.floor(2 * begin) == np.floor(2 * end)
        middle = self._value(0.5 * (begin + end))
        area = self._integral(end) - self._integral(begin)
        return np.asarray(np.where(straight, middle, area / np.where(straight, 1.0, span)))

    @staticmethod
    def _value(phase: Samples) -> Samples:
        fraction = phase - np.floor(phase)
        return np.asarray(np.where(fraction < 0.5, 4 * fraction - 1, 3 - 4 * fraction))

    @staticmethod
    def _integral(phase: Samples) -> Samples:
        fraction = phase - np.floor(phase)
        rising = 2 * fraction**2 - fraction
        falling = 3 * fraction - 2 * fraction**2 - 1
        return np.asarray(np.where(fraction < 0.5, rising, falling))


@dataclass(frozen=True, eq=False)
class Table:
    """A waveform memory played with a zero-order hold: each point lasts 1/N of the cycle.

    Codes from 0 to ``top_code`` span -1..1. The integral is a cumulative sum of whole numbers, so means are
    exact but for one rounding.
    """

    codes: Codes
    top_code: int = TOP_CODE
    _sums: NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        sums = np.concatenate(([0], np.cumsum(self.codes, dtype=np.int64)))
        object.__setattr__(self, "_sums", sums)

    def mean(self, start: Samples, span: Samples) -> Samples:
        """Return the mean of the staircase, a piecewise linear function of both ends."""
        points = len(self.codes)
        begin = start * points
        end = begin + span * points
        first = np.floor(begin).astype(np.int64)
        last = np.floor(end).astype(np.int64)
        first_code = self.codes[first % points].astype(np.float64)
        last_code = self.codes[last % points].astype(np.float64)
        inside = self._sum(last) - self._sum(first + 1)
        area = (first + 1 - begin) * first_code + inside + (end - last) * last_code
        held = first == last
        mean_code = np.where(held, first_code, area / np.where(held, 1.0, end - begin))
        return np.asarray(2 * mean_code / self.top_code - 1)

    def _sum(self, points_passed: NDArray[np.int64]) -> NDArray[np.int64]:
        """Sum of all codes before a point, across as many cycles as needed."""
        cycles, rest = np.divmod(points_passed, len(self.codes))
        return np.asarray(cycles * self._sums[-1] + self._sums[rest])
