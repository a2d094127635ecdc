"""Campaigns: an ordered list of measurements and nested sweeps, its TOML file, and rules for retries."""

import re
from collections import Counter
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from pydantic import Field, NonNegativeFloat, PositiveInt, ValidationInfo, model_validator

from ..excitation.kinds import EXCITATION_KINDS, present_word
from ..host.installation import file_path
from ..host.toml_file import FrozenModel, load_toml
from ._schedule import Measurement, Name, Point, ScanPoint, measuring_s
from ._sweep import LONGEST_NAME, Sweep


class Retryable(StrEnum):
    """Failures after which another attempt may succeed."""

    DATA_LOST = "data_lost"
    """Samples were overwritten before they were read."""
    INSTRUMENT_LOST = "instrument_lost"
    """Cable, power or server failed; the bench is closed and opened again before the next attempt."""
    INSTRUMENT_FAULT = "instrument_fault"
    """An instrument refused a command, or another program uses it; the bench is reopened before a retry."""
    CHECK_FAILED = "check_failed"
    """The check at low level before the recording failed."""
    LIMIT = "limit"
    """A measured value exceeded a limit of the rig."""
    OVER_RANGE = "over_range"
    """The recording is complete, but an input was near its full scale in a recorded segment."""


class RetryPolicy(FrozenModel):
    """Number of attempts at a point, and the failures after which another attempt is made."""

    attempts: PositiveInt = Field(default=1, le=100)
    """Number of attempts at each point, including the first; every attempt has a separate file."""
    on: tuple[Retryable, ...] = Field(
        default=(Retryable.DATA_LOST, Retryable.INSTRUMENT_LOST, Retryable.INSTRUMENT_FAULT), min_length=1
    )
    reopen_for_s: NonNegativeFloat = Field(default=60.0, le=86400)
    """Longest search for a lost instrument [s]; after this time, the campaign ends."""


BYTES_PER_SAMPLE = 4
"""Size of one sample, a 32-bit count, in a growing recording [bytes]; smaller in a finished recording."""

_WINDOWS_DEVICE = r"con|prn|aux|nul|com\d|lpt\d"
"""File names, without suffix, that Windows reserves."""


class Campaign(FrozenModel):
    """Measurements to be made one after another, and sweeps after them.

    In a file, ``[defaults]`` contains values for all measurements, and ``[defaults.<kind>]`` contains values
    for all excitations of one kind. Values given in a measurement or sweep override these defaults. The
    loaded campaign has all values filled in. A file contains only values, nothing that could be executed.
    """

    name: Name
    notes: str = ""
    retry: RetryPolicy = RetryPolicy()
    rest_s: NonNegativeFloat = Field(default=0.0, le=86400)
    """Pause between two recordings, during which specimen and amplifier cool [s]."""
    measurements: tuple[Measurement, ...] = ()
    sweeps: tuple[Sweep, ...] = ()
    scan: tuple[ScanPoint, ...] = ()
    """Points to which the vibrometer moves; all measurements and sweeps are made at each point."""

    @model_validator(mode="before")
    @classmethod
    def _fill_in_defaults(cls, content: Any) -> Any:
        match content:
            case {"defaults": dict(given), **rest}:
                defaults = {present_word(str(key)): value for key, value in given.items()}
                if len(defaults) < len(given):
                    raise ValueError(
                        "[defaults] lists one kind of excitation under its present and its former name; "
                        "put the values into one table"
                    )
                measurements = [_with_defaults(each, defaults) for each in _as_list(rest, "measurements")]
                sweeps = [_fill_sweep(each, defaults) for each in _as_list(rest, "sweeps")]
                return {**rest, "measurements": measurements, "sweeps": sweeps}
            case _:
                return content

    @model_validator(mode="after")
    def _scans_different_points(self) -> Self:
        for what in ("name", "node"):
            values = [str(getattr(each, what)).lower() for each in self._numbered_scan()]
            twice = next((value for value in values if values.count(value) > 1), None)
            if twice is not None:
                raise ValueError(f"scan: two points have the {what} {twice!r}; each {what} must be unique")
        if self.scan and any(each.point is not None for each in self.measurements):
            raise ValueError("a measurement of a scan cannot have a point; list the point under [[scan]]")
        return self

    @model_validator(mode="after")
    def _can_be_scanned(self) -> Self:
        for point in self.points():
            kind = point.measurement.excitation.kind
            if point.measurement.point is None:
                continue
            if len(point.name) > LONGEST_NAME:
                raise ValueError(
                    f"scan: the recording name {point.name!r} would have {len(point.name)} characters; "
                    f"at most {LONGEST_NAME} are allowed: shorten the name of the point or of the measurement"
                )
            if EXCITATION_KINDS[kind].is_feedback:
                raise ValueError(
                    f"scan: {kind} needs the motion of m0, but a scan moves the vibrometer elsewhere; use an "
                    "excitation without feedback"
                )
        return self

    @model_validator(mode="after")
    def _has_names_of_different_files(self, info: ValidationInfo) -> Self:
        names = Counter(name.lower() for name in self.recording_names())
        if not names:
            raise ValueError("a campaign needs at least one of [[measurements]] and [[sweeps]]")
        twice = sorted(name for name, count in names.items() if count > 1)
        if twice:
            raise ValueError(
                f"two measurements would be recorded as {twice[0]!r}; give each measurement and sweep a "
                "different name, and each axis different values (upper and lower case are not distinguished)"
            )
        reserved = next(
            (name for name in (*names, self.name) if re.fullmatch(_WINDOWS_DEVICE, name.lower())), ""
        )
        if (
            reserved and info.mode == "python"
        ):  # a plan stored by an earlier version is JSON; keep it readable
            raise ValueError(
                f"the name {reserved!r} is reserved by Windows for a device; choose another name"
            )
        return self

    def points(self) -> tuple[Point, ...]:
        """Return all planned recordings: measurements, then sweeps; a scan repeats them at each point."""
        listed = (Point(name, each) for each in self.measurements for name in _names(each))
        alone = (*listed, *(point for sweep in self.sweeps for point in sweep.points()))
        return tuple(_point_at(place, each) for place in self._numbered_scan() for each in alone) or alone

    def _numbered_scan(self) -> tuple[ScanPoint, ...]:
        return tuple(
            each.model_copy(update={"node": each.node or number})
            for number, each in enumerate(self.scan, start=1)
        )

    def recordings(self) -> tuple[tuple[str, Measurement], ...]:
        """Return name and measurement of each recording, in order."""
        return tuple((point.name, point.measurement) for point in self.points())

    @property
    def places(self) -> int:
        """Number of places at which each measurement is made: the number of scan points, or one."""
        return max(1, len(self.scan))

    def recording_names(self) -> tuple[str, ...]:
        """Return the names of all recordings in order, without ``.h5``."""
        return tuple(point.name for point in self.points())

    @property
    def duration_s(self) -> float:
        """Duration of all measurements, with ramps, bench checks and the pauses between measurements [s]."""
        points = self.points()
        return _recorded_s(points) + self.rest_s * (len(points) - 1)

    def size_bytes(self, sample_rate_hz: float, channels: int) -> int:
        """Return the disk space of all recordings while they grow [bytes]; finished recordings need less."""
        return round(_recorded_s(self.points()) * sample_rate_hz) * channels * BYTES_PER_SAMPLE


