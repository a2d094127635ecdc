"""Mapping of a foreign file, written as TOML: its channels and the excitation."""

import re
from datetime import date
from typing import Literal, Self

from pydantic import AwareDatetime, Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import ROLE_PATTERN, Origin
from vibench.acquisition.rig import size_of_unit, volts_per_unit
from vibench.sim import FrozenModel, SpecimenTable

from ..recordings.channels import BASE, DRIVE

KNOWN_ROLES = {
    DRIVE: ("voltage", "V"),
    "amplifier_voltage": ("voltage", "V"),
    BASE: ("acceleration", "m s-2"),
    "m0_velocity": ("velocity", "m s-1"),
    "m0_acceleration": ("acceleration", "m s-2"),
    "m0_displacement": ("displacement", "m"),
}
"""Quantity and unit that an analysis requires, keyed by role of the channel."""


_NO_UNIT = {"", "-", "1", "none", "None"}
"""Texts that mean "no unit" in a file."""
_LARGEST_CORRECTION = 0.2
"""Largest accepted relative difference between the given scale and the size of the file's unit."""


def _is_another_quantity(file_unit: str) -> bool:
    """Return whether a unit is one of motion or force, which a scale cannot convert to another quantity."""
    return any(size_of_unit(file_unit, each) is not None for each in ("m", "m s-1", "m s-2", "N"))


def unit_in_name(name: str) -> str:
    """Return the unit at the end of a name, as in ``"v / mm/s"``, ``"v_mm_s"``; empty if there is none."""
    for found in _BEFORE_UNIT.finditer(name):
        unit, sign = name[found.end() :].strip(" ])}>\uff3d\uff09"), found[0].strip()
        unit = unit.replace("_", "/") if sign == "_" else unit
        is_letter = sign in {"", "_", "-"} and (len(unit) == 1 or unit == "in")
        is_known = _is_another_quantity(unit) or size_of_unit(unit, "V") is not None
        # DIN 461 writes "a / Gal". If more than four letters follow " / ", they may belong to the name.
        is_unknown = found[0] == " / " and _LIKE_A_UNIT.fullmatch(unit)
        before = re.split(r"[\s(\[]", name[: found.start()])[-1]
        if found[0] == "/" and is_known and size_of_unit(before, "V") is not None:
            return f"{before}/{unit}"  # the sensitivity of a sensor
        if is_known and found[0].isspace() and (unit == "g" or before[-1:].isdigit()):
            return f"{unit}?"  # a unit, or part of a name such as "sensor g" or "at 40 mm"
        if sign == "[" or is_unknown or (is_known and (not is_letter or (unit == "g" and sign))):
            return unit
    return ""


_LIKE_A_UNIT = re.compile(r"\S{1,4}|\S*[/^*\u00b2]\S*")
_BEFORE_UNIT = re.compile(r"^|\s*[\[({<\uff3b\uff08/,;:_-]\s*|\s+(?:in\s+)?(?=.)")


