"""Content of a study's file: points on a grid over named axes, columns with units, and file layout.

``docs/studies.md`` describes the file for users of h5py, xarray or MATLAB.
"""

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..engine.run import Outcome
from ..scene.prediction import Method, MotionKind, StartMemory
from ..scene.scene import Given, Scene
from ..specimen.frozen_model import FrozenModel

FORMAT = "vibench-study"
FORMAT_VERSION = 2
"""Version of the file format; increased whenever older readers would misread the file."""
CONVENTIONS = "CF-1.11"
LIBVER = ("earliest", "v110")
"""HDF5 versions for which HDF5 writes superblock 0, which MATLAB and all readers since HDF5 1.8 support."""

STUDY = "study_json"
STATE = "state"
SESSIONS = "sessions"
N_SESSIONS = "n_sessions"
STATE_DTYPE = "u1"
COUNTER_DTYPE = "<i8"


class PointState(IntEnum):
    """State of a point, written to the file after the point's numbers."""

    MISSING = 0
    """The point has not been computed yet."""
    DONE = 1
    """The run of the point reached its end."""
    STOPPED = 2
    """The run of the point did not reach its end; ``outcome`` is the reason. Numbers may be NaN."""
    FAILED = 3
    """The scene of the point could not be computed; ``message`` is the reason. Numbers are NaN."""
    FILLED = 4
    """The point of a map was interpolated, not computed, because the neighbouring points agree."""


SESSION_COLUMNS = {"started_utc": 32, "software_json": 512, "executor": 160}
"""Columns of the table of sessions, and their sizes [bytes]. A session is a run or resumption of a study."""
MOST_SESSIONS = 1024
"""Number of rows of the table of sessions; all further sessions use the last row."""


Cell = float | int | bytes | tuple[float, ...]

REAL, WHOLE = "<f8", "<i4"
MISSING_WHOLE = -1
"""Value of a missing integer or flag; ``_FillValue`` in the CF conventions."""
COORDINATE = "coordinate"
COORDINATES = ("x", "y", "z", "vx", "vy", "vz")
FOUND_MOTION = "found_motion"
MOST_FOUND = 8
"""Largest number of motions stored for an ensemble, the most frequent first."""
IDENTITY_DIGITS = 32
TEXT_BYTES = 200
"""Longest stored text [bytes]; longer text is cut off."""

TAKEN, SESSION, MESSAGE, IDENTITY, DIGEST = "taken", "session", "message", "scene", "digest"
CONTINUES, PHASE, FINAL_STATE, OUTCOME = "continues", "drive_phase", "final_state", "outcome"
DURATION, MOTION, METHOD, ENDED = "duration", "motion", "method", "ended"
MEMORY, STARTS = "start_memory", "starts_followed"


@dataclass(frozen=True)
class Column:
    """Stored quantity, with one value or row per point."""

    name: str
    dtype: str
    units: str
    """Unit of the column as UDUNITS text; 1 for ratios and counts."""
    long_name: str
    meanings: tuple[str, ...] = ()
    """Meanings of the values 0, 1, 2, ... of a flag."""
    components: int = 1
    """Number of components per point; with several components, the array has an additional last axis."""
    along: str = COORDINATE
    """Name of the additional axis for the components."""

    @property
    def missing(self) -> float | int | bytes:
        """Value that marks a missing result in this column."""
        match self.dtype[:2]:
            case "<f":
                return math.nan
            case "<i":
                return MISSING_WHOLE
            case "u1":
                return int(PointState.MISSING)
            case _:
                return b""


def _meanings(kind: type[Enum]) -> tuple[str, ...]:
    """Return one word per member of an enum, as the CF conventions require for flags."""
    return tuple(member.name.lower() for member in kind)


NUMBERS = {
    "response_i": Column("response_i", REAL, "1", "largest displacement of m0 over the drive amplitude"),
    "response_ii": Column(
        "response_ii", REAL, "1", "displacement of m0 at the drive frequency over the drive amplitude"
    ),
    "relative_i": Column(
        "relative_i", REAL, "1", "largest displacement of m1 relative to m2 over the drive amplitude"
    ),
    "relative_ii": Column(
        "relative_ii", REAL, "1", "m1 relative to m2 at the drive frequency, over the drive amplitude"
    ),
    "impacts": Column("impacts", WHOLE, "1", "impacts within the window"),
    "impact_rate_hz": Column("impact_rate", REAL, "Hz", "impacts per second within the window"),
    "period": Column("period", WHOLE, "1", "drive periods after which the motion repeats"),
    "duration_s": Column(DURATION, REAL, "s", "duration of the run"),
    "window_s": Column("window", REAL, "s", "duration of the window at the end of the run"),
    "settled_s": Column("settled", REAL, "s", "time at which the motion was found to have settled"),
    "response_i_error": Column("response_i_error", REAL, "1", "estimated relative error of Response I"),
    "response_ii_error": Column("response_ii_error", REAL, "1", "estimated relative error of Response II"),
    "relative_i_error": Column("relative_i_error", REAL, "1", "estimated relative error of relative_i"),
    "relative_ii_error": Column("relative_ii_error", REAL, "1", "estimated relative error of relative_ii"),
    "error_estimate": Column("error_estimate", REAL, "1", "largest of the four responses' errors"),
    "integration_error": Column("integration_error", REAL, "1", "error that a higher accuracy would reduce"),
    "scatter": Column("scatter", REAL, "1", "relative standard deviation of Response I between windows"),
    "lyapunov_per_s": Column("lyapunov", REAL, "s-1", "largest Lyapunov exponent"),
    "lyapunov_error_per_s": Column("lyapunov_error", REAL, "s-1", "standard error of the largest exponent"),
}
"""Columns, keyed by the field of `ScenePrediction` that they store."""


