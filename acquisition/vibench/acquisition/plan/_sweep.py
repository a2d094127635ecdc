"""Nested sweeps: a template and several axes, which give an ordered list of named points."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from math import floor, prod
from typing import Annotated, Any, Self, TypeAlias

from pydantic import Field, PositiveFloat, PositiveInt, ValidationError, model_validator

from ..excitation.dwell import MOST_LEAD_INS
from ..excitation.kinds import Excitation
from ..excitation.plan import LeadIn
from ..excitation.steps import Direction
from ..host.toml_file import FrozenModel, complaints
from ._schedule import Measurement, Name, Point

MOST_VALUES = 10_000
"""Largest number of values on one axis of a sweep."""


class RangeSpacing(StrEnum):
    """Spacing of the values of a range: linear or logarithmic."""

    LINEAR = "linear"
    """Equal differences between neighbouring values."""
    LOGARITHMIC = "logarithmic"
    """Equal ratios of neighbouring values; requires ``count``."""


class Range(FrozenModel):
    """Values from ``start`` to ``stop``, given by their spacing ``step`` or their number ``count``."""

    start: PositiveFloat
    stop: PositiveFloat
    """Upper bound of the values; included if whole steps reach it."""
    step: PositiveFloat | None = None
    count: PositiveInt | None = Field(default=None, ge=2, le=MOST_VALUES)
    spacing: RangeSpacing = RangeSpacing.LINEAR

    @model_validator(mode="after")
    def _rises_in_one_way(self) -> Self:
        if self.stop <= self.start:
            raise ValueError(
                f"stop = {self.stop:g} is not above start = {self.start:g}; give the range from low to "
                "high and choose the order of its values with direction"
            )
        if (self.step is None) == (self.count is None):
            raise ValueError("give either step or count, and not both")
        if self.step is not None and self.spacing is RangeSpacing.LOGARITHMIC:
            raise ValueError("logarithmic values have no constant step; give count")
        if self._count() > MOST_VALUES:
            raise ValueError(f"the range has {self._count()} values (at most {MOST_VALUES}); raise step")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the range in ascending order."""
        count = self._count()
        match self.spacing:
            case RangeSpacing.LINEAR:
                step = self.step or (self.stop - self.start) / (count - 1)
                return tuple(round(self.start + number * step, 9) for number in range(count))
            case RangeSpacing.LOGARITHMIC:
                ratio = self.stop / self.start
                return tuple(self.start * ratio ** (number / (count - 1)) for number in range(count))

    def _count(self) -> int:
        if self.step is None:
            return self.count or 0
        # With the tolerance 1e-9, the last value is included if the steps miss it only by rounding.
        return floor((self.stop - self.start) / self.step + 1e-9) + 1


Values: TypeAlias = Annotated[tuple[PositiveFloat, ...], Field(min_length=1, max_length=MOST_VALUES)] | Range
"""Values of an axis in a file: a list, or a table with start, stop, and either step or count."""


def values_of(given: Values | None) -> tuple[float, ...]:
    """Return an axis's values: of a range in ascending order, of a list in the given order; none for None."""
    return given.values if isinstance(given, Range) else given or ()


MOST_POINTS = 10_000
"""Largest number of points in one sweep; a larger number is treated as a mistake."""
LONGEST_NAME = 64


class SweepAxis(StrEnum):
    """Axes of a sweep, named as in ``order``."""

    # The axes are ordered like nested loops: the first (outermost) axis changes slowest.

    REPETITION = "repetition"
    EXCITATION = "excitation"
    LEVEL = "amplitude_vpp"
    DIRECTION = "direction"
    FREQUENCY = "frequency_hz"


_UNITS = {SweepAxis.LEVEL: "vpp", SweepAxis.FREQUENCY: "hz"}
_TURNING = frozenset({Direction.UP_THEN_DOWN, Direction.DOWN_THEN_UP})


@dataclass(frozen=True)
class _Place:
    """Position of a point in a sweep: its value on each given axis."""

    values: Mapping[SweepAxis, Any]
    words: Mapping[SweepAxis, str]
    """Parts of the point's name, one for each value, in the order of the axes."""

    def name(self, sweep: str) -> str:
        return "-".join([sweep, *self.words.values()])


