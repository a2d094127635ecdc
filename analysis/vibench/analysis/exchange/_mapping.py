"""Mapping of a foreign file, as TOML: its channels and the excitation."""

from datetime import date
from typing import Literal, Self

from pydantic import AwareDatetime, Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import ROLE_PATTERN, Origin
from vibench.acquisition.rig import volts_per_unit
from vibench.sim import FrozenModel, SpecimenTable

from ..recordings.channels import BASE, DRIVE
from ..recordings.response import ACCELERATION, DISPLACEMENT, VELOCITY

KNOWN_ROLES = {
    DRIVE: ("voltage", "V"),
    "amplifier_voltage": ("voltage", "V"),
    BASE: ("acceleration", "m s-2"),
    VELOCITY: ("velocity", "m s-1"),
    ACCELERATION: ("acceleration", "m s-2"),
    DISPLACEMENT: ("displacement", "m"),
}
"""Quantity and unit of these channels in the analysis."""


class ChannelMapping(FrozenModel):
    """One channel: ``value = factor * number in the file + offset``, in ``unit``."""

    source: str = Field(min_length=1)
    """Its name in the file, as `vibench import FILE` lists it."""
    role: str = Field(pattern=f"^{ROLE_PATTERN.pattern}$")
    """Its name in the recording: ``drive_voltage``, ``base_acceleration``, ``m0_velocity``,
    ``m0_acceleration``, ``m0_displacement``, or any other."""
    quantity: str = ""
    unit: str = ""
    """UDUNITS text of the value; known for the channels that an analysis needs."""
    scale: float | str = 1.0
    """Unit per number in the file; of a file in volts, or the sensor's sensitivity: ``"100 mV/g"``."""
    offset: float = 0.0
    full_scale: PositiveFloat | None = None
    """Full scale of the input, as a number in the file; values near it are marked as overloads."""
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
                    f"{self.role} needs a quantity and a unit; they are known of {', '.join(KNOWN_ROLES)}"
                )
            return self
        for given, needed in zip((self.quantity, self.unit), KNOWN_ROLES[self.role], strict=True):
            if given not in {"", needed}:
                raise ValueError(
                    f"{self.role} is in {needed!r}, and {given!r} was given; convert it by scale"
                )
        return self

    @model_validator(mode="after")
    def _has_a_scale(self) -> Self:
        if self.factor == 0:
            raise ValueError(
                f"the scale of {self.role} is 0, which leaves nothing of it; give unit per number"
            )
        return self

    @property
    def factor(self) -> float:
        """Unit per number in the file."""
        if not isinstance(self.scale, str):
            return self.scale
        unit = self.kind[1]
        if unit == "V":
            raise ValueError(f"scale = {self.scale!r} was given for {self.role}, a voltage; give a number")
        return 1.0 / volts_per_unit(self.scale, unit)

    @property
    def kind(self) -> tuple[str, str]:
        """Quantity and unit, by default from its role."""
        return KNOWN_ROLES.get(self.role, (self.quantity, self.unit))


class Part(FrozenModel):
    """Place of a part of the plan in the file [s since its first sample]."""

    start_s: NonNegativeFloat
    stop_s: PositiveFloat

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if self.stop_s <= self.start_s:
            raise ValueError(
                f"stop_s = {self.stop_s:g} is not after start_s = {self.start_s:g}; count both from the start"
            )
        return self


class ImportMapping(FrozenModel):
    """Information for the analysis that is not in the file."""

    started_utc: AwareDatetime
    """Time of the measurement with time zone: ``2026-03-01T12:00:00Z``."""
    sample_rate_hz: PositiveFloat | None = None
    """Sample rate; needed if the file does not state it exactly (HDF5, universal files)."""
    time: Literal["file", "even"] = "file"
    """``"even"``: samples are simultaneous and even at ``sample_rate_hz``; ignores times in the file."""
    time_unit: Literal["s", "ms", "us"] | None = None
    """Unit of the times in the file, if missing or wrong there."""
    origin: Origin | None = None
    """``"real"`` or ``"simulated"``; by default as in the file, else real."""
    measurement: Measurement
    """Measurement as in a campaign: name, excitation, notes."""
    begins_s: NonNegativeFloat = 0.0
    """Start of the excitation including settling [s since the first sample]."""
    parts: tuple[Part, ...] = ()
    """Place of each part of the plan, if they do not follow one another."""
    channels: tuple[ChannelMapping, ...] = Field(min_length=1)
    specimen: SpecimenTable | None = None
    """The specimen, if it is not the paper's."""
    calibration_valid_days: PositiveInt | None = None
    confirmations: dict[str, str | float] = Field(default_factory=dict)
    """Remarks for the report."""

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
