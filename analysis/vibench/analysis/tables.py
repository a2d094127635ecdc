"""Choices for figures, tables for figures and CSV files, and conversion of results to JSON and xarray."""

import csv
import inspect
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from decimal import Decimal
from enum import StrEnum
from itertools import zip_longest
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel

from vibench.sim.operating_system.this import replace_file

from .errors import InvalidRequest

if TYPE_CHECKING:
    import xarray


class ImageKind(StrEnum):
    """Image formats of figures; the value is the file suffix."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


SHOWN = {
    "response_i": "Response I of m0 over A0",
    "response_ii": "Response II of m0 over A0",
    "relative_i": "Response I of p over A0",
    "relative_ii": "Response II of p over A0",
    "impact_rate": "impacts per second",
    "contact_energy": "largest energy in a stop [J]",
    "lyapunov": "largest Lyapunov exponent [1/s]",
    "duration": "simulated time [s]",
    "motions": "number of motions reached from the initial states",
}
"""Quantities that a map can show in addition to the kinds of motion."""


_DIGITS = 10
_PLAIN = (1e-5, 1e7)
"""Numbers with magnitudes in this range are written without a power of ten."""


def plus_minus(value: float, half_width: float) -> str:
    """Return a value and its uncertainty as text, with two digits of the uncertainty: ``"94.613 ± 0.012"``.

    If the uncertainty is not finite and positive, only four digits of the value are returned.
    """
    if not 0.0 < half_width < np.inf or not np.isfinite(value):
        return f"{value:.4g}"
    largest = max(abs(value), half_width)
    if not _PLAIN[0] <= largest < _PLAIN[1]:
        power = int(np.floor(np.log10(largest)))
        # Use Decimal, because the power of ten alone may exceed the range of floats.
        scaled = (float(Decimal(float(each)).scaleb(-power)) for each in (value, half_width))
        return f"({plus_minus(*scaled)})e{power}"
    # Take the exponent after rounding, because 0.0996 is written as 0.10.
    place = 1 - int(f"{half_width:.1e}".partition("e")[2])
    shown = max(place, 0)
    return f"{round(value, place) + 0.0:.{shown}f} ± {round(half_width, place):.{shown}f}"


def with_unit(value: float, half_width: float, unit: str) -> str:
    """Return a value with its uncertainty and unit as text: ``"(94.613 ± 0.012) Hz"``."""
    shown = plus_minus(value, half_width)
    return f"({shown}) {unit}" if unit and "±" in shown else f"{shown} {unit}".strip()


@dataclass(frozen=True, eq=False)
class Table:
    """Named columns, which may differ in length; headings contain the unit, as in ``"frequency [Hz]"``."""

    name: str
    columns: tuple[tuple[str, tuple[float | str, ...]], ...]

    def column(self, heading: str) -> tuple[float | str, ...]:
        """Return the table column with this heading."""
        return dict(self.columns)[heading]


def table(name: str, **columns: ArrayLike) -> Table:
    """Return a table from its ``name`` and ``columns``; column names end with the unit, as in ``time_s``."""
    return Table(name, tuple((each, tuple(np.ravel(values).tolist())) for each, values in columns.items()))


def columns(source: object, keys: str) -> dict[str, Any]:
    """Return selected values of a result, keyed as in a JSON document or in the headings of a table.

    The four items of ``"frequency_hz rms_m=base.rms_m first_hz=lines.0 *run"`` select a field or property, an
    attribute of a part (None if the part is None), an item of an array, and all keys of the part ``run``.
    """
    found: dict[str, Any] = {}
    for each in keys.split():
        if each.startswith("*"):
            found |= plain(getattr(source, each[1:]))
            continue
        key, _, path = each.partition("=")
        value: Any = source
        for step in (path or key).split("."):
            if value is not None:
                value = value[int(step)] if step.lstrip("-").isdigit() else getattr(value, step)
        found[key] = value
    return found


def rows(parts: Iterable[object], keys: str) -> dict[str, Any]:
    """Return one array per key (see `columns`) with the values of all parts; NaN for missing values."""
    found = [columns(each, keys) for each in parts]
    names = [each.partition("=")[0] for each in keys.split()]
    return {
        name: np.concatenate([np.atleast_1d(np.nan if each[name] is None else each[name]) for each in found])
        if found
        else np.zeros(0)
        for name in names
    }


def plain(value: Any) -> Any:
    """Convert a value to types that JSON can store; numbers that are not finite become None.

    A dataclass is converted to the keys in its ``DOCUMENT`` (see `columns`), or to all fields if it has none.
    """
    match value:
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case bool() | str() | int() | None:
            return value
        case float():
            return value if math.isfinite(value) else None
        case Mapping():
            return {str(key): plain(each) for key, each in value.items()}
        case Sequence():
            return [plain(each) for each in value]
        case _:
            return _document(value)


def _document(value: Any) -> Any:
    match value:
        case Path():
            return str(value)
        case BaseModel():
            return value.model_dump(mode="json")
        case _ if is_dataclass(value):
            keys = getattr(value, "DOCUMENT", "") or " ".join(each.name for each in fields(value))
            return plain(columns(value, keys))
        case _:
            raise TypeError(f"{type(value).__name__} cannot be stored in a document; convert it to numbers")


def write_csv(content: Table, path: Path) -> Path:
    """Write a table with headings in the first row, decimal points, and empty cells below short columns."""
    headings = [heading for heading, _ in content.columns]
    rows = zip_longest(*(values for _, values in content.columns), fillvalue="")
    with replace_file(path) as coming, coming.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(headings)
        writer.writerows(
            [f"{cell:.{_DIGITS}g}" if isinstance(cell, float) else cell for cell in row] for row in rows
        )
    return path


UNITS = {
    "_hz": "Hz",
    "_s": "s",
    "_m": "m",
    "_rad": "rad",
    "_j": "J",
    "_v": "V",
    "_a": "A",
    "_n": "N",
    "_deg": "degree",
    "_vpp": "V",
    "_decibel": "dB",
    "_kg": "kg",
    "_per_s": "s-1",
    "_m_per_s": "m s-1",
    "_m_per_s2": "m s-2",
    "_n_per_m": "N m-1",
    "_ns_per_m": "N s m-1",
    "_s_per_m": "s m-1",
}
"""Unit of a value, keyed by the suffix of its name; the longest matching suffix applies."""
COORDINATES = ("frequency_hz", "time_s", "harmonics_hz", "over_hz", "amplitude_m")
"""Names of independent variables; the first of these that a result has is the coordinate of its arrays."""


class Tabular:
    """Base class of results that can be converted to JSON, and to an xarray Dataset with units."""

    OWN_UNITS: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """Units of values whose names have no unit suffix; ``{0.name}`` inserts the field ``name``.

    In a part of a result, ``{unit}`` inserts the unit that the parent states for this part. Parts may define
    ``DOCUMENT`` too.
    """
    DOCUMENT: ClassVar[str] = ""
    """Keys of the JSON document in the syntax of `columns`; empty for all fields."""

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document as a dictionary; numbers that are not finite become None."""
        return dict(plain(self))

    def to_xarray(self) -> "xarray.Dataset":
        """Return all numbers of the result as an `xarray.Dataset`.

        Arrays over the result's frequencies or times share one dimension. Bounds (``magnitude_lower``) and
        standard deviations (``sd_...``) are separate variables. Names of values in a part begin with the name
        of the part (``response_frequency_hz``). A list of parts that contain single numbers, such as
        resonances, becomes one array per field (``resonances_frequency_hz``); other parts are numbered. A
        variable has the attribute ``units`` unless it is a pure number or its unit depends on the input. If
        rows have different units, the units are a variable (``values_value_units``). Texts are attributes.

        Raises InvalidRequest when xarray is not installed.
        """
        try:
            import xarray  # noqa: PLC0415 - optional, and slow to load
        except ImportError as error:
            raise InvalidRequest("xarray is not installed; pip install 'vibench[exchange]'") from error
        variables: dict[str, Any] = {}
        attributes: dict[str, Any] = {"result": type(self).__name__}
        _collect(self, "", "", variables, attributes)
        made = xarray.Dataset(variables, attrs=attributes)
        ends = tuple(f"_{each}" for each in COORDINATES)
        return made.set_coords([name for name in made.variables if f"_{name}".endswith(ends)])


