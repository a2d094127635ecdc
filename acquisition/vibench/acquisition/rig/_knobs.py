"""Manual settings, which the operator confirms, and calibrations; both are stored in every recording."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from enum import StrEnum, auto
from pathlib import Path
from typing import Protocol, cast

from pydantic import AwareDatetime, Field

from vibench.sim.operating_system.this import replace_file

from ..errors import CheckFailed, CheckStopped, ConfigurationError
from ..host.toml_file import FrozenModel, load_toml
from ..instruments import Knob, PlugInKind, SensorFacts, driver_of
from ._configuration import ChannelConfig, Rig
from ._sensors import Role, sensor_table


class Sensor(Protocol):
    """Entry point of ``vibench.sensors``: returns a sensor's facts, and may read its instrument."""

    def __call__(self, rig: Rig, config: ChannelConfig, /) -> SensorFacts:
        """Return the facts of the sensor in front of an input."""


def sensor_name(config: ChannelConfig) -> str:
    """Return the plug-in of a channel's sensor: the configured one, or the default of its role."""
    if config.sensor is not None:
        return config.sensor
    table = sensor_table(config.role)
    return "wire" if config.role.quantity == "voltage" else "transducer" if "." in table else table


def sensor_of(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Return the facts of the sensor in front of an input.

    Raises ConfigurationError when no package offers it, or it measures another quantity than the channel;
    BrokenPromise when another package's sensor fails or returns impossible facts.
    """
    name = sensor_name(config)
    facts = cast("Sensor", driver_of(PlugInKind.SENSOR, name, Sensor))(rig, config)
    quantity, unit = config.role.quantity, config.role.unit
    if (facts.quantity, facts.unit) != (quantity, unit):
        raise ConfigurationError(
            f"the sensor {name!r} of {config.physical} tells of {facts.quantity} in {facts.unit!r}, and "
            f"{config.role.value} records {quantity} in {unit!r}; give the channel another role or sensor"
        )
    return facts


def wire(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Return the facts of a wire: volts, divided by the channel's attenuation."""
    if config.role is Role.AMPLIFIER_VOLTAGE:
        return SensorFacts(
            "voltage", "V", 1.0, float("inf"), "amplifier output, by wire", rig.amplifier.serial
        )
    return SensorFacts("voltage", "V", 1.0, float("inf"), "the amplifier's input, by wire")


def transducer(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Return the sensor that the hardware configuration describes for a channel.

    Raises ConfigurationError when the configuration describes no sensor for it.
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
    """One recorded quantity, and the conversion of its volts to units."""

    role: Role
    physical: str
    """Full name at the converter: ``"cDAQ1Mod1/ai2"``."""
    quantity: str
    """``"voltage"``, ``"acceleration"``, ``"force"``."""
    unit: str
    """UDUNITS text: ``"V"``, ``"m s-2"``, ``"m s-1"``."""
    units_per_volt: float
    """Physical units per volt at the converter's input."""
    full_scale_v: float
    """The smaller of the sensor's largest output and the input's range [V]."""
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
    sensor = sensor_of(rig, config)
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


# A sheet covers a campaign of a day and a night; after that, settings may have changed.
SHEET_VALID = timedelta(hours=36)
_YES = frozenset({"y", "yes"})


class KnobSheet(FrozenModel):
    """Settings that an operator has looked at, with name and time."""

    operator: str = Field(min_length=1)
    """Name, or the way of confirmation."""
    confirmed: AwareDatetime
    knobs: tuple[Knob, ...]


Confirm = Callable[[tuple[Knob, ...]], KnobSheet]
"""Ask about the settings and return the sheet; raises CheckFailed when one of them is wrong."""


def confirm_simulated(knobs: tuple[Knob, ...]) -> KnobSheet:
    """Confirm the settings of a virtual rig, which always follow its configuration."""
    return KnobSheet(operator="simulated", confirmed=datetime.now(UTC), knobs=knobs)


def confirm_by_asking(ask: Callable[[str], str], operator: str) -> Confirm:
    """Return a function that asks one question about each setting.

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
    """Ask at the terminal; raises CheckFailed when there is none, CheckStopped at a Ctrl-C.

    An unattended program uses `confirm_by_sheet`.
    """
    if not sys.stdin.isatty():
        wanted = "; ".join(_shown(knob) for knob in knobs)
        raise CheckFailed(
            f"these settings are made by hand and must be confirmed: {wanted}. Nobody sits at "
            "this terminal and nothing was energised; confirm them at one (vibench bench check --knobs "
            "SHEET.toml keeps the answers, and vibench measure --knobs SHEET.toml takes them for 36 hours)"
        )
    try:
        operator = input("Who confirms the settings made by hand? ") or "at the terminal"
        return confirm_by_asking(input, operator)(knobs)
    except (KeyboardInterrupt, EOFError) as stop:
        raise CheckStopped("stopped at the settings made by hand; nothing was energised") from stop


def confirm_by_sheet(path: Path, valid: timedelta = SHEET_VALID) -> Confirm:
    """Return a function that accepts an earlier confirmation if it is recent and has the same settings.

    ``path`` is a sheet from `save_knob_sheet`; ``valid`` is how long it counts. The function raises
    CheckFailed when the sheet is older or has other settings.
    """

    def confirm(knobs: tuple[Knob, ...]) -> KnobSheet:
        sheet = load_knob_sheet(path)
        age = datetime.now(UTC) - sheet.confirmed
        if not timedelta(0) <= age <= valid:
            raise CheckFailed(
                f"{path} was confirmed at {sheet.confirmed:%Y-%m-%d %H:%M %Z}; it is valid for {valid}. "
                "Nothing was energised; confirm the knobs again"
            )
        missing = [_shown(knob) for knob in knobs if knob not in sheet.knobs]
        if missing:
            raise CheckFailed(
                f"{path} does not confirm {'; '.join(missing)}. Nothing was energised; look at these "
                "knobs and confirm them again"
            )
        return sheet

    return confirm


def save_knob_sheet(sheet: KnobSheet, path: Path) -> None:
    """Save a sheet, replacing an older one; raises ConfigurationError when the file is not a sheet."""
    if path.exists():
        load_knob_sheet(path)
    knobs = "".join(
        f"\n[[knobs]]\ninstrument = {_quote(knob.instrument)}\nsetting = {_quote(knob.setting)}\n"
        f"value = {_quote(knob.value)}\n"
        for knob in sheet.knobs
    )
    text = f"operator = {_quote(sheet.operator)}\nconfirmed = {sheet.confirmed.isoformat()}\n{knobs}"
    try:
        with replace_file(path) as coming:
            coming.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"{path} cannot be written ({error.strerror}); nothing was energised, give another place"
        ) from error


def load_knob_sheet(path: Path) -> KnobSheet:
    """Read a sheet; raises ConfigurationError with file, key and allowed values."""
    return load_toml(path, KnobSheet)


def _shown(knob: Knob) -> str:
    return f"{knob.instrument} {knob.setting} at {knob.value}"


def _quote(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    printable = "".join(c if c.isprintable() else f"\\u{ord(c):04X}" for c in escaped)
    return f'"{printable}"'


class CalibrationRule(StrEnum):
    """Effect of an expired calibration."""

    ENFORCED = auto()
    """The bench does not open."""
    WAIVED = auto()
    """The bench opens; every recording contains the dates."""


@dataclass(frozen=True)
class Calibration:
    """A calibration and its age."""

    what: str
    calibrated: date
    age_days: int
    valid_days: int

    @property
    def is_to_come(self) -> bool:
        """Whether its date is in the future, which is a mistake."""
        return self.age_days < 0

    @property
    def is_valid(self) -> bool:
        """Whether it is valid today; a future date is not."""
        return 0 <= self.age_days <= self.valid_days

    @property
    def advice(self) -> str:
        """Advice about an invalid calibration."""
        if self.is_to_come:
            return "the date is in the future: enter the one on the certificate in the configuration"
        return "have it calibrated, and enter the date in the configuration"

    def __str__(self) -> str:
        when = "a day in the future" if self.is_to_come else f"{self.age_days} days ago"
        return f"{self.what} was calibrated on {self.calibrated}, {when}"


def calibrations(rig: Rig, today: date) -> tuple[Calibration, ...]:
    """Return all calibrations of a rig: of every sensor with a date, and of every input.

    Their ages are counted up to ``today``.
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
    """Check all calibrations of a rig; raises CheckFailed, which names each one expired by ``today``."""
    stale = [str(calibration) for calibration in calibrations(rig, today) if not calibration.is_valid]
    if stale:
        raise CheckFailed(
            f"{'; '.join(stale)}; {rig.calibration_valid_days} days are allowed (calibration_valid_days). "
            "Nothing was opened; have it calibrated, enter the date on its certificate, or waive the rule"
        )