class ChannelMapping(FrozenModel):
    """One channel: ``value = factor * number in the file + offset``, in ``unit``."""

    source: str = Field(min_length=1)
    """Name of the channel in the file, as `vibench import FILE` lists it."""
    role: str = Field(pattern=f"^{ROLE_PATTERN.pattern}$")
    """Name of the channel in the recording: ``drive_voltage``, ``base_acceleration``, ``m0_velocity``,
    ``m0_acceleration``, ``m0_displacement``, or any other name."""
    quantity: str = ""
    unit: str = ""
    """Unit of the value in UDUNITS notation; may be left out for the channels that an analysis needs."""
    file_unit: str = ""
    """Unit of the numbers in the file, if it is missing or wrong there: ``"g"``, ``"mm/s"``, ``"V"``."""
    scale: float | str | None = None
    """Factor from numbers in the file to ``unit``; by default from the unit in the file, else 1. For a file
    in volts: the sensitivity of the sensor, such as ``"100 mV/g"``."""
    offset: float = 0.0
    full_scale: PositiveFloat | None = None
    """Full scale of the input, as a number in the file; values near full scale are marked as overloads."""
    coupling: Literal["AC", "DC"] = "DC"
    sensitivity: PositiveFloat | None = None
    sensitivity_unit: str = ""
    serial: str = ""
    calibration_date: date | None = None
    delay_s: float = 0.0
    """Delay of the channel [s]."""
    long_name: str = ""

    @model_validator(mode="after")
    def _has_the_unit_of_its_role(self) -> Self:
        if self.role not in KNOWN_ROLES:
            if not (self.quantity and self.unit):
                raise ValueError(
                    f"{self.role} needs quantity and unit; only {', '.join(KNOWN_ROLES)} have defaults"
                )
            return self
        for given, needed in zip((self.quantity, self.unit), KNOWN_ROLES[self.role], strict=True):
            if given not in {"", needed}:
                raise ValueError(
                    f"{self.role} needs {needed!r}, but {given!r} was given; convert the numbers with scale"
                )
        return self

    @model_validator(mode="after")
    def _has_a_scale(self) -> Self:
        if self.scale == 0:
            raise ValueError(f"the scale of {self.role} is 0, so all values would be 0; give another scale")
        if isinstance(self.scale, str):
            self.factor("V")
        return self

    def factor(self, file_unit: str) -> float:
        """Return the factor from numbers in ``file_unit`` (empty if the file states none) to ``unit``.

        Raises ValueError when the scale contradicts the unit, or is needed and missing.
        """
        file_unit, unit, scale = self.file_unit or file_unit, self.kind[1], self.scale
        text = f"{self.role} is in {file_unit!r} in the file"
        size, volts = size_of_unit(file_unit, unit), size_of_unit(file_unit, "V")
        if isinstance(scale, str):
            if unit == "V":
                raise ValueError(f"scale = {scale!r} was given for {self.role}, a voltage; give a number")
            if volts is None and file_unit not in _NO_UNIT:
                raise ValueError(
                    f"{text}, but scale = {scale!r} is for a file in volts; give scale as a number of "
                    f'{unit!r} per {file_unit!r}, or file_unit = "V" if the file is wrong'
                )
            return (volts or 1.0) / volts_per_unit(scale, unit)
        is_known = size_of_unit(unit, unit) is not None and file_unit not in _NO_UNIT
        if size is not None and scale is not None and abs(abs(scale) / size - 1) > _LARGEST_CORRECTION:
            raise ValueError(
                f"{text}, which is {size:g} {unit}, but scale = {scale:g} was given; leave scale out, or "
                "give file_unit if the file is wrong"
            )
        if is_known and size is None and (scale is None or _is_another_quantity(file_unit)):
            raise ValueError(
                f"{text}, but the recording needs {unit!r}; give scale as a number of {unit!r} per "
                f"{file_unit!r}, choose another channel, or give file_unit if the file is wrong"
                if volts is None
                else f"{text}; give the sensitivity of the sensor as scale, such as '50 mV/({unit})'"
            )
        return (1.0 if size is None else size) if scale is None else scale

    @property
    def kind(self) -> tuple[str, str]:
        """Quantity and unit of the channel, by default as required by its role."""
        return KNOWN_ROLES.get(self.role, (self.quantity, self.unit))


class Part(FrozenModel):
    """Start and end of a part of the plan in the file [s since the file's first sample]."""

    start_s: NonNegativeFloat
    stop_s: PositiveFloat

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if self.stop_s <= self.start_s:
            raise ValueError(
                f"stop_s = {self.stop_s:g} is not after start_s = {self.start_s:g} (from the file's start)"
            )
        return self


class ImportMapping(FrozenModel):
    """Information that an analysis needs and that is not in the file."""

    started_utc: AwareDatetime
    """Time of the measurement with time zone, such as ``2026-03-01T12:00:00Z``."""
    sample_rate_hz: PositiveFloat | None = None
    """Sample rate; needed if the file does not state it exactly (HDF5, universal files)."""
    time: Literal["file", "even"] = "file"
    """``"even"`` ignores times in the file: all channels are sampled evenly at ``sample_rate_hz``."""
    time_unit: Literal["s", "ms", "us"] | None = None
    """Unit of the times in the file, if it is missing or wrong there."""
    origin: Origin | None = None
    """``"real"`` or ``"simulated"``; by default as in the file, else real."""
    measurement: Measurement
    """Measurement as in a campaign file: name, excitation, notes."""
    begins_s: NonNegativeFloat = 0.0
    """Start of the excitation, including its settling time [s since the first sample]."""
    parts: tuple[Part, ...] = ()
    """Start and end of each part of the plan, if the parts do not follow one another."""
    channels: tuple[ChannelMapping, ...] = Field(min_length=1)
    specimen: SpecimenTable | None = None
    """Specimen, if it is not the paper's specimen."""
    calibration_valid_days: PositiveInt | None = None
    confirmations: dict[str, str | float] = Field(default_factory=dict)
    """Confirmed settings and remarks for the report, keyed by name."""

    @model_validator(mode="after")
    def _has_a_rate(self) -> Self:
        if self.time == "even" and self.sample_rate_hz is None:
            raise ValueError('time = "even" ignores the times of the file; give sample_rate_hz too')
        return self

    @model_validator(mode="after")
    def _roles_differ(self) -> Self:
        roles = [each.role for each in self.channels]
        twice = sorted({role for role in roles if roles.count(role) > 1})
        if twice:
            raise ValueError(f"{', '.join(twice)} is given more than once; each channel needs its own role")
        return self
