"""Where answers are kept while a study runs, and the store in memory; that in a file imports h5py."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from . import _layout as layout
from ._axes import Grid
from ._columns import Cell, Column
from ._layout import PointState
from ._point_scheduler import GridPlan

Arrays = dict[str, NDArray[np.generic]]


@dataclass(frozen=True)
class PointAnswer:
    """What is kept of one point."""

    number: int
    state: PointState
    cells: dict[str, Cell]
    """By column; what is absent stays missing."""
    taken_s: float = math.nan
    """Processor time, where it is known."""


def empty_arrays(plan: GridPlan) -> Arrays:
    """Make arrays in which every point is missing, shape (points,) or (points, components)."""
    return {
        column.name: np.full(_shape(column, plan.grid), column.missing, column.dtype)
        for column in plan.columns
    }


def put(arrays: Arrays, columns: Sequence[Column], answer: PointAnswer) -> Iterator[tuple[Column, bytes]]:
    """Write an answer's cells into the arrays; each comes back as the bytes of the file.

    The state is not among them: it is written when the cells are safe.
    """
    for column in columns:
        if column.name in answer.cells:
            values = arrays[column.name]
            values[answer.number] = answer.cells[column.name]
            # A slice: numpy strips the padding of a single text.
            yield column, values[answer.number : answer.number + 1].tobytes()


def _shape(column: Column, grid: Grid) -> tuple[int, ...]:
    return (grid.size,) if column.components == 1 else (grid.size, column.components)


def is_failed(state: NDArray[np.uint8] | PointState) -> NDArray[np.bool_]:
    """Whether there is an error for an answer, or a run that did not reach its end."""
    return np.isin(state, (PointState.STOPPED, PointState.FAILED))


def states(arrays: Mapping[str, NDArray[np.generic]]) -> NDArray[np.uint8]:
    """State of every point, shape (points,)."""
    return np.asarray(arrays[layout.STATE], dtype=np.uint8)


class Store(Protocol):
    """Keeps answers. What it holds at first needs no computing."""

    @property
    def arrays(self) -> Arrays:
        """Everything kept so far; not to be written to."""

    def begin(self, executor: str) -> None:
        """Note that a session begins, and who computes in it."""

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Keep answers; when it returns they are as safe as they will be."""

    def fill(self, numbers: NDArray[np.int64], cells: Arrays) -> None:
        """Fill in many points that are not computed, by column; their state says so."""


class MemoryStore:
    """Keeps answers as long as the process lives."""

    def __init__(self, plan: GridPlan) -> None:
        self._arrays, self._columns = empty_arrays(plan), plan.columns

    @property
    def arrays(self) -> Arrays:
        """Everything kept so far."""
        return self._arrays

    def begin(self, executor: str) -> None:
        """Nobody asks a memory when it began."""

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Keep answers."""
        for answer in answers:
            for _ in put(self._arrays, self._columns, answer):
                pass
            self._arrays[layout.STATE][answer.number] = answer.state

    def fill(self, numbers: NDArray[np.int64], cells: Arrays) -> None:
        """Fill in many points that are not computed."""
        for name, values in cells.items():
            self._arrays[name][numbers] = values
        self._arrays[layout.STATE][numbers] = layout.PointState.FILLED
