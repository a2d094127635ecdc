"""A number that a claim wants, with how far it may be off."""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidRequest


@dataclass(frozen=True)
class Expectation:
    """Bounds within which one measured number upholds a claim; both belong to it."""

    name: str
    """What is measured, in a few words."""
    unit: str
    """Empty for ratios and counts; ``"%"`` for shares, which are kept as fractions."""
    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            raise InvalidRequest(
                f"{self.name!r} wants {self.low:g} to {self.high:g}; give the lower bound first"
            )

    def is_met_by(self, value: float) -> bool:
        """Say whether a number lies within; nothing (NaN) meets nothing."""
        return self.low <= value <= self.high

    @property
    def sentence(self) -> str:
        """Say the bounds."""
        if math.isinf(self.high):
            return f"≥ {self.shown(self.low)}"
        if math.isinf(self.low):
            return f"≤ {self.shown(self.high)}"
        return f"{self.shown(self.low, '')} to {self.shown(self.high)}"

    def shown(self, value: float, unit: str | None = None) -> str:
        """Write a number with its unit."""
        if not np.isfinite(value):
            return "none"
        named = self.unit if unit is None else unit
        text = f"{100 * value:.0f}" if self.unit == "%" else f"{value:.4g}"
        return f"{text} {named}".rstrip()


def about(name: str, unit: str, value: float, within: float) -> Expectation:
    """Want a number, give or take a tolerance in its unit."""
    return Expectation(name, unit, value - within, value + within)


def at_least(name: str, unit: str, low: float) -> Expectation:
    """Want a number no smaller."""
    return Expectation(name, unit, low, math.inf)


def at_most(name: str, unit: str, high: float) -> Expectation:
    """Want a number no larger."""
    return Expectation(name, unit, -math.inf, high)