def _point_at(place: ScanPoint, point: Point) -> Point:
    """Return a campaign's measurement as it is made at the scan point ``place``."""
    measurement = point.measurement.model_copy(update={"point": place})
    chain = f"{point.chain}-{place.name}" if point.chain else ""
    return Point(f"{point.name}-{place.name}", measurement, chain)


def distinct_drives(points: tuple[Point, ...]) -> tuple[Point, ...]:
    """Return one point for each distinct drive; its limit checks apply to all points with the same drive."""
    first: dict[str, Point] = {}
    for point in points:
        first.setdefault(point.measurement.model_dump_json(exclude={"name", "repeats", "point"}), point)
    return tuple(first.values())


def _recorded_s(points: tuple[Point, ...]) -> float:
    return sum(measuring_s(point.measurement) for point in points)


def load_campaign(path: Path | str) -> Campaign:
    """Read a campaign from a TOML file, or a shipped campaign by its name (``"quick"``).

    Raises ConfigurationError with file, key, given value and allowed values.
    """
    return load_toml(file_path(path, "campaigns"), Campaign)


def _names(measurement: Measurement) -> tuple[str, ...]:
    if measurement.repeats == 1:
        return (measurement.name,)
    return tuple(f"{measurement.name}-{number}" for number in range(1, measurement.repeats + 1))


def _as_list(content: Mapping[Any, Any], key: str) -> list[Any]:
    """Return the value of ``key`` as a list; a value that is not a list becomes an invalid entry."""
    given = content.get(key, [])
    return list(given) if isinstance(given, list | tuple) else [given]


def _fill_sweep(sweep: object, defaults: Mapping[str, Any]) -> object:
    match sweep:
        case {"measurement": dict(template), **rest}:
            others = [
                {**_of_kind(defaults, each.get("kind")), **each} if isinstance(each, dict) else each
                for each in _as_list(rest, "excitations")
            ]
            return {**rest, "measurement": _with_defaults(template, defaults), "excitations": others}
        case _:
            return sweep


def _of_kind(defaults: Mapping[str, Any], kind: object) -> Mapping[str, Any]:
    """Return the defaults of one kind of excitation; raise ValueError if they are not a table."""
    shared = defaults.get(present_word(str(kind)), {})
    if not isinstance(shared, dict):
        raise ValueError(  # noqa: TRY004 - pydantic reports only a ValueError
            f"defaults.{kind} is not a table; write [defaults.{kind}] and its values below it"
        )
    return shared


def _with_defaults(measurement: object, defaults: Mapping[str, Any]) -> object:
    if not isinstance(measurement, dict):
        return measurement
    shared = {key: value for key, value in defaults.items() if key not in EXCITATION_KINDS}
    own = {**shared, **measurement}
    match own.get("excitation"):
        case {"kind": str(kind), **values}:
            own["excitation"] = {**_of_kind(defaults, kind), **values, "kind": kind}
    return own