class Sweep(FrozenModel):
    """All combinations of values on the given axes; each is a measurement based on ``measurement``.

    A point is named after the sweep and its values: ``line-0p5vpp-up-205hz``. With ``continue_from_previous``
    the points along that axis form a chain. Each point is a dwell that starts by playing all earlier points.
    The specimen thus stays on its branch, even if a point is repeated days later.
    """

    name: Name
    measurement: dict[str, Any]
    """Template of all points: the values of a measurement, without its name."""
    excitations: tuple[dict[str, Any], ...] = ()
    """Excitations used one after another; their values have priority over the template's values."""
    repetitions: PositiveInt = Field(default=1, le=1000)
    amplitude_vpp: Values | None = None
    direction: tuple[Direction, ...] = ()
    frequency_hz: Values | None = None
    order: tuple[SweepAxis, ...] = Field(default=tuple(SweepAxis), min_length=1)
    """Axes of the sweep, from the outermost (slowest) to the innermost."""
    continue_from_previous: SweepAxis | None = None
    """Axis along which the specimen stays on its branch: ``frequency_hz`` or ``amplitude_vpp``. This axis
    must be the innermost axis."""
    lead_s: PositiveFloat = 0.5
    """Time at each earlier point of the chain in a lead-in [s]."""

    lead_points: PositiveInt | None = Field(default=None, le=MOST_LEAD_INS)
    """Largest number of earlier points in a lead-in, counted from the nearest; if absent, the whole chain. A
    shorter lead-in saves time, but one that starts beyond the jump reaches the wrong branch."""

    @model_validator(mode="after")
    def _order_names_every_axis(self) -> Self:
        if len(set(self.order)) != len(self.order):
            raise ValueError(f"order = {_words(self.order)} contains an axis twice; give each axis once")
        missing = [axis for axis in self._axes() if axis not in self.order]
        if missing:
            raise ValueError(f"order is missing {_words(missing)}; it must contain every axis of the sweep")
        return self

    @model_validator(mode="after")
    def _chain_is_innermost(self) -> Self:
        axis = self.continue_from_previous
        if axis is None:
            return self
        if axis not in (SweepAxis.FREQUENCY, SweepAxis.LEVEL):
            raise ValueError(
                f"continue_from_previous = {axis.value!r} is not an axis for a chain of points; allowed are "
                "'frequency_hz' and 'amplitude_vpp'"
            )
        given = [each for each in self.order if each in self._axes() and each is not SweepAxis.DIRECTION]
        if not given or given[-1] is not axis:
            raise ValueError(
                f"continue_from_previous = {axis.value!r} must be the innermost axis of the sweep; the order "
                f"of the sweep is {_words(given)}"
            )
        passed = len(self._axes()[axis]) * (2 if _TURNING & set(self.direction) else 1)
        longest = passed if self.lead_points is None else min(passed, self.lead_points)
        if longest > MOST_LEAD_INS:
            raise ValueError(
                f"a chain would have {longest} points (at most {MOST_LEAD_INS}); divide the sweep"
            )
        return self

    @model_validator(mode="after")
    def _points_are_measurements(self) -> Self:
        counts = {axis.value: len(values) for axis, values in self._axes().items()}
        if self.direction:
            counts[SweepAxis.DIRECTION.value] = self._passes()
        count = prod(counts.values())
        if count > MOST_POINTS:
            shown = " x ".join(f"{number} {axis}" for axis, number in counts.items())
            raise ValueError(
                f"the sweep {self.name!r} has {count} points ({shown}); at most {MOST_POINTS} are allowed. "
                "Raise a step or divide the sweep"
            )
        self.points()
        return self

    def points(self) -> tuple[Point, ...]:
        """Return all points in order.

        Raises ValueError when a combination is not a valid measurement; the message names point and key.
        """
        return tuple(self._chain_points()) if self.continue_from_previous else tuple(self._single_points())

    def _passes(self) -> int:
        return sum(2 if way in _TURNING and self.continue_from_previous else 1 for way in self.direction)

    def _axes(self) -> dict[SweepAxis, tuple[Any, ...]]:
        axes: dict[SweepAxis, tuple[Any, ...]] = {
            SweepAxis.REPETITION: tuple(range(1, self.repetitions + 1)) if self.repetitions > 1 else (),
            SweepAxis.EXCITATION: tuple(range(len(self.excitations))),
            SweepAxis.LEVEL: values_of(self.amplitude_vpp),
            SweepAxis.DIRECTION: self.direction,
            SweepAxis.FREQUENCY: values_of(self.frequency_hz),
        }
        return {axis: values for axis, values in axes.items() if values}

    def _places(self, axes: Mapping[SweepAxis, tuple[Any, ...]]) -> Iterator[_Place]:
        ordered = [axis for axis in self.order if axis in axes]
        for values in product(*(axes[axis] for axis in ordered)):
            place = dict(zip(ordered, values, strict=True))
            yield _Place(place, {axis: self._word(axis, value) for axis, value in place.items()})

    def _single_points(self) -> Iterator[Point]:
        for place in self._places(self._axes()):
            name = place.name(self.name)
            measurement = _measurement(self._content(name, place.values), name)
            if SweepAxis.DIRECTION in place.values:
                turned = _set_direction(measurement.excitation, place.values[SweepAxis.DIRECTION], name)
                measurement = measurement.model_copy(update={"excitation": turned})
            yield Point(name, measurement)

    def _chain_points(self) -> Iterator[Point]:
        """Yield the points of each chain; earlier points are the lead-in of later points."""
        axes = self._axes()
        along = SweepAxis(str(self.continue_from_previous))
        rising = tuple(sorted(axes.pop(along)))
        for chain in self._places(axes):
            way: list[LeadIn] = []
            turn: Direction | None = chain.values.get(SweepAxis.DIRECTION)
            passes = [("", rising)] if turn is None else turn.passes(rising)
            for word, value in ((word, value) for word, values in passes for value in values):
                words = {**chain.words, SweepAxis.DIRECTION: word} if word else chain.words
                name = "-".join([self.name, *words.values(), self._word(along, value)])
                measurement = _measurement(self._content(name, {**chain.values, along: value}), name)
                passed = way if self.lead_points is None else way[-self.lead_points :]
                led, tone = _with_lead_in(measurement.excitation, tuple(passed), self.lead_s, name)
                led_there = measurement.model_copy(update={"excitation": led})
                yield Point(name, led_there, chain.name(self.name))
                way.append(tone)

    def _content(self, name: str, values: Mapping[SweepAxis, Any]) -> dict[str, Any]:
        excitation = dict(self.measurement.get("excitation", {}))
        if SweepAxis.EXCITATION in values:
            excitation |= self.excitations[values[SweepAxis.EXCITATION]]
        for axis in (SweepAxis.LEVEL, SweepAxis.FREQUENCY):
            if axis in values:
                excitation[axis.value] = values[axis]
        return {**self.measurement, "name": name, "excitation": excitation}

    def _word(self, axis: SweepAxis, value: Any) -> str:
        """Return a value as part of a point's name: ``0p5vpp``, ``205hz``, ``up``, ``r2``."""
        match axis:
            case SweepAxis.REPETITION:
                return f"r{value}"
            case SweepAxis.DIRECTION:
                return str(value)
            case SweepAxis.EXCITATION:
                template = self.measurement.get("excitation", {}).get("kind", "excitation")
                kinds = [str(each.get("kind", template)) for each in self.excitations]
                kind = kinds[value]
                return kind if kinds.count(kind) == 1 else f"{kind}{value + 1}"
            case SweepAxis.LEVEL | SweepAxis.FREQUENCY:
                return f"{value:.7g}{_UNITS[axis]}".replace(".", "p").replace("+", "")


