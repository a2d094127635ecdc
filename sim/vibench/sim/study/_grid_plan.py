"""What is computed point by point and kept in one file: a plan whose points are a grid."""

from abc import ABC, abstractmethod
from typing import ClassVar, Self

from ..model.frozen_model import FrozenModel
from ._axes import Grid, StudyAxis, grid_of
from ._columns import Column


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

    def differences(self, other: Self) -> tuple[str, ...]:
        """Names of what differs between two plans."""
        mine, theirs = self.model_dump(mode="json"), other.model_dump(mode="json")
        return tuple(name for name in mine if mine[name] != theirs[name])