def unit_of(name: str) -> str:
    """Return the unit for the suffix of a name, in UDUNITS notation; empty for names without such a suffix.

    >>> unit_of("damping_ns_per_m"), unit_of("frequency_hz"), unit_of("response_i")
    ('N s m-1', 'Hz', '')
    """
    ends = [end for end in UNITS if f"_{name}".endswith(end)]
    return UNITS[max(ends, key=len)] if ends else ""


def _unit(part: Any, key: str, unit: str) -> str:
    """Return the unit of a value in a part; ``unit`` is the unit that the parent states for the part."""
    pattern = getattr(part, "OWN_UNITS", {}).get(key)
    if pattern is None:
        return unit_of(key)
    return "" if "{unit}" in pattern and not unit else str(pattern.format(part, unit=unit))


def _attributes(unit: str) -> dict[str, str]:
    return {"units": unit} if unit else {}


def holds_array(annotation: object) -> bool:
    """Return whether an annotation is an array: an alias in numpy 2.5, the class in older versions."""
    return "ndarray" in str(annotation).lower()


def _collect(
    part: Any, prefix: str, unit: str, variables: dict[str, Any], attributes: dict[str, Any]
) -> None:
    values = dict(_numbers_of(part))
    over = next((name for name in COORDINATES if np.ndim(values.get(name, 0)) == 1), None)
    length = None if over is None else len(values[over])
    for key, value in values.items():
        name, own = f"{prefix}{key}", _unit(part, key, unit)
        match value:
            case np.ndarray() if value.dtype != object:
                first = f"{prefix}{over}" if value.ndim and len(value) == length else f"{name}_number"
                dimensions = (first, *(f"{name}_{number}" for number in range(2, value.ndim + 1)))[
                    : value.ndim
                ]
                variables[name] = (dimensions, value, _attributes(own))
            case bool() | str():
                attributes[name] = str(value)
            case int() | float() | complex():
                variables[name] = ((), value, _attributes(own))
            case tuple() if value and _is_table(value):
                _collect_rows(value, name, own, variables)
            case tuple() if value and all(is_dataclass(each) for each in value):
                for row, each in enumerate(value, 1):
                    _collect(each, f"{name}_{row}_", own, variables, attributes)
            case tuple() if value and all(isinstance(each, int | float) for each in value):
                variables[name] = ((f"{name}_number",), np.asarray(value), _attributes(own))
            case _ if is_dataclass(value):
                _collect(value, f"{name}_", own, variables, attributes)