def _set_direction(excitation: Excitation, way: Direction, name: str) -> Excitation:
    try:
        turned = excitation.turned(way)
    except ValidationError as error:
        raise ValueError(f"{name}: {complaints(error, excitation.model_dump(), type(excitation))}") from error
    if turned is None:
        raise ValueError(
            f"{name}: direction = {way.value!r} has no meaning for the excitation {excitation.kind!r} alone; "
            "set continue_from_previous to step along an axis, or leave direction out"
        )
    return turned


def _with_lead_in(
    excitation: Excitation, way: tuple[LeadIn, ...], lead_s: float, name: str
) -> tuple[Excitation, LeadIn]:
    led = excitation.led(way, lead_s)
    if led is None:
        raise ValueError(
            f"{name}: continue_from_previous works only for dwells, but the excitation is "
            f"{excitation.kind!r}; give kind = 'dwell', or leave continue_from_previous out"
        )
    return led


def _measurement(content: Mapping[str, Any], name: str) -> Measurement:
    if len(name) > LONGEST_NAME:
        raise ValueError(
            f"the point name {name!r} has {len(name)} characters (at most {LONGEST_NAME}); give the "
            "sweep a shorter name"
        )
    try:
        return Measurement.model_validate(content)
    except ValidationError as error:
        raise ValueError(f"{name}: {complaints(error, content, Measurement)}") from error


def _words(axes: Any) -> str:
    return ", ".join(repr(axis.value) for axis in axes)
