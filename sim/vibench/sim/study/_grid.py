"""What varies in a study: named axes with their values, units and labels, in the order of the file.

The points of a study as places in a grid, and which of them lie side by side.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self

from ..model.frozen_model import FrozenModel
from ._columns import Column


@dataclass(frozen=True)
class Grid:
    """A grid of points, numbered with the last axis running fastest (C order)."""

    shape: tuple[int, ...]
    is_ordered: tuple[bool, ...]
    """Whether points side by side along an axis are alike: frequencies are, models are not."""

    @property
    def size(self) -> int:
        """How many points there are."""
        return math.prod(self.shape)

    def place(self, number: int) -> tuple[int, ...]:
        """Index of a point along each axis."""
        place = []
        for length in reversed(self.shape):
            number, index = divmod(number, length)
            place.append(index)
        return tuple(reversed(place))

    def neighbours(self, number: int) -> Iterator[int]:
        """Points one step away along the ordered axes."""
        stride, rest = 1, number
        for length, is_ordered in zip(reversed(self.shape), reversed(self.is_ordered), strict=True):
            rest, index = divmod(rest, length)
            if is_ordered:
                if index > 0:
                    yield number - stride
                if index < length - 1:
                    yield number + stride
            stride *= length


FREQUENCY = "frequency"
START = "start"
MODEL = "model"


@dataclass(frozen=True)
class StudyAxis:
    """One dimension of a study's arrays."""

    name: str
    values: tuple[float | str, ...]
    """Numbers ascending, or labels."""
    units: str
    """UDUNITS text; empty for labels."""
    long_name: str

    @property
    def is_ordered(self) -> bool:
        """Whether it holds numbers, whose neighbours are like each other."""
        return bool(self.units)


def grid_of(axes: tuple[StudyAxis, ...]) -> Grid:
    """Grid over these axes, the last one running fastest."""
    return Grid(tuple(len(axis.values) for axis in axes), tuple(axis.is_ordered for axis in axes))


class GridPlan(FrozenModel, ABC):
    """What is to be computed, completely: two equal plans have equal answers."""

    called: ClassVar[str]
    """How messages call such a plan."""
    format: ClassVar[str]
    """How its files call themselves."""

    @property
    @abstractmethod
    def axes(self) -> tuple[StudyAxis, ...]:
        """Dimensions of the results, in order."""

    @property
    @abstractmethod
    def columns(self) -> tuple[Column, ...]:
        """What is kept of each point."""

    @property
    def grid(self) -> Grid:
        """All points."""
        return grid_of(self.axes)

    def coordinates(self, number: int) -> dict[str, float | str]:
        """Values of the axes at a point."""
        place = self.grid.place(number)
        return {axis.name: axis.values[index] for axis, index in zip(self.axes, place, strict=True)}

    def differences(self, other: Self) -> tuple[str, ...]:
        """Names of what differs between two plans."""
        mine, theirs = self.model_dump(mode="json"), other.model_dump(mode="json")
        return tuple(name for name in mine if mine[name] != theirs[name])
