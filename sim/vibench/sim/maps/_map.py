"""Plan of a map: fixed parameters, and one or two varying parameters."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from ..branches import random_state
from ..engine.run import Accuracy
from ..scene.prediction import MotionKind, ScenePrediction, state_of
from ..scene.scene import BUDGET_S, AutomaticDuration, Given, Observable, Rest, Scene, Target
from ..specimen.drive import Harmonic
from ..specimen.frozen_model import FrozenModel
from ..specimen.modes import modal_form
from ..specimen.specimen import Specimen, Triple
from ..specimen.specimen_description import ContactWord, SpecimenTable, usual_specimen
from ..study import (
    COLUMNS,
    MESSAGE,
    Cell,
    Column,
    GridPlan,
    InvalidStudy,
    Start,
    StudyAxis,
    TargetError,
    TargetTime,
)

KEPT = (
    "response_i",
    "response_ii",
    "relative_i",
    "relative_ii",
    "impact_rate",
    "period",
    "duration",
    "lyapunov",
    "lyapunov_error",
    "motion",
    "outcome",
    "final_state",
    "drive_phase",
    "continues",
    "taken",
    "session",
    "state",
)
"""Columns of a study that are also columns of a map."""
ERRORS = ("response_i_error", "response_ii_error", "relative_i_error", "relative_ii_error", "error_estimate")
"""Additional columns of a map with a target error or computing time."""
MESSAGE_BYTES = 100
ENERGY = Column("contact_energy", "<f8", "J", "largest energy that a stop has stored during the motion")
SECTION_STATES = 64
"""Largest number of states (one per drive period) stored for a motion, in a map along one quantity."""
SECTION_COLUMNS = tuple(
    Column(f"section_{name}", "<f8", "m", f"{what} once a drive period", (), SECTION_STATES, "drive_period")
    for name, what in (("x", "displacement of m0"), ("p", "displacement of m1 against m2"))
)
"""Columns of the states once per drive period, which only a map along one quantity stores."""
_OF_STUDIES = {column.name: column for column in COLUMNS}
_MAP_COLUMNS = (
    *(_OF_STUDIES[name] for name in KEPT[:-1]),
    ENERGY,
    replace(_OF_STUDIES[MESSAGE], dtype=f"S{MESSAGE_BYTES}"),
)


def columns_with(more: Sequence[Column]) -> tuple[Column, ...]:
    """Return all columns of a map; the digest and the state of a point are the last columns."""
    return (*_MAP_COLUMNS, *more, _OF_STUDIES["digest"], _OF_STUDIES["state"])


LONGER = 64
"""Factor in the motion labels kind * LONGER + period; larger than the longest detected period."""


_PERIODIC = list(MotionKind).index(MotionKind.PERIODIC)


def without_impacts(arrays: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return whether the motion of each point has the drive's period and no impacts, shape (points,)."""
    is_first = (arrays["motion"] == _PERIODIC) & (arrays["period"] == 1)
    return np.asarray(is_first & (arrays["impact_rate"] == 0.0))


