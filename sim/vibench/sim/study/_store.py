"""Where answers are kept while a study runs, and the store in memory; that in a file imports h5py."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from . import _layout as layout
from ._arrays import Arrays, PointAnswer, empty_arrays, put
from ._grid_plan import GridPlan


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
