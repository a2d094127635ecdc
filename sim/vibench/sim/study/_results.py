"""What a study has found so far: arrays over its axes, NaN where nothing is known, and states."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic

import numpy as np
from numpy.typing import NDArray

from ..model.arrays import Floats
from ..scene.prediction import ScenePrediction
from ._answers import prediction_at
from ._axes import StudyAxis
from ._columns import CONTINUES, ENDED, MESSAGE
from ._errors import InvalidStudy
from ._expansion import continued_from
from ._file_reading import Plan, Session, read_arrays, read_plan, read_sessions
from ._layout import PointState
from ._store import Arrays, states
from ._study import GivenStart, Start, Study

Value = float | str
SHOWN_VALUES = 8
"""Values of an axis that a message lists."""
SAME = 1e-9
"""A number this close to a value of an axis, relatively, means that value."""


@dataclass(frozen=True, eq=False)
class GridResults(Generic[Plan]):
    """Everything that is known of a plan. Axes in the order of ``plan.axes``."""

    plan: Plan
    arrays: Mapping[str, NDArray[np.generic]]
    """One row a point, by column; as the file holds them."""
    sessions: tuple[Session, ...] = ()
    """Who computed, and when; empty for a study that was kept in memory."""

    @property
    def axes(self) -> tuple[StudyAxis, ...]:
        """Dimensions of the arrays."""
        return self.plan.axes

    @property
    def state(self) -> NDArray[np.uint8]:
        """A `JournalPointState` for each point, over all axes."""
        return states(self.arrays).reshape(self.plan.grid.shape)

    @property
    def is_complete(self) -> bool:
        """Whether every point has an answer, good or bad."""
        return bool(np.all(states(self.arrays) != PointState.MISSING))

    @property
    def kept(self) -> int:
        """How many points have an answer, good or bad."""
        return int(np.count_nonzero(states(self.arrays) != PointState.MISSING))

    def values(self, name: str, **fixed: Value) -> Floats:
        """One quantity over the axes, NaN where it is not known.

        Parameters
        ----------
        name
            A column, such as ``"response_i"``; numbers only.
        **fixed
            Axes that take one value and vanish: ``amplitude=5e-6, model="hertz"``.

        Raises
        ------
        InvalidStudy
            When there is no such column, axis or value.

        """
        columns = {
            column.name: column for column in self.plan.columns if np.dtype(column.dtype).kind in "fiu"
        }
        if name not in columns:
            raise InvalidStudy(
                f"{name!r} is no quantity of a {self.plan.called}; there are {', '.join(columns)}."
            )
        column = columns[name]
        rows = self.arrays[name].astype(np.float64)
        if np.dtype(column.dtype).kind == "i":
            rows[self.arrays[name] == column.missing] = np.nan
        shape = self.plan.grid.shape
        whole = rows.reshape(shape if column.components == 1 else (*shape, column.components))
        return np.asarray(whole[self._place(fixed)])

    def failures(self) -> Iterator[tuple[dict[str, Value], str]]:
        """Where, and why, there is no answer: the scene could not be computed, or its run was lost."""
        state = states(self.arrays)
        for number in np.flatnonzero((state == PointState.STOPPED) | (state == PointState.FAILED)):
            why = ENDED if state[number] == PointState.STOPPED and ENDED in self.arrays else MESSAGE
            yield self.coordinates(int(number)), bytes(self.arrays[why][number]).decode()

    def coordinates(self, number: int) -> dict[str, Value]:
        """Values of the axes at a point."""
        place = self.plan.grid.place(number)
        return {axis.name: axis.values[index] for axis, index in zip(self.axes, place, strict=True)}

    def _place(self, fixed: Mapping[str, Value]) -> tuple[int | slice, ...]:
        unknown = sorted(fixed.keys() - {axis.name for axis in self.axes})
        if unknown:
            names = ", ".join(axis.name for axis in self.axes)
            raise InvalidStudy(f"{unknown[0]!r} is no axis of this {self.plan.called}; there are {names}.")
        return tuple(
            _index(axis, fixed[axis.name]) if axis.name in fixed else slice(None) for axis in self.axes
        )


@dataclass(frozen=True, eq=False)
class StudyResults(GridResults[Study]):
    """Everything that is known of a study."""

    @property
    def study(self) -> Study:
        """What was asked for."""
        return self.plan

    def predictions(self) -> Iterator[ScenePrediction]:
        """Give the answers of all points that were computed, in the order of the arrays."""
        state = states(self.arrays)
        for number in np.flatnonzero((state == PointState.DONE) | (state == PointState.STOPPED)):
            yield self._prediction(int(number))

    def _prediction(self, number: int) -> ScenePrediction:
        place = self.study.grid.place(number)
        before = int(self.arrays[CONTINUES][number])
        frequencies_hz = self.study.frequencies_hz
        start = self.study.starts[place[-2]]
        match start:
            case GivenStart():
                name = start.label
            case _ if before >= 0:
                name = continued_from(frequencies_hz[self.study.grid.place(before)[-1]])
            case _:
                name = Start.REST.value
        return prediction_at(
            dict(self.arrays),
            number,
            frequencies_hz[place[-1]],
            self.study.amplitudes_m[place[-3]],
            self.study.accuracy,
            name,
        )


def open_study(path: Path | str) -> StudyResults:
    """Read a study's file, finished or growing.

    Raises
    ------
    StudyError
        When it is no study's file, or another version's.

    """
    path = Path(path)
    study = read_plan(path, Study)
    return StudyResults(study, read_arrays(path, study), read_sessions(path, Study))


def results_of(study: Study, arrays: Arrays) -> StudyResults:
    """Give what a store in memory holds."""
    return StudyResults(study, {name: values.copy() for name, values in arrays.items()})


def _index(axis: StudyAxis, value: Value) -> int:
    for index, each in enumerate(axis.values):
        if _is_same(each, value):
            return index
    shown = ", ".join(str(each) for each in axis.values[:SHOWN_VALUES])
    more = ", …" if len(axis.values) > SHOWN_VALUES else ""
    raise InvalidStudy(f"{value!r} is no {axis.name} here; there are {shown}{more}.")


def _is_same(here: Value, asked: Value) -> bool:
    match here, asked:
        case float(), float():
            return abs(here - asked) <= SAME * abs(here)
        case _:
            return here == asked
