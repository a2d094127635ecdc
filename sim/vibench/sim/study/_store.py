"""Store in memory for the results of a running study, and conversion of predictions to its values."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..engine.run import Accuracy, AccuracyWord, Outcome
from ..scene.prediction import Ensemble, FoundMotion, Method, MotionKind, ScenePrediction, StartMemory
from ..scene.shares import EscapeRate, Share
from ..specimen.stops import member
from . import _grid as layout

Arrays = dict[str, NDArray[np.generic]]


@dataclass(frozen=True)
class PointAnswer:
    """Result of one point, as it is stored."""

    number: int
    state: layout.PointState
    cells: dict[str, layout.Cell]
    """Values of the point by column name; columns without a value stay missing."""
    taken_s: float = math.nan
    """Processor time of the point [s]; NaN if unknown."""


def empty_arrays(plan: layout.GridPlan) -> Arrays:
    """Return arrays filled with missing values, shape (points,) or (points, components)."""
    return {
        column.name: np.full(_shape(column, plan.grid), column.missing, column.dtype)
        for column in plan.columns
    }


def write_cells(
    arrays: Arrays, plan: layout.GridPlan, answer: PointAnswer
) -> Iterator[tuple[layout.Column, bytes]]:
    """Write a result into the arrays; yield each changed column with its bytes for the file.

    The state is left out, because it must be written after all other values.
    """
    for column in plan.columns:
        is_digest = column.name == layout.DIGEST
        if is_digest or column.name in answer.cells:
            values = arrays[column.name]
            value = plan.digest_at(answer.number, arrays) if is_digest else answer.cells[column.name]
            values[answer.number] = value
            # Take a slice: from a single text, numpy would remove the padding.
            yield column, values[answer.number : answer.number + 1].tobytes()


def _shape(column: layout.Column, grid: layout.Grid) -> tuple[int, ...]:
    return (grid.size,) if column.components == 1 else (grid.size, column.components)


def is_failed(state: NDArray[np.uint8] | layout.PointState) -> NDArray[np.bool_]:
    """Return whether each scene raised an error or did not finish its run, shape of ``state``."""
    return np.isin(state, (layout.PointState.STOPPED, layout.PointState.FAILED))


def states(arrays: Mapping[str, NDArray[np.generic]]) -> NDArray[np.uint8]:
    """Return the state of every point, shape (points,)."""
    return np.asarray(arrays[layout.STATE], dtype=np.uint8)


class MemoryStore:
    """A store that keeps results in memory; points that already have a result are not computed again."""

    def __init__(self, plan: layout.GridPlan) -> None:
        self.arrays, self._plan = empty_arrays(plan), plan
        """Results stored so far; do not change them."""
        self._own_cells: dict[str, layout.Cell] = {}
        """Values that the store adds to every result."""

    def begin(self, executor: str) -> None:
        """Record the start of a session, with the executor's description; a memory has no sessions."""

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Store the results of points, first their numbers, then the states; return once they are safe."""
        for answer in answers:
            whole = replace(answer, cells={**answer.cells, **self._own_cells})
            for column, raw in write_cells(self.arrays, self._plan, whole):
                self._write(column.name, answer.number * len(raw), raw)
        self._sync()
        for answer in answers:
            self._write(layout.STATE, answer.number, bytes([answer.state]))
            self.arrays[layout.STATE][answer.number] = answer.state
        self._sync()

    def fill(self, numbers: NDArray[np.int64], cells: Arrays) -> None:
        """Store the interpolated points of a map, given by column, with the point state FILLED."""
        filled = np.full(len(numbers), layout.PointState.FILLED, np.uint8)
        for part in (cells, {layout.STATE: filled}):
            for name, values in part.items():
                self.arrays[name][numbers] = values
                self._write(name, 0, self.arrays[name].tobytes())
            self._sync()

    def _write(self, name: str, offset: int, raw: bytes) -> None:
        """Write bytes at an offset in a dataset of the file, if there is a file."""

    def _sync(self) -> None:
        """Wait until all written bytes are on the disk."""


Store = MemoryStore
"""Any store of results: in memory or, derived from it, in a file."""


def cells_of(prediction: ScenePrediction) -> dict[str, layout.Cell]:
    """Return the values to store for a prediction, except values that are not requested or not known."""
    return {
        **_cells_of(prediction, layout.NUMBERS),
        **_cells_of_ensemble(prediction.ensemble),
        layout.MOTION: list(MotionKind).index(prediction.motion),
        layout.MEMORY: list(StartMemory).index(prediction.memory),
        layout.METHOD: list(Method).index(prediction.method),
        layout.OUTCOME: int(prediction.outcome),
        layout.ENDED: cut_text(prediction.ended),
        layout.FINAL_STATE: prediction.final_state,
    }


def _cells_of(value: object, columns: Mapping[str, layout.Column]) -> dict[str, layout.Cell]:
    numbers = {column.name: getattr(value, field) for field, column in columns.items()}
    return {name: number for name, number in numbers.items() if number is not None}


def _cells_of_ensemble(ensemble: Ensemble | None) -> dict[str, layout.Cell]:
    """Return the values to store for an ensemble; columns of motions have one component per motion."""
    if ensemble is None:
        return {}
    kept = ensemble.motions[: layout.MOST_FOUND]
    cells = _cells_of(ensemble, layout.ENSEMBLE_NUMBERS)
    if ensemble.escape is not None:
        cells |= _cells_of(ensemble.escape, layout.ESCAPE_NUMBERS)
    cells[layout.FOUND_KIND.name] = _fill_places(
        layout.FOUND_KIND, [list(MotionKind).index(each.motion) for each in kept]
    )
    for field, column in layout.FOUND_NUMBERS.items():
        cells[column.name] = _fill_places(column, [getattr(each, field) for each in kept])
    for field, column in layout.FOUND_SHARE.items():
        cells[column.name] = _fill_places(column, [getattr(each.share, field) for each in kept])
    return cells


def _fill_places(column: layout.Column, values: list[float | None]) -> layout.Cell:
    """Return the components of a column, with the missing value for unknown or absent motions."""
    filled = [column.missing if value is None else value for value in values]
    return tuple(filled + [column.missing] * (layout.MOST_FOUND - len(filled)))  # type: ignore[arg-type]


def _ensemble_at(arrays: Arrays, number: int) -> Ensemble | None:
    """Return the ensemble of a point from the stored values; None if the point has no ensemble."""
    if _number(arrays[layout.STARTS][number]) is None:
        return None
    escape = _numbers_at(arrays, layout.ESCAPE_NUMBERS, number)
    kinds = arrays[layout.FOUND_KIND.name][number]
    return Ensemble(
        **_numbers_at(arrays, layout.ENSEMBLE_NUMBERS, number),
        motions=tuple(_motion_at(arrays, number, k) for k in range(layout.MOST_FOUND) if int(kinds[k]) >= 0),
        escape=None if escape["chaotic_s"] is None else EscapeRate(**escape),
    )


def _motion_at(arrays: Arrays, number: int, place: int) -> FoundMotion:
    return FoundMotion(
        **_numbers_at(arrays, layout.FOUND_NUMBERS, (number, place)),
        motion=list(MotionKind)[int(arrays[layout.FOUND_KIND.name][number, place])],
        share=Share(**_numbers_at(arrays, layout.FOUND_SHARE, (number, place))),
    )


def prediction_at(
    arrays: Arrays,
    number: int,
    frequency_hz: float,
    amplitude_m: float,
    accuracy: Accuracy | AccuracyWord,
    start: str,
) -> ScenePrediction:
    """Return the prediction of a point, from the stored values and the study.

    Parameters
    ----------
    arrays
        Columns of a study, each of shape (points,).
    number
        Number of the point.
    frequency_hz, amplitude_m, accuracy, start
        Parameters of this point in the study.
    """
    x, y, z, vx, vy, vz = (float(value) for value in arrays[layout.FINAL_STATE][number].astype(np.float64))
    return ScenePrediction(
        **_numbers_at(arrays, layout.NUMBERS, number),
        frequency_hz=frequency_hz,
        amplitude_m=amplitude_m,
        motion=list(MotionKind)[int(arrays[layout.MOTION][number])],
        method=list(Method)[int(arrays[layout.METHOD][number])],
        outcome=Outcome(int(arrays[layout.OUTCOME][number])),
        ended=bytes(arrays[layout.ENDED][number]).decode(errors="replace"),
        final_state=(x, y, z, vx, vy, vz),
        start=start,
        memory=list(StartMemory)[int(arrays[layout.MEMORY][number])],
        ensemble=_ensemble_at(arrays, number),
        accuracy=member(Accuracy, accuracy).value,
    )


def cut_text(text: str) -> bytes:
    """Return text as UTF-8 bytes, cut between two characters to fit the size of a column."""
    return text.encode()[: layout.TEXT_BYTES].decode(errors="ignore").encode()


def _numbers_at(
    arrays: Arrays, columns: Mapping[str, layout.Column], at: int | tuple[int, int]
) -> dict[str, Any]:
    """Return the values of a point or of one motion of the point, by field name; None for missing values."""
    return {field: _number(arrays[column.name][at]) for field, column in columns.items()}


def _number(cell: np.generic) -> float | int | None:
    value = cell.item()
    match value:
        case float():
            return value if np.isfinite(value) else None
        case int():
            return value if value >= 0 else None
        case _:
            raise TypeError(f"{value!r} is not a number")
