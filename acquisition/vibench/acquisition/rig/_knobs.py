"""Manual settings (knobs) that the operator confirms, and calibrations; every recording contains both."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from enum import StrEnum, auto
from pathlib import Path
from typing import Protocol, cast

from pydantic import AwareDatetime, Field

from ..errors import CheckFailed, CheckStopped, ConfigurationError
from ..host.toml_file import FrozenModel, load_toml, save_toml
from ..instruments import Knob, PlugInKind, SensorFacts, driver_of
from ._configuration import ChannelConfig, Rig
from ._sensors import Role, sensor_table


class Sensor(Protocol):
    """Entry point of ``vibench.sensors``: returns the properties of a sensor, and may query an instrument."""

    def __call__(self, rig: Rig, config: ChannelConfig, /) -> SensorFacts:
        """Return the properties of the sensor at an input of the converter."""


def sensor_name(config: ChannelConfig) -> str:
    """Return the name of the plug-in for a channel's sensor: as configured, or the default of its role."""
    if config.sensor is not None:
        return config.sensor
    table = sensor_table(config.role)
    return "wire" if config.role.quantity == "voltage" else "transducer" if "." in table else table


def wire(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Return the properties of a wire as a sensor: one volt per volt, before the channel's attenuation."""
    if config.role is Role.AMPLIFIER_VOLTAGE:
        return SensorFacts(
            "voltage", "V", 1.0, float("inf"), "amplifier output, by wire", rig.amplifier.serial
        )
    return SensorFacts("voltage", "V", 1.0, float("inf"), "the amplifier's input, by wire")


def transducer(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Return the properties of a channel's sensor, as described in the hardware configuration.

    Raises ConfigurationError when the configuration describes no sensor for the channel.
    """
    role, sensor = config.role, rig.sensor(config.role)
    if sensor is None:
        raise ConfigurationError(
            f"the channel {role.value} has no sensor; add the table [{sensor_table(role)}]"
        )
    return SensorFacts(
        role.quantity,
        role.unit,
        sensor.units_per_volt(role.unit),
        sensor.full_scale_v,
        sensor.name,
        sensor.serial,
        sensor.delay_s,
        sensor.calibrated,
    )


@dataclass(frozen=True)
class Channel:
    """One recorded quantity, and its conversion from volts to physical units."""

    role: Role
    physical: str
    """Full name of the input: ``"cDAQ1Mod1/ai2"``."""
    quantity: str
    """Physical quantity: ``"voltage"``, ``"acceleration"``, ``"force"``."""
    unit: str
    """Unit of the quantity as UDUNITS text: ``"V"``, ``"m s-2"``, ``"m s-1"``."""
    units_per_volt: float
    """Physical units per volt at the converter's input."""
    full_scale_v: float
    """Largest usable voltage at the input [V]: the sensor's output limit or the range, if that is smaller."""
    range_v: float
    coupling: str
    iepe_current_a: float
    sensor: str
    serial: str
    delay_s: float
    sensor_calibrated: date | None
    converter_calibrated: date


def channels_of(rig: Rig) -> tuple[Channel, ...]:
    """Return all channels of a rig, in the order of its configuration."""
    return tuple(_channel(rig, config) for config in rig.daq.channels)


def _channel(rig: Rig, config: ChannelConfig) -> Channel:
    # Raises BrokenPromise when the plug-in of a sensor fails or returns impossible values.
    name = sensor_name(config)
    sensor = cast("Sensor", driver_of(PlugInKind.SENSOR, name, Sensor))(rig, config)
    quantity, unit = config.role.quantity, config.role.unit
    if (sensor.quantity, sensor.unit) != (quantity, unit):
        raise ConfigurationError(
            f"the sensor {name!r} of {config.physical} measures {sensor.quantity} in {sensor.unit!r}, but "
            f"{config.role.value} records {quantity} in {unit!r}; give the channel another role or sensor"
        )
    return Channel(
        role=config.role,
        physical=f"{rig.daq.device}/{config.physical}",
        quantity=sensor.quantity,
        unit=sensor.unit,
        units_per_volt=sensor.units_per_volt * config.attenuation,
        full_scale_v=min(config.range_v, sensor.full_scale_v / config.attenuation),
        range_v=config.range_v,
        coupling=config.coupling,
        iepe_current_a=config.iepe_current_a,
        sensor=sensor.name,
        serial=sensor.serial,
        delay_s=sensor.delay_s,
        sensor_calibrated=sensor.calibrated,
        converter_calibrated=config.calibrated,
    )


# A confirmation is valid long enough for a campaign of 24 hours. After that, settings may have changed.
SHEET_VALID = timedelta(hours=36)
_YES = frozenset({"y", "yes"})


class KnobSheet(FrozenModel):
    """Manual settings that an operator has confirmed, with name and time."""

    operator: str = Field(min_length=1)
    """Name of the operator, or the means of confirmation."""
    confirmed: AwareDatetime
    knobs: tuple[Knob, ...]

    @property
    def values(self) -> dict[str, str]:
        """Value of each setting, keyed by the names of instrument and setting."""
        return {f"{knob.instrument} {knob.setting}": knob.value for knob in self.knobs}


Confirm = Callable[[tuple[Knob, ...]], KnobSheet]
"""Function that asks whether settings are right and returns the sheet; CheckFailed if a setting is wrong."""


def confirm_simulated(knobs: tuple[Knob, ...]) -> KnobSheet:
    """Return the sheet of a virtual rig, whose settings always agree with its configuration."""
    return KnobSheet(operator="simulated", confirmed=datetime.now(UTC), knobs=knobs)


def confirm_by_asking(ask: Callable[[str], str], operator: str) -> Confirm:
    """Return a function that confirms each setting by a question.

    ``ask`` shows a question and returns the answer, as ``input`` does; ``operator`` is the name to record.
    """

    def confirm(knobs: tuple[Knob, ...]) -> KnobSheet:
        for knob in knobs:
            question = f"{knob.instrument}: is the {knob.setting} at {knob.value}? [y/n] "
            if ask(question).strip().lower() not in _YES:
                raise CheckFailed(
                    f"the {knob.setting} of the {knob.instrument} was not confirmed at {knob.value}. Nothing "
                    "was energised; set the knob, or correct the hardware configuration, and try again"
                )
        return KnobSheet(operator=operator, confirmed=datetime.now(UTC), knobs=knobs)

    return confirm


def confirm_at_terminal(knobs: tuple[Knob, ...]) -> KnobSheet:
    """Ask at the terminal; raises CheckFailed if there is no terminal, CheckStopped on Ctrl-C.

    Unattended programs use `confirm_by_sheet`.
    """
    if not sys.stdin.isatty():
        wanted = "; ".join(_knob_text(knob) for knob in knobs)
        raise CheckFailed(
            f"these settings are made by hand and must be confirmed: {wanted}. Nothing was energised, "
            "because no one can answer here; confirm them at a terminal (vibench bench check --knobs "
            "SHEET.toml saves the answers, and vibench measure --knobs SHEET.toml uses them for 36 hours)"
        )
    try:
        operator = input("Who confirms the settings made by hand? ") or "at the terminal"
        return confirm_by_asking(input, operator)(knobs)
    except (KeyboardInterrupt, EOFError) as stop:
        raise CheckStopped("stopped before the knobs were confirmed; nothing was energised") from stop


def confirm_by_sheet(path: Path, valid: timedelta = SHEET_VALID) -> Confirm:
    """Return a function that accepts an earlier confirmation that is recent and has the same settings.

    ``path`` is a sheet from `save_knob_sheet`; ``valid`` is the time for which the sheet is valid. The
    function raises CheckFailed if the sheet is older or if its settings differ.
    """

    def confirm(knobs: tuple[Knob, ...]) -> KnobSheet:
        sheet = load_toml(path, KnobSheet)
        age = datetime.now(UTC) - sheet.confirmed
        if not timedelta(0) <= age <= valid:
            raise CheckFailed(
                f"{path} was confirmed at {sheet.confirmed:%Y-%m-%d %H:%M %Z}; it is valid for {valid}. "
                "Nothing was energised; confirm the knobs again"
            )
        return confirm_knobs_of(sheet, str(path), knobs)

    return confirm


def confirm_knobs_of(sheet: KnobSheet | None, origin: str, knobs: tuple[Knob, ...]) -> KnobSheet:
    """Return ``sheet`` if it confirms ``knobs``; otherwise raises CheckFailed, which names ``origin``."""
    missing = [_knob_text(knob) for knob in knobs if sheet is None or knob not in sheet.knobs]
    if sheet is None or missing:
        raise CheckFailed(
            f"{origin} does not confirm {'; '.join(missing)}. Nothing was energised; check these knobs and "
            "confirm them again"
        )
    return sheet


def save_knob_sheet(sheet: KnobSheet, path: Path) -> None:
    """Save a sheet, or replace an older sheet; raises ConfigurationError if the old file is no sheet."""
    if path.exists():
        load_toml(path, KnobSheet)
    save_toml(sheet, path)


def _knob_text(knob: Knob) -> str:
    return f"{knob.instrument} {knob.setting} at {knob.value}"


class CalibrationRule(StrEnum):
    """Policy for an expired calibration."""

    ENFORCED = auto()
    """The bench is not opened if a calibration has expired."""
    WAIVED = auto()
    """The bench is opened. Every recording contains the calibration dates."""


@dataclass(frozen=True)
class Calibration:
    """A calibration of a sensor or an input, and its age."""

    what: str
    calibrated: date
    age_days: int
    valid_days: int

    @property
    def is_valid(self) -> bool:
        """Whether the calibration is valid today; a date in the future is invalid."""
        return 0 <= self.age_days <= self.valid_days

    @property
    def advice(self) -> str:
        """Advice on what to do about an invalid calibration."""
        if self.age_days < 0:
            return "the date is in the future: enter the certificate's date in the configuration"
        return "have it calibrated, and enter the date in the configuration"

    def __str__(self) -> str:
        when = "a day in the future" if self.age_days < 0 else f"{self.age_days} days ago"
        return f"{self.what} was calibrated on {self.calibrated}, {when}"


def calibrations(rig: Rig, today: date) -> tuple[Calibration, ...]:
    """Return the calibrations of a rig: of every sensor with a calibration date, and of every input.

    Ages of calibrations refer to the date ``today``.
    """
    channels = channels_of(rig)
    sensors = dict.fromkeys(
        (each.sensor, each.serial, each.sensor_calibrated) for each in channels if each.sensor_calibrated
    )
    dates = [(sensor, calibrated) for sensor, _, calibrated in sensors]
    dates += [(f"{each.physical} of {rig.daq.product}", each.converter_calibrated) for each in channels]
    return tuple(
        Calibration(what, calibrated, (today - calibrated).days, rig.calibration_valid_days)
        for what, calibrated in dates
    )


def check_calibrations(rig: Rig, today: date) -> None:
    """Check all calibrations of a rig; raises CheckFailed with the calibrations that expired by ``today``."""
    stale = [str(calibration) for calibration in calibrations(rig, today) if not calibration.is_valid]
    if stale:
        raise CheckFailed(
            f"{'; '.join(stale)}; {rig.calibration_valid_days} days are allowed (calibration_valid_days). "
            "Nothing was opened; have it calibrated, enter the date on its certificate, or waive the rule"
        )