def _of_motion(name: str, dtype: str, long_name: str, meanings: tuple[str, ...] = ()) -> Column:
    return Column(name, dtype, "1" if not meanings else "", long_name, meanings, MOST_FOUND, FOUND_MOTION)


FOUND_KIND = _of_motion("found_kind", WHOLE, "kind of this motion", _meanings(MotionKind))
FOUND_NUMBERS = {
    "period": _of_motion("found_period", WHOLE, "drive periods after which this motion repeats"),
    "response_i": _of_motion("found_response_i", REAL, "Response I of this motion"),
    "response_ii": _of_motion("found_response_ii", REAL, "Response II of this motion"),
    "relative_i": _of_motion("found_relative_i", REAL, "Response I of p in this motion"),
    "relative_ii": _of_motion("found_relative_ii", REAL, "Response II of p in this motion"),
    "error_estimate": _of_motion("found_error", REAL, "estimated relative error of this motion's responses"),
    "starts": _of_motion("found_starts", WHOLE, "number of starts that reach this motion"),
}
"""Columns, keyed by the field of `FoundMotion` that they store."""
FOUND_SHARE = {
    "share": _of_motion("found_share", REAL, "share of starts that reach this motion"),
    "low": _of_motion("found_share_low", REAL, "lower end of its interval"),
    "high": _of_motion("found_share_high", REAL, "upper end of its interval"),
}
"""Columns, keyed by the field of `Share` that they store."""
ENSEMBLE_NUMBERS = {
    "starts": Column(STARTS, WHOLE, "1", "number of starts with sensitive dependence on the start"),
    "requested_motion": Column("found_asked", WHOLE, "1", "index of the motion from the requested start"),
    "unseen_share": Column("unseen_share", REAL, "1", "upper bound on the share of any motion not found"),
    "scatter": Column("scatter_of_starts", REAL, "1", "relative standard deviation of Response I"),
    "followed_s": Column("followed_in_all", REAL, "s", "total simulated time of all starts"),
}
"""Columns, keyed by the field of `Ensemble` that they store."""
ESCAPE_NUMBERS = {
    "rate_per_s": Column("escape_rate", REAL, "s-1", "rate at which chaos dies out"),
    "low_per_s": Column("escape_rate_low", REAL, "s-1", "lower end of its interval"),
    "high_per_s": Column("escape_rate_high", REAL, "s-1", "upper end of its interval"),
    "escapes": Column("escapes", WHOLE, "1", "starts whose chaos died out"),
    "chaotic_s": Column("chaotic_time", REAL, "s", "total simulated time of all starts in chaos"),
}
"""Columns, keyed by the field of `EscapeRate` that they store."""
OTHERS = (
    Column(MOTION, WHOLE, "", "kind of the final motion", _meanings(MotionKind)),
    Column(MEMORY, WHOLE, "", "whether the start decides which motion is reached", _meanings(StartMemory)),
    Column(METHOD, WHOLE, "", "method of the prediction", _meanings(Method)),
    Column(OUTCOME, WHOLE, "", "how the run ended", _meanings(Outcome)),
    Column(ENDED, f"S{TEXT_BYTES}", "", "reason for the end of the run"),
    Column(FINAL_STATE, REAL, "m and m/s", "state at the end of the run", components=len(COORDINATES)),
    Column(PHASE, REAL, "rad", "phase of the drive when the run began"),
    Column(CONTINUES, WHOLE, "1", "number (from 0) of the point from which this point continues"),
    Column(TAKEN, REAL, "s", "processor time; missing if it includes loading of modules and tables"),
    Column(SESSION, WHOLE, "1", "row of the session that computed the point"),
    Column(IDENTITY, f"S{IDENTITY_DIGITS}", "", "digest of all values of the scene"),
    Column(MESSAGE, f"S{TEXT_BYTES}", "", "reason why the scene could not be computed"),
    Column(DIGEST, f"S{IDENTITY_DIGITS}", "", "digest of the plan and of all values of the point"),
    Column(STATE, STATE_DTYPE, "", "state of the point", _meanings(PointState)),
)
COLUMNS = (
    *NUMBERS.values(),
    *ENSEMBLE_NUMBERS.values(),
    *ESCAPE_NUMBERS.values(),
    FOUND_KIND,
    *FOUND_NUMBERS.values(),
    *FOUND_SHARE.values(),
    *OTHERS,
)