def labels_of(arrays: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Return a label for kind and period of each motion; impact-free motion has a separate label."""
    motion, period = (arrays[name].astype(np.int64) for name in ("motion", "period"))
    return np.where(without_impacts(arrays), _PERIODIC * LONGER, motion * LONGER + period)


def contact_energy_j(specimen: Specimen, found: ScenePrediction) -> float | None:
    """Return the largest energy stored in a stop [J], from the penetration; None without elastic stops.

    Also None if the gaps differ and abs(p) exceeds the smaller gap: it is unknown which stop was reached.
    """
    stops = specimen.contact.stops
    if found.relative_i is None or stops.restitution is not None:
        return None
    if stops.linear_stiffness == stops.contact_stiffness == 0.0:
        return None
    depth = max(0.0, found.relative_i * found.amplitude_m - min(specimen.gaps_m))
    if depth > 0.0 and len(set(specimen.gaps_m)) > 1:
        return None
    return float(0.5 * stops.linear_stiffness * depth**2 + 0.4 * stops.contact_stiffness * depth**2.5)


def section_cells(found: ScenePrediction) -> dict[str, Cell]:
    """Return the section points to store: one period of a repeating motion, else `SECTION_STATES` points."""
    if found.section is None:
        return {}
    most = min(SECTION_STATES, found.period or SECTION_STATES)
    states = found.section[-most:]
    rows = {"section_x": states[:, 0], "section_p": states[:, 1] - states[:, 2]}
    nothing = (float("nan"),) * (SECTION_STATES - len(states))
    return {name: (*(float(each) for each in row), *nothing) for name, row in rows.items()}


@dataclass(frozen=True)
class Quantity:
    """Parameter of a scene that is fixed or varies in a map."""

    field: str
    """Name of the field of `Map` for this parameter."""
    axis: str
    """Name of the results' axis for this parameter."""
    units: str
    long_name: str


DRIVE = (
    Quantity("frequency_hz", "frequency", "Hz", "drive frequency"),
    Quantity("amplitude_m", "amplitude", "m", "amplitude of the base displacement"),
)
OF_SPECIMEN = (
    Quantity("gap_m", "gap", "m", "clearance at both stops"),
    Quantity("damping_time_s", "damping_time", "s", "damping over stiffness of every link"),
    Quantity("k0_n_per_m", "k0", "N m-1", "stiffness between base and m0"),
    Quantity("k1_n_per_m", "k1", "N m-1", "stiffness between m2 and m1"),
    Quantity("k2_n_per_m", "k2", "N m-1", "stiffness between m0 and m2"),
    Quantity("hertz_stiffness", "hertz_stiffness", "N m-1.5", "stiffness of the stops"),
)
START = tuple(
    Quantity(
        f"{symbol}{mass}_{suffix}", f"{symbol}{mass}", units, f"{what} of m{'xyz'.index(mass)} at the start"
    )
    for symbol, suffix, units, what in (("", "m", "m", "displacement"), ("v", "m_per_s", "m s-1", "velocity"))
    for mass in "xyz"
)
QUANTITIES = (*DRIVE, *OF_SPECIMEN, *START)


MOST_POINTS = 4_000_000
"""Largest number of points of a map; such a map takes 1 GB on the disk and 1 GB of memory."""
MOST_STEP = 16
"""Largest default spacing of the first lattice, in grid steps."""
FEWEST_STEPS = 8
"""Smallest number of intervals of the first lattice on an axis; with fewer, most cells are interpolated."""
STARTS = "start"
RANDOM = "random"


class Spacing(StrEnum):
    """Spacing of the values of a range."""

    LINEAR = "linear"
    LOGARITHMIC = "logarithmic"


class Range(FrozenModel):
    """Range of values."""

    start: float
    stop: float
    points: Annotated[int, Field(ge=2, le=100_000)]
    spacing: Spacing = Spacing.LINEAR

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        if not self.start < self.stop:
            raise ValueError(
                f"a range from {self.start:g} to {self.stop:g} does not ascend; give the lower end first"
            )
        if self.spacing is Spacing.LOGARITHMIC and self.start <= 0.0:
            raise ValueError(f"a logarithmic range cannot start at {self.start:g}; give a positive start")
        with np.errstate(over="ignore", invalid="ignore"):
            is_ascending = np.all(np.diff(self.values) > 0.0)
        if not is_ascending:
            raise ValueError(
                f"{self.points} points from {self.start!r} to {self.stop!r} are not all different numbers; "
                "give fewer points, or another range (this range is too narrow or too wide)"
            )
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """Ascending values, including both ends."""
        spaced = np.linspace if self.spacing is Spacing.LINEAR else np.geomspace
        return tuple(float(value) for value in spaced(self.start, self.stop, self.points))

    @property
    def edges(self) -> tuple[float, ...]:
        """Edges of the cells around the values; there is one more edge than values."""
        if self.spacing is Spacing.LINEAR:
            half = 0.5 * (self.stop - self.start) / (self.points - 1)
            return tuple(np.linspace(self.start - half, self.stop + half, self.points + 1).tolist())
        half = 0.5 * math.log(self.stop / self.start) / (self.points - 1)
        return tuple(
            np.geomspace(self.start * math.exp(-half), self.stop * math.exp(half), self.points + 1).tolist()
        )


class Refinement(StrEnum):
    """Which points of a map over two quantities are computed."""

    ADAPTIVE = "adaptive"
    """Points of a coarse lattice first, then points whose neighbours differ."""
    FULL = "full"
    """All points."""


Number = float | Range
Positive = PositiveFloat | Range


class Map(GridPlan):
    """Map of motions over two quantities or along one; one or two fields are a `Range`."""

    called: ClassVar[str] = "map"
    format: ClassVar[str] = "vibench-map"

    specimen: SpecimenTable = Field(default_factory=usual_specimen)
    """Name or path of a specimen, or a table that may name one in ``model``; by default the paper's."""
    model: ContactWord | None = None
    """Contact law; by default that of the specimen."""
    frequency_hz: Positive = 260.0
    """Drive frequency [Hz]."""
    amplitude_m: Positive = 5e-6
    """Amplitude of the base displacement [m]."""
    gap_m: Positive | None = None
    """Clearance at both stops [m]. The default of this and the next five fields is the specimen's value."""
    damping_time_s: NonNegativeFloat | Range | None = None
    """Damping over stiffness, c_i / k_i [s]."""
    k0_n_per_m: Positive | None = None
    """Stiffness between base and m0 [N/m]; c0 also changes if the specimen has a damping time."""
    k1_n_per_m: Positive | None = None
    """Stiffness between m2 and m1 [N/m]."""
    k2_n_per_m: Positive | None = None
    """Stiffness between m0 and m2 [N/m]."""
    hertz_stiffness: Positive | None = None
    """Hertz stiffness k of a stop, F = k d^(3/2) [N/m^1.5]."""
    x_m: Number = 0.0
    """Initial absolute displacement of m0; next fields: those of m1 and m2, then the velocities [m, m/s]."""
    y_m: Number = 0.0
    z_m: Number = 0.0
    vx_m_per_s: Number = 0.0
    vy_m_per_s: Number = 0.0
    vz_m_per_s: Number = 0.0
    chain: tuple[Literal[Start.UP, Start.DOWN], ...] = ()
    """Continue each point from the final state of the previous one: up, down, or both along the range."""
    random_starts: Annotated[int, Field(ge=0, le=1000)] = 0
    """Number of additional random initial states per point, to find coexisting motions and their shares."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the random initial states."""
    observe: Annotated[tuple[Literal[Observable.RESPONSE, Observable.LYAPUNOV], ...], Field(min_length=1)] = (
        Observable.RESPONSE,
    )
    """Observables. "lyapunov" is the largest Lyapunov exponent, averaged over up to 25 s at each point; it
    takes tens of times as long as the other observables."""
    accuracy: Accuracy = Accuracy.STANDARD
    """Accuracy level of each point."""
    error: TargetError | None = None
    """Target relative error of each point, such as 0.01 or "1 %"; replaces the accuracy level."""
    time_s: TargetTime | None = None
    """Limit of the computing time per point, such as 2 or "2 s"; one minute if only an error is given."""
    periods: Annotated[int, Field(ge=100, le=10_000_000)] = 3000
    """Length of the run, in drive periods, after which a motion counts as not repeating."""
    window_periods: Annotated[int, Field(ge=10)] = 200
    """Length of the response window of a motion that does not repeat, in drive periods."""
    refinement: Refinement = Refinement.ADAPTIVE
    """Which points of a map over two quantities are computed."""
    coarse: Annotated[int, Field(ge=2, le=64)] | None = None
    """Grid steps between the points computed first, 2 to 64; later halved down to 1. By default 16, or fewer
    to give each axis eight intervals. Points between equal neighbours are filled in."""

    @property
    def target(self) -> Target | None:
        """Target error and time of each point; None if neither is given."""
        return None if self.error is None and self.time_s is None else Target(self.error, self.time_s)

    @model_validator(mode="after")
    def _varies(self) -> Self:
        if self.target is not None:
            self.require_target_alone("accuracy")
        names = [each.field for each in self.varying]
        if len(names) not in (1, 2):
            have = f"{len(names)} were given: {', '.join(names)}" if names else "none was given"
            raise ValueError(
                f"a map needs one or two ranges, but {have}; give start, stop and points for one or two of "
                f"{', '.join(each.field for each in QUANTITIES)}"
            )
        if len(set(self.chain)) != len(self.chain):
            raise ValueError(f"chain = {', '.join(self.chain)} has a direction twice; give each once")
        if self.chain and any(each in START for each in self.varying):
            raise ValueError(f"chain starts at neighbouring points, but {names[0]} sets the start; omit one")
        if self.coarse is not None and self.coarse & (self.coarse - 1):
            raise ValueError(f"coarse = {self.coarse} is not a power of 2; give 2, 4, 8, 16, 32 or 64")
        if self.window_periods >= self.periods:
            raise ValueError(
                f"window_periods = {self.window_periods} is not below periods = {self.periods}; lower it"
            )
        if self.grid.size > MOST_POINTS:
            raise ValueError(f"{self.grid.size} points were requested; a map has at most {MOST_POINTS}")
        for corner in (0, self.grid.size - 1):
            self.scene(self.grid.place(corner))
        for quantity in self.varying:
            self._refuse_unless_felt(quantity)
        return self

    def _refuse_unless_felt(self, quantity: Quantity) -> None:
        """Raise ValueError for a range of a parameter that has no effect with the plan's contact law."""
        if quantity not in OF_SPECIMEN:
            return
        span = self.range_of(quantity)
        low, high = (
            self.model_copy(update={quantity.field: value}).scene((0, 0, 0)).specimen
            for value in (span.start, span.stop)
        )
        law = low.contact.kind
        if low == high or (law == "linear" and quantity.field == "gap_m"):
            raise ValueError(
                f"{quantity.field} varies, but has no effect with the contact law {law!r}; vary another "
                "quantity, or give another model"
            )

    @property
    def varying(self) -> tuple[Quantity, ...]:
        """The one or two varying quantities; the first is on the last axis of the results."""
        return tuple(each for each in QUANTITIES if isinstance(getattr(self, each.field), Range))

    def range_of(self, quantity: Quantity) -> Range:
        """Return the range of a varying quantity."""
        found = getattr(self, quantity.field)
        assert isinstance(found, Range), "only varying quantities have a range"
        return found

    @property
    def is_basin(self) -> bool:
        """Whether only the initial state varies over the map."""
        return all(each in START for each in self.varying)

    def require_kicks_allowed(self) -> None:
        """Raise InvalidStudy if drive or specimen vary, or if no motion attracts its neighbours."""
        if not self.is_basin:
            raise InvalidStudy("kicks need a map in which only the initial state varies")
        if modal_form(self.scene((0,) * len(self.grid.shape)).specimen).rates.real.max() >= 0.0:
            raise InvalidStudy("kicks need damping: without damping, no motion returns")

    @property
    def is_over_drive(self) -> bool:
        """Whether drive frequency and amplitude vary, so that levels of recordings can be overlaid."""
        return [each.axis for each in self.varying] == ["frequency", "amplitude"]

    @property
    def is_adaptive(self) -> bool:
        """Whether points may be interpolated: only if two quantities vary and no point continues another."""
        may_be = self.refinement is Refinement.ADAPTIVE and len(self.varying) == 2 and not self.chain
        return may_be and self.first_step > 1

    @property
    def first_step(self) -> int:
        """Grid steps between the points that are computed first; 1 if all points are computed."""
        if self.coarse is not None:
            return self.coarse
        fewest = min(self.range_of(each).points for each in self.varying)
        affordable = max(1, (fewest - 1) // FEWEST_STEPS)
        return min(MOST_STEP, 1 << (affordable.bit_length() - 1))

    @property
    def start_labels(self) -> tuple[str, ...]:
        """Names of the initial states from which each point is computed."""
        own = tuple(str(each) for each in self.chain) or (
            "given" if any(getattr(self, each.field) for each in START) else "rest",
        )
        return (*own, *(f"{RANDOM} {k + 1}" for k in range(self.random_starts)))

    @property
    def axes(self) -> tuple[StudyAxis, ...]:
        """Axes of the results: second varying quantity (if any), initial states, first varying quantity."""
        first, *second = (
            StudyAxis(each.axis, self.range_of(each).values, each.units, each.long_name)
            for each in self.varying
        )
        return (*second, StudyAxis(STARTS, self.start_labels, "", "state from which a point begins"), first)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns that the map stores: errors only with a target, section points only along one quantity."""
        errors = () if self.target is None else tuple(_OF_STUDIES[name] for name in ERRORS)
        return columns_with((*errors, *(SECTION_COLUMNS if len(self.varying) == 1 else ())))

    def scene(self, place: tuple[int, ...], start: Given | None = None, phase_rad: float = 0.0) -> Scene:
        """Return the scene at a grid position, from the plan's initial state or the given one.

        Raises ValueError when a scene with these values is not allowed.
        """
        numbers = self._numbers(place)
        frequency_hz = numbers["frequency_hz"]
        drive = Harmonic(frequency_hz, numbers["amplitude_m"], phase_rad)
        specimen = _specimen(
            self.specimen,
            self.model,
            numbers["damping_time_s"],
            numbers["gap_m"],
            (numbers["k0_n_per_m"], numbers["k1_n_per_m"], numbers["k2_n_per_m"]),
            numbers["hertz_stiffness"],
        )
        observe = (*self.observe, *((Observable.POINCARE,) if len(self.varying) == 1 else ()))
        return Scene(
            specimen,
            drive,
            observe=observe,
            accuracy=self.accuracy,
            duration=AutomaticDuration(self.window_periods / frequency_hz, self.periods / frequency_hz),
            start=start or self._start(place, numbers, specimen, drive),
            budget_s=0.0 if self.target is None else BUDGET_S,
            target=self.target,
        )

    def first_scene(self, place: tuple[int, ...]) -> Scene:
        """Return the scene at a grid position, from the plan's initial state."""
        return self.scene(place)

    def label_after(self, place: tuple[int, ...], before: tuple[int, ...]) -> str:  # noqa: ARG002
        """Return the name of the initial state of a point that continues another point."""
        return self.start_labels[place[-2]]

    def frequency_at(self, place: tuple[int, ...]) -> float:
        """Return the drive frequency at a position of the grid [Hz]."""
        return float(self._numbers(place)["frequency_hz"])

    def _start(
        self, place: tuple[int, ...], numbers: Mapping[str, float], specimen: Specimen, drive: Harmonic
    ) -> Given | Rest:
        """Return the initial state of a point that does not continue another point."""
        if place[-2] >= max(1, len(self.chain)):
            drawn = np.random.default_rng([self.seed, place[-2]])
            return Given(state_of(random_state(specimen, drive, drawn)), RANDOM)
        if self.chain:
            return Rest()
        return Given(state_of(np.array([numbers[each.field] for each in START])))

    def _numbers(self, place: tuple[int, ...]) -> dict[str, float]:
        """Return the value of every quantity at a position of the grid."""
        numbers = {each.field: getattr(self, each.field) for each in QUANTITIES}
        for quantity, index in zip(self.varying, (place[-1], place[0]), strict=False):
            numbers[quantity.field] = _values(self.range_of(quantity))[index]
        return numbers


@lru_cache(maxsize=64)
def _values(of: Range) -> tuple[float, ...]:
    return of.values


@lru_cache(maxsize=4096)
def _specimen(
    described: SpecimenTable,
    model: str | None,
    damping_time_s: float | None,
    gap_m: float | None,
    stiffnesses: tuple[float | None, ...],
    hertz_stiffness: float | None,
) -> Specimen:
    """Return the specimen with these values, built once for all points with the same values."""
    changes: dict[str, object] = {}
    if any(each is not None for each in stiffnesses):
        k0, k1, k2 = (
            own if new is None else new for own, new in zip(described.stiffnesses, stiffnesses, strict=True)
        )
        triple: Triple = (k0, k1, k2)
        changes |= {"stiffnesses_n_per_m": triple, "single_frequencies_hz": None}
    if hertz_stiffness is not None:
        changes["hertz_stiffness"] = hertz_stiffness
    return described.model_copy(update=changes).specimen(model, damping_time_s, gap_m)
