"""An ordered list of measurements, and the TOML file that says it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from ..excitation.kinds import KINDS
from ..run.schedule import CHECK_S, duration_s
from ..toml_file import FrozenModel, load_toml
from .measurement import Measurement, Name

DEFAULTS = "defaults"
BYTES_PER_SAMPLE = 4
"""A recording keeps the converter's counts as 32-bit integers while it runs; the finished file is smaller."""


class Campaign(FrozenModel):
    """Measurements to be made one after the other.

    In a file, ``[defaults]`` holds what all measurements share, and ``[defaults.<kind>]`` what all
    excitations of one kind share; a measurement's own values come first. The campaign itself has
    every value in its place.
    """

    name: Name
    notes: str = ""
    measurements: tuple[Measurement, ...] = Field(min_length=1)

    @model_validator(mode="before")
    @classmethod
    def _fill_in_defaults(cls, content: Any) -> Any:
        match content:
            case {"defaults": dict(defaults), "measurements": list(measurements)}:
                rest = {key: value for key, value in content.items() if key != DEFAULTS}
                filled = [_filled(measurement, defaults) for measurement in measurements]
                return {**rest, "measurements": filled}
            case _:
                return content

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [name.lower() for name in self.recording_names()]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(
                f"two measurements would be recorded as {twice[0]!r}; give every measurement "
                "a name of its own (capital letters do not count)"
            )
        return self

    def recordings(self) -> tuple[tuple[str, Measurement], ...]:
        """Name of each recording, and the measurement it is one of, in order."""
        return tuple((name, each) for each in self.measurements for name in _names(each))

    def recording_names(self) -> tuple[str, ...]:
        """Names of all recordings, in order, without ``.h5``."""
        return tuple(name for name, _ in self.recordings())

    @property
    def duration_s(self) -> float:
        """Time of all measurements with their ramps and one bench check each, at most [s]."""
        return sum(CHECK_S + duration_s(measurement) for _, measurement in self.recordings())

    def size_bytes(self, sample_rate_hz: float, channels: int) -> int:
        """Disk space of all recordings while they are made; compressed afterwards, they need less."""
        return round(self.duration_s * sample_rate_hz) * channels * BYTES_PER_SAMPLE


def load_campaign(path: Path) -> Campaign:
    """Read a campaign; raises ConfigurationError with file, key and what is allowed."""
    return load_toml(path, Campaign)


def _names(measurement: Measurement) -> tuple[str, ...]:
    if measurement.repeats == 1:
        return (measurement.name,)
    return tuple(f"{measurement.name}-{number}" for number in range(1, measurement.repeats + 1))


def _filled(measurement: object, defaults: Mapping[str, Any]) -> object:
    """Put the defaults underneath a measurement's own values."""
    match measurement:
        case dict():
            shared = {key: value for key, value in defaults.items() if key not in KINDS}
            own = {**shared, **measurement}
            match own.get("excitation"):
                case {"kind": str(kind), **values}:
                    own["excitation"] = {**defaults.get(kind, {}), **values, "kind": kind}
            return own
        case _:
            return measurement