@dataclass(frozen=True)
class Grid:
    """Grid of points, numbered in C order: the index along the last axis changes fastest."""

    shape: tuple[int, ...]
    is_ordered: tuple[bool, ...]
    """Whether neighbours along each axis have similar results: True for frequencies, False for models."""

    @property
    def size(self) -> int:
        """Number of points of the grid."""
        return math.prod(self.shape)

    def place(self, number: int) -> tuple[int, ...]:
        """Return the index of a point along each axis, from its number."""
        return tuple(map(int, np.unravel_index(number, self.shape)))

    def neighbours(self, number: int) -> Iterator[int]:
        """Yield the numbers of the neighbouring points along the ordered axes."""
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
    """One axis of the result arrays of a study."""

    name: str
    values: tuple[float | str, ...]
    """Values of the axis: ascending numbers, or labels."""
    units: str
    """Unit of the axis as UDUNITS text; empty for labels."""
    long_name: str

    @property
    def is_ordered(self) -> bool:
        """Whether the values are numbers, so that neighbours along the axis have similar results."""
        return bool(self.units)


class GridPlan(FrozenModel, ABC):
    """Complete plan of a grid of points; equal plans give equal results."""

    called: ClassVar[str]
    """Name of this kind of plan in messages."""
    format: ClassVar[str]
    """Name of the file format for this kind of plan."""

    @property
    @abstractmethod
    def axes(self) -> tuple[StudyAxis, ...]:
        """Axes of the results, the slowest-varying first."""

    @property
    @abstractmethod
    def columns(self) -> tuple[Column, ...]:
        """Columns that the store keeps for each point."""

    @property
    def grid(self) -> Grid:
        """Grid of all points of the plan."""
        return Grid(
            tuple(len(axis.values) for axis in self.axes), tuple(axis.is_ordered for axis in self.axes)
        )

    @cached_property
    def text(self) -> str:
        """The plan as JSON text."""
        return self.model_dump_json()

    def digest_at(self, number: int, arrays: Mapping[str, NDArray[np.generic]]) -> bytes:
        """Return the digest of a point's number and plan, and of all values of the point except its state."""
        found = hashlib.sha256(f"{number} {self.text}".encode())
        for column in self.columns:
            if column.name not in (DIGEST, STATE):
                found.update(arrays[column.name][number : number + 1].tobytes())
        return found.hexdigest()[:IDENTITY_DIGITS].encode()

    @abstractmethod
    def scene(self, place: tuple[int, ...], start: Given, phase_rad: float = 0.0) -> Scene:
        """Return the scene at a position of the grid, from a given initial state.

        Raises ValueError when a scene with these values is not allowed.
        """

    @abstractmethod
    def first_scene(self, place: tuple[int, ...]) -> Scene:
        """Return the scene at a position of the grid that continues no other point."""

    @abstractmethod
    def label_after(self, place: tuple[int, ...], before: tuple[int, ...]) -> str:
        """Return the name of the initial state of a point that continues the point at ``before``."""

    @abstractmethod
    def frequency_at(self, place: tuple[int, ...]) -> float:
        """Return the drive frequency at a position of the grid [Hz]."""

    def phase_after(self, number: int, arrays: Mapping[str, NDArray[np.generic]]) -> float:
        """Return the drive phase [rad] at the end of a point's run, where the next point's run begins."""
        frequency_hz = self.frequency_at(self.grid.place(number))
        turns = math.fmod(frequency_hz * float(arrays[DURATION][number]), 1.0)
        return math.fmod(2.0 * math.pi * turns + float(arrays[PHASE][number]), 2.0 * math.pi)

    def coordinates(self, number: int) -> dict[str, float | str]:
        """Return the values of the axes at a point."""
        place = self.grid.place(number)
        return {axis.name: axis.values[index] for axis, index in zip(self.axes, place, strict=True)}

    def require_target_alone(self, *names: str) -> None:
        """Raise ValueError if one of these fields is given together with a target error or time."""
        for name in names:
            if getattr(self, name) != type(self).model_fields[name].default:
                raise ValueError(f"{name} was given with an error or a time, which sets it; leave out one")

    def differences(self, other: Self) -> tuple[str, ...]:
        """Return the names of the fields that differ between two plans."""
        mine, theirs = self.model_dump(mode="json"), other.model_dump(mode="json")
        return tuple(name for name in mine if mine[name] != theirs[name])
