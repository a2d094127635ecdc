"""The answers of a study in memory: one array a column, over the study's axes."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import _layout as layout
from ._axes import Grid
from ._columns import Cell, Column
from ._grid_plan import GridPlan
from ._layout import PointState

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
