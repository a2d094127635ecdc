"""Results of a study so far: point states, and arrays over the axes, with NaN for unknown numbers."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from ..scene.prediction import ScenePrediction
from ..specimen.frozen_model import count_text
from ..specimen.specimen import Floats
from ..specimen.toml_table import fault_in_words
from . import _grid as layout
from ._errors import InvalidStudy, StudyError
from ._executor import software
from ._grid import (
    CONTINUES,
    DURATION,
    ENDED,
    MESSAGE,
    MISSING_WHOLE,
    PHASE,
    SESSION,
    GridPlan,
    PointState,
    StudyAxis,
)
from ._store import Arrays, empty_arrays, prediction_at, states
from ._study import (
    GivenStart,
    Start,
    Study,
)

if TYPE_CHECKING:
    import h5py

Plan = TypeVar("Plan", bound=GridPlan)


@dataclass(frozen=True)
class Session:
    """One session of a study: its first run, or a resumption."""

    started_utc: str
    software_json: str
    executor: str


def read_plan(path: Path, kind: type[Plan]) -> Plan:
    """Return the plan of a file; raise StudyError if the file does not contain this ``kind`` of plan."""
    with _open_store(path, kind) as file:
        return _plan(file, kind)


def read_arrays(path: Path, plan: GridPlan) -> Arrays:
    """Return all columns of a file, each of shape (points, ...); points without a result are missing.

    Raises StudyError when the file cannot be read, or contains another kind of plan.
    """
    with _open_store(path, type(plan)) as file:
        _require_layout(file, plan)
        arrays = _arrays(file, plan)
        _require_own_points(plan, arrays, _sessions(file))
        return arrays


def read_sessions(path: Path, kind: type[GridPlan]) -> tuple[Session, ...]:
    """Return the sessions recorded in a file: time, software and executor of each session."""
    with _open_store(path, kind) as file:
        return _sessions(file)


def _sessions(file: "h5py.File") -> tuple[Session, ...]:
    group = file[layout.SESSIONS]
    rows = range(int(group[layout.N_SESSIONS][0]))
    columns = [group[name][:] for name in layout.SESSION_COLUMNS]
    return tuple(Session(*(bytes(column[row]).decode() for column in columns)) for row in rows)


def _require_layout(file: "h5py.File", plan: GridPlan) -> None:
    """Raise ValueError unless the axes and columns of a file match the plan in the file."""
    for axis in plan.axes:
        kept = [each.decode() if isinstance(each, bytes) else each for each in file[axis.name][...].tolist()]
        if kept != list(axis.values):
            raise ValueError(f"the values of its axis {axis.name} do not match its {plan.called}")
    for column in _stored_columns(file, plan):
        dataset = file[column.name]
        shape = plan.grid.shape if column.components == 1 else (*plan.grid.shape, column.components)
        is_plain = getattr(dataset, "shape", None) == shape and dataset.dtype == np.dtype(column.dtype)
        if not is_plain or dataset.id.get_offset() is None:
            raise ValueError(f"its column {column.name} has another size, type or storage")


def _stored_columns(file: "h5py.File", plan: GridPlan) -> list[layout.Column]:
    """Return the columns in a file; files of earlier versions have no digests of points."""
    return [each for each in plan.columns if each.name != layout.DIGEST or each.name in file]


CHECKED = 2000
"""Approximate number of points whose digests are checked when a file is opened; the check takes 0.05 s."""


def _require_own_points(plan: GridPlan, arrays: Arrays, sessions: tuple[Session, ...]) -> None:
    """Raise ValueError if a result is impossible, was changed, or belongs to another point or plan.

    Digests are checked for some of the points that this version has computed, evenly spread.
    """
    state = states(arrays)
    done = np.flatnonzero(state == PointState.DONE)
    for column in plan.columns:
        values: NDArray[Any] = arrays[column.name][done]
        lowest = 0 if column.meanings and column.components == 1 else MISSING_WHOLE
        if column.meanings and not np.all((values >= lowest) & (values < len(column.meanings))):
            raise ValueError(f"its column {column.name} has a value without a meaning")
        if column.name in ("response_i", DURATION, PHASE) and not np.all(np.isfinite(values)):
            raise ValueError(f"a number is missing in its column {column.name}")
    before = arrays[CONTINUES].astype(np.int64)
    if np.any(state >= len(PointState)) or np.any(before >= plan.grid.size):
        raise ValueError("it refers to states or points that do not exist")
    own = [row for row, each in enumerate(sessions) if each.software_json == software()]
    known = done[np.isin(arrays[SESSION][done], own)]
    for number in known[:: max(1, len(known) // CHECKED)].tolist():
        digest = bytes(arrays[layout.DIGEST][number])
        if digest and digest != plan.digest_at(number, arrays):
            raise ValueError(f"point {number} has other values than those computed")


def offsets_of(path: Path, plan: GridPlan) -> dict[str, int]:
    """Return the position in the file [bytes] of every dataset written during a run, by dataset name."""
    sessions = (f"{layout.SESSIONS}/{name}" for name in (*layout.SESSION_COLUMNS, layout.N_SESSIONS))
    with _open_store(path, type(plan)) as file:
        names = (*(column.name for column in _stored_columns(file, plan)), *sessions)
        return {name: int(file[name].id.get_offset()) for name in names}


def _arrays(file: "h5py.File", plan: GridPlan) -> Arrays:
    # Read the states first: if results arrive while reading, they are then ignored in all columns.
    state = file[layout.STATE][...].reshape(-1)
    is_missing = state == PointState.MISSING
    arrays: Arrays = {**empty_arrays(plan), layout.STATE: state}
    for column in _stored_columns(file, plan):
        if column.name != layout.STATE:
            whole = file[column.name][...]
            rows = whole.reshape(len(state), *((column.components,) if column.components > 1 else ()))
            rows[is_missing] = column.missing
            arrays[column.name] = rows
    return arrays


@contextmanager
def _open_store(path: Path, kind: type[GridPlan]) -> Iterator["h5py.File"]:
    # Import here, because results in memory do not need h5py.
    from ..hdf5_files import UNREADABLE, UnsafeHdf5, open_hdf5, system_error  # noqa: PLC0415

    wanted = f"give the path of a {kind.called}'s file"
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist, or is not a file"
        raise StudyError(f"{path} {what}; {wanted}.")
    try:
        # Use HDF5's default lock, which is compatible with the writer's lock. If this process has already
        # opened the file, for example through xarray, HDF5 refuses another type of lock.
        file = open_hdf5(path)
    except UnsafeHdf5 as error:
        raise StudyError(f"{path} was not read: {error}") from error
    except OSError as error:
        if reason := system_error(error):
            raise StudyError(
                f"{path} could not be read ({reason}). The file may be intact: check the disk, and try again."
            ) from error
        raise StudyError(f"{path} is not a readable HDF5 file ({error}); {wanted}.") from error
    with file:
        try:
            _require_ours(path, file, kind)
            yield file
        except (*UNREADABLE, IndexError) as error:
            raise StudyError(
                f"{path} is damaged, changed by another program, or of another vibench version: {error}. "
                f"Restore a copy, or compute the {kind.called} again."
            ) from error


def _require_ours(path: Path, file: "h5py.File", kind: type[GridPlan]) -> None:
    found = file.attrs.get("format")
    if not (isinstance(found, bytes) and found.decode() == kind.format):
        raise StudyError(
            f"{path} is HDF5, but not the file of a {kind.called}; give the path of a {kind.called}'s file."
        )
    version = int(file.attrs["format_version"])
    if version != layout.FORMAT_VERSION:
        raise StudyError(
            f"{path} has format version {version}; this version of vibench reads version "
            f"{layout.FORMAT_VERSION}. Use the version that wrote the file."
        )


def _plan(file: "h5py.File", kind: type[Plan]) -> Plan:
    text = np.asarray(file[layout.STUDY][()]).item()
    try:
        return kind.model_validate_json(text)
    except ValidationError as error:
        raise ValueError(f"its {kind.called}: {fault_in_words(error.errors()[0])}") from error


Value = float | str
SHOWN_VALUES = 8
"""Largest number of values of an axis that a message lists."""
SAME = 1e-9
"""Relative tolerance within which a requested number counts as a value of an axis."""


@dataclass(frozen=True, eq=False)
class GridResults(Generic[Plan]):
    """Results of a plan, over axes in the order of ``plan.axes``."""

    plan: Plan
    arrays: Mapping[str, NDArray[np.generic]]
    """Columns by name, with one row per point as in the file."""
    sessions: tuple[Session, ...] = ()
    """Sessions in which the results were computed; empty if the study is only in memory."""

    @property
    def axes(self) -> tuple[StudyAxis, ...]:
        """Axes of the result arrays."""
        return self.plan.axes

    @property
    def state(self) -> NDArray[np.uint8]:
        """State of each point (`PointState`), over all axes."""
        return states(self.arrays).reshape(self.plan.grid.shape)

    @property
    def is_complete(self) -> bool:
        """Whether every point has a result or an error."""
        return bool(np.all(states(self.arrays) != PointState.MISSING))

    @property
    def done(self) -> int:
        """Number of points with a result or an error."""
        return int(np.count_nonzero(states(self.arrays) != PointState.MISSING))

    def target_text(self, error: float | None) -> str:
        """State how many computed points reached a target error; empty if no error was requested."""
        if error is None:
            return ""
        errors = self.values("error_estimate")[self.state == PointState.DONE]
        met, points = int(np.count_nonzero(errors <= error)), count_text(errors.size, "point")
        text = f"{met} of {points} reached an error of {100.0 * error:g} %."
        if met == errors.size:
            return text
        known = errors[np.isfinite(errors)]
        largest = f"{float(f'{100.0 * known.max():.2g}'):g} %" if known.size == errors.size else "not known"
        return f"{text} The largest error is {largest}; predict one point to see whether more time helps."

    def values(self, name: str, **fixed: Value) -> Floats:
        """Return one quantity over the axes that are not fixed; unknown numbers are NaN.

        Raises InvalidStudy when there is no such column, axis or value.

        Parameters
        ----------
        name
            Name of a numeric column, such as ``"response_i"``.
        **fixed
            Values of the axes that are fixed and left out of the result: ``amplitude=5e-6, model="hertz"``.
        """
        columns = {
            column.name: column for column in self.plan.columns if np.dtype(column.dtype).kind in "fiu"
        }
        if name not in columns:
            raise InvalidStudy(
                f"{name!r} is not a quantity of a {self.plan.called}; give one of {', '.join(columns)}."
            )
        column = columns[name]
        rows = self.arrays[name].astype(np.float64)
        if np.dtype(column.dtype).kind == "i":
            rows[self.arrays[name] == column.missing] = np.nan
        shape = self.plan.grid.shape
        whole = rows.reshape(shape if column.components == 1 else (*shape, column.components))
        return np.asarray(whole[self._place(fixed)])

    def failures(self) -> Iterator[tuple[dict[str, Value], str]]:
        """Yield coordinates and reason of each failure: a forbidden scene, or a run that did not finish."""
        state = states(self.arrays)
        for number in np.flatnonzero((state == PointState.STOPPED) | (state == PointState.FAILED)):
            why = ENDED if state[number] == PointState.STOPPED and ENDED in self.arrays else MESSAGE
            yield self.plan.coordinates(int(number)), bytes(self.arrays[why][number]).decode(errors="replace")

    def _place(self, fixed: Mapping[str, Value]) -> tuple[int | slice, ...]:
        unknown = sorted(fixed.keys() - {axis.name for axis in self.axes})
        if unknown:
            names = ", ".join(axis.name for axis in self.axes)
            raise InvalidStudy(
                f"{unknown[0]!r} is not an axis of this {self.plan.called}; give one of {names}."
            )
        return tuple(
            _index(axis, fixed[axis.name]) if axis.name in fixed else slice(None) for axis in self.axes
        )


@dataclass(frozen=True, eq=False)
class StudyResults(GridResults[Study]):
    """Results of a study, over the study's axes."""

    @property
    def study(self) -> Study:
        """The study to which the results belong."""
        return self.plan

    def predictions(self) -> Iterator[ScenePrediction]:
        """Yield the predictions of all computed points, in the order of the arrays."""
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
                name = self.study.label_after(place, self.study.grid.place(before))
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
    """Return the results in the file of a study that is complete or still being computed.

    Raises StudyError if the file does not contain a study, or has another format version.
    """
    path = Path(path)
    study = read_plan(path, Study)
    return StudyResults(study, read_arrays(path, study), read_sessions(path, Study))


def results_of(study: Study, arrays: Arrays) -> StudyResults:
    """Return the results of a study in memory."""
    return StudyResults(study, {name: values.copy() for name, values in arrays.items()})


def _index(axis: StudyAxis, value: Value) -> int:
    if value in axis.values:
        return axis.values.index(value)
    close = [
        index
        for index, each in enumerate(axis.values)
        if isinstance(each, float) and isinstance(value, float) and abs(each - value) <= SAME * abs(each)
    ]
    if len(close) == 1:
        return close[0]
    known = [axis.values[index] for index in close] or axis.values
    shown = ", ".join(str(each) for each in known[:SHOWN_VALUES])
    more = ", …" if len(known) > SHOWN_VALUES else ""
    matches = "several values" if close else "no value"
    raise InvalidStudy(f"{value!r} matches {matches} of {axis.name}; give one of {shown}{more}.")