def _is_table(parts: tuple[Any, ...]) -> bool:
    """Return whether all parts have one type and contain only numbers, texts and lists of equal lengths."""
    if not all(is_dataclass(each) for each in parts):
        return False
    shapes = {_row_shape(each) for each in parts}
    return len(shapes) == 1 and None not in shapes


def _row_shape(part: Any) -> tuple[Any, ...] | None:
    """Return the type of a part and the lengths of its lists; None if any field cannot be a table cell."""
    lengths = []
    for _, value in _numbers_of(part):
        match value:
            case None | bool() | int() | float() | str():
                lengths.append(0)
            case tuple() if all(isinstance(each, int | float) for each in value):
                lengths.append(len(value))
            case _:
                return None
    return type(part), *lengths


def _collect_rows(rows: tuple[Any, ...], name: str, unit: str, variables: dict[str, Any]) -> None:
    """Collect parts that hold single numbers into one variable per field; missing numbers become NaN."""
    for key, _ in _numbers_of(rows[0]):
        values = [getattr(row, key) for row in rows]
        is_word = any(isinstance(each, str) for each in values)
        kept = [each if each is not None else "" if is_word else math.nan for each in values]
        units = [_unit(row, key, unit) for row in rows]
        is_one = len(set(units)) == 1
        column = np.asarray(kept)
        dimensions = (f"{name}_number", f"{name}_{key}_2")[: column.ndim]
        variables[f"{name}_{key}"] = (
            dimensions,
            column,
            _attributes(units[0]) if is_one and not is_word else {},
        )
        if not is_one:
            variables[f"{name}_{key}_units"] = (dimensions[:1], np.asarray(units))


def _numbers_of(part: Any) -> Iterator[tuple[str, Any]]:
    """Yield the fields of a result, then its properties that are arrays."""
    for each in fields(part):
        yield each.name, getattr(part, each.name)
    for name, found in inspect.getmembers(type(part), lambda member: isinstance(member, property)):
        given = found.fget.__annotations__.get("return", "")
        if not name.startswith("_") and holds_array(given):
            yield name, getattr(part, name)
