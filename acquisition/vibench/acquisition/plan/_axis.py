"""The values that a sweep goes through along one axis: a list, or a range with equal steps or ratios."""

from enum import StrEnum
from math import floor
from typing import Annotated, Self, TypeAlias

from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from ..host.toml_file import FrozenModel

MOST_VALUES = 10_000
"""On one axis."""


class RangeSpacing(StrEnum):
    """How the values of a range lie."""

    LINEAR = "linear"
    """At equal distances."""
    LOGARITHMIC = "logarithmic"
    """At equal ratios; give ``count``."""


class Range(FrozenModel):
    """Values from ``start`` to ``stop``: ``step`` apart, or ``count`` of them."""

    start: PositiveFloat
    stop: PositiveFloat
    """The last value, if the steps land on it."""
    step: PositiveFloat | None = None
    count: PositiveInt | None = Field(default=None, ge=2, le=MOST_VALUES)
    spacing: RangeSpacing = RangeSpacing.LINEAR

    @model_validator(mode="after")
    def _rises_in_one_way(self) -> Self:
        if self.stop <= self.start:
            raise ValueError(
                f"stop = {self.stop:g} is not above start = {self.start:g}; give the range from low to "
                "high and choose the way through it with direction"
            )
        if (self.step is None) == (self.count is None):
            raise ValueError("give either step or count, and not both")
        if self.step is not None and self.spacing is RangeSpacing.LOGARITHMIC:
            raise ValueError("logarithmic values have no common step; give count")
        if self._count() > MOST_VALUES:
            raise ValueError(f"the range has {self._count()} values, allowed are {MOST_VALUES}: widen step")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The values, rising."""
        count = self._count()
        match self.spacing:
            case RangeSpacing.LINEAR:
                step = self.step or (self.stop - self.start) / (count - 1)
                return tuple(round(self.start + number * step, 9) for number in range(count))
            case RangeSpacing.LOGARITHMIC:
                ratio = self.stop / self.start
                return tuple(self.start * ratio ** (number / (count - 1)) for number in range(count))

    def _count(self) -> int:
        if self.step is None:
            return self.count or 0
        # 1e-9: a stop that the steps reach but for rounding belongs to the range.
        return floor((self.stop - self.start) / self.step + 1e-9) + 1


Values: TypeAlias = Annotated[tuple[PositiveFloat, ...], Field(min_length=1, max_length=MOST_VALUES)] | Range
"""What a file gives for an axis: a list, or a table with start, stop and step or count."""


def values_of(given: Values) -> tuple[float, ...]:
    """Give the values of an axis: a range's rising, a list's as they stand."""
    return given.values if isinstance(given, Range) else given
