"""Sensors as described by data sheets and certificates, and the roles of channels."""

import re
from abc import abstractmethod
from collections.abc import Mapping
from datetime import date
from enum import StrEnum
from itertools import product
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, NonNegativeFloat, PositiveFloat

from ..host.toml_file import FrozenModel

_VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6}
_STANDARD_GRAVITY, _POUND_KG = 9.80665, 0.45359237
"""Standard gravity [m/s2] and pound [kg], both exact by definition (NIST SP 811)."""
_UNITS = {
    "m s-2": {
        **dict.fromkeys(("m/s2", "m s-2", "ms-2"), 1.0),
        **dict.fromkeys(("g", "gn"), _STANDARD_GRAVITY),
        "mm/s2": 1e-3,
        "cm/s2": 1e-2,
        "in/s2": 0.0254,
    },
    "m s-1": {
        **dict.fromkeys(("m/s", "m s-1"), 1.0),
        **dict.fromkeys(("mm/s", "mm s-1"), 1e-3),
        "um/s": 1e-6,
        "cm/s": 1e-2,
        "in/s": 0.0254,
    },
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": _POUND_KG * _STANDARD_GRAVITY},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254},
}
"""Value of each data-sheet unit in SI units, keyed by the SI unit of the recorded quantity."""
_EXAMPLES = {
    "m s-2": "'100 mV/g' or '10 mV/(m/s2)'",
    "m s-1": "'250 mm/s/V' or '4 V/(m/s)'",
    "N": "'11.2 mV/N'",
    "m": "'80 um/V' or '12.5 mV/um'",
}
_SMALLEST = 1e-12
"""Smallest number accepted in a sensitivity; the largest is its inverse. This limit catches typing errors."""
_NUMBER = re.compile(r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_SIGNS = str.maketrans({"µ": "u", "μ": "u", "²": "2", "¹": "1", "⁻": "-", "−": "-", "·": " ", "⋅": " "})


def volts_per_unit(text: str, unit: str) -> float:
    """Return the sensitivity in ``text``, written as in a data sheet, converted to [V per ``unit``].

    ``text`` is, for example, ``"100 mV/g"`` or ``"250 mm/s/V"``; ``unit`` is the recorded unit (``"m s-2"``).

    Raises ValueError when the text has no number above 0, has another unit, or is ambiguous.
    """
    words = " ".join(text.split())
    number = _NUMBER.match(words)
    digits = "" if number is None else number[0]
    spelled = _plain(words[len(digits) :])
    is_usable = digits and _SMALLEST <= float(digits) <= 1.0 / _SMALLEST
    for (volt, volts), (name, units) in product(_VOLTS.items(), _UNITS.get(unit, {unit: 1.0}).items()):
        if spelled == f"{volt}/{name}" and re.search("[/ ]", name):
            raise ValueError(f"{text!r} can be read in two ways; write '{digits} {volt}/({name})'")
        if spelled in {f"{volt}/({name})", f"{volt}/{name}"} and is_usable:
            return float(digits) * volts / units
        if spelled in {f"({name})/{volt}", f"{name}/{volt}"} and is_usable:
            return volts / (float(digits) * units)
    example = _EXAMPLES.get(unit, f"'50 mV/({unit})'")
    if re.search(r"\b[pn]C\b", spelled):
        raise ValueError(
            f"{text!r} is a charge, but the converter measures volts; give the sensitivity of the sensor "
            f"with its charge amplifier, such as {example}"
        )
    raise ValueError(
        f"{text!r} is not a sensitivity for {unit!r}; give a number above 0 with a unit, such as {example}"
    )


def size_of_unit(name: str, unit: str) -> float | None:
    """Return the value of the unit ``name`` in ``unit``: 9.80665 for ``"g"`` in ``"m s-2"``.

    Return None if ``name`` is a unit of another quantity, or if one of the two units is unknown.
    """
    volts = _VOLTS | dict.fromkeys(("v", "volt", "volts", "Volt", "Volts"), 1.0)
    return {**_UNITS, "V": volts}.get(unit, {}).get(_plain(name))


def _plain(unit: str) -> str:
    """Return a unit with a uniform spelling of powers, products and spaces."""
    letters = unit.translate(_SIGNS).replace("**", "").replace("^", "").replace("*", " ")
    return re.sub(r"\s*([/()])\s*", r"\1", letters).strip()


class Sourced(FrozenModel):
    """A value and its source, to distinguish assumptions from values of a data sheet."""

    value: PositiveFloat
    source: str = Field(min_length=1)


class StatedUncertainty(FrozenModel):
    """Relative uncertainty of a sensitivity, from a certificate or a data sheet."""

    relative: float = Field(gt=0.0, lt=1.0)
    """Expanded uncertainty relative to the value; 0.01 means 1 %."""
    coverage_factor: PositiveFloat = 2.0
    """Ratio of expanded to standard uncertainty: 2 on most certificates, 1.73 for uniform bounds."""
    source: str = Field(min_length=1)
    """Source of the uncertainty: certificate with its number, or data sheet."""


def _acceleration_sensitivity(given: object) -> object:
    return volts_per_unit(given, "m s-2") if isinstance(given, str) else given


def _velocity_range(given: object) -> object:
    return 1e3 / volts_per_unit(given, "m s-1") if isinstance(given, str) else given


class SensorConfig(FrozenModel):
    """A sensor, as its data sheet and certificate describe it."""

    model: str
    serial: str = ""
    full_scale_v: PositiveFloat
    """Largest output voltage of the sensor, peak [V]."""
    bandwidth_hz: PositiveFloat | None = None
    """Upper -3 dB frequency, first order [Hz]; absent if it is far above the measured band."""
    resonance_hz: PositiveFloat | None = None
    """Mounted resonance frequency [Hz]; absent if it is far above the measured band."""
    delay_s: NonNegativeFloat = 0.0
    """Signal delay of the electronics, including their bandwidth [s]; the analysis corrects this delay."""
    iepe: Literal["yes", "no"] = "no"
    """Whether the input supplies the sensor with a constant current."""
    calibrated: date
    uncertainty: StatedUncertainty | None = None
    """Uncertainty of the calibration; if absent, every result reports that no uncertainty was stated."""
    alignment_deg: Sourced | None = None
    """Largest angle between the motion and the sensitive axis or laser beam [degrees]."""
    noise_per_rthz: Sourced | None = None
    """Spectral density of the sensor noise [SI unit per root hertz]; absent if not stated."""

    @property
    def name(self) -> str:
        """Name of the sensor in results."""
        return self.model

    @abstractmethod
    def units_per_volt(self, unit: str) -> float:
        """Return the measured quantity per volt, in ``unit``, the SI unit of the channel."""


class TransducerConfig(SensorConfig):
    """A sensor in a table such as ``[sensors.m0_acceleration]``; not the base sensor or the vibrometer."""

    sensitivity: str
    """Sensitivity with the unit of the data sheet: ``"10 mV/g"``, ``"12.5 mV/um"``."""

    def units_per_volt(self, unit: str) -> float:
        """Return the quantity in ``unit`` per volt; raises ValueError if the sensitivity has another unit."""
        return 1 / volts_per_unit(self.sensitivity, unit)


class VibrometerConfig(SensorConfig):
    """The laser vibrometer. The operator sets range and filters manually, and confirms the settings."""

    decoder: str
    range_mm_per_s_per_v: Annotated[
        PositiveFloat, BeforeValidator(_velocity_range, json_schema_input_type=PositiveFloat | str)
    ]
    """Velocity range of the decoder [mm/s per volt], or text with another unit: ``"4 V/(m/s)"``."""
    bandwidth_hz: PositiveFloat
    tracking_filter: Literal["off", "fast", "medium", "slow"] = "off"
    delay_s: NonNegativeFloat
    """Signal delay of the decoder [s]; the analysis corrects the phase for this delay."""

    @property
    def name(self) -> str:
        """Name of the sensor in results: vibrometer and decoder."""
        return f"{self.model} {self.decoder}"

    def units_per_volt(self, unit: str) -> float:
        """Return the velocity per volt [m/s per volt]."""
        del unit
        return self.range_mm_per_s_per_v * 1e-3


class AccelerometerConfig(SensorConfig):
    """The accelerometer on the base."""

    sensitivity_v_per_m_per_s2: Annotated[
        PositiveFloat, BeforeValidator(_acceleration_sensitivity, json_schema_input_type=PositiveFloat | str)
    ]
    """Sensitivity [V per m/s2], or text with the unit of the data sheet: ``"100 mV/g"``."""
    resonance_hz: PositiveFloat
    iepe: Literal["yes", "no"]

    def units_per_volt(self, unit: str) -> float:
        """Return the acceleration per volt [m/s2 per volt]."""
        del unit
        return 1 / self.sensitivity_v_per_m_per_s2


class Role(StrEnum):
    """Place and quantity that a channel records; also the name of the dataset in the recording.

    ``base_force`` is the force of the shaker's table on everything mounted on the table.
    """

    DRIVE_VOLTAGE = "drive_voltage"
    AMPLIFIER_VOLTAGE = "amplifier_voltage"
    BASE_FORCE = "base_force"
    BASE_ACCELERATION = "base_acceleration"
    BASE_VELOCITY = "base_velocity"
    BASE_DISPLACEMENT = "base_displacement"
    M0_ACCELERATION = "m0_acceleration"
    M0_VELOCITY = "m0_velocity"
    M0_DISPLACEMENT = "m0_displacement"
    M1_ACCELERATION = "m1_acceleration"
    M1_VELOCITY = "m1_velocity"
    M1_DISPLACEMENT = "m1_displacement"
    M2_ACCELERATION = "m2_acceleration"
    M2_VELOCITY = "m2_velocity"
    M2_DISPLACEMENT = "m2_displacement"

    @property
    def place(self) -> str:
        """Place at which the channel measures: ``"base"``, ``"m0"``."""
        return self.value.partition("_")[0]

    @property
    def quantity(self) -> str:
        """Quantity that the channel measures: ``"voltage"``, ``"acceleration"``."""
        return self.value.partition("_")[2]

    @property
    def unit(self) -> str:
        """SI unit of the quantity as UDUNITS text: ``"m s-2"``."""
        return UNIT_OF_QUANTITY[self.quantity]


UNIT_OF_QUANTITY = {
    "voltage": "V",
    "force": "N",
    "acceleration": "m s-2",
    "velocity": "m s-1",
    "displacement": "m",
}
"""SI unit as UDUNITS text, by the quantity of a channel."""
RESPONSE_ROLES = (Role.M0_VELOCITY, Role.M0_ACCELERATION, Role.M0_DISPLACEMENT)
"""Channels that measure the motion of m0, in the order of preference."""
SCANNED_ROLES = (Role.M0_VELOCITY, Role.M1_VELOCITY, Role.M2_VELOCITY)
"""Channels in which a scan can record the vibrometer."""
_TABLES: Mapping[str, str] = {Role.BASE_ACCELERATION: "accelerometer", Role.M0_VELOCITY: "vibrometer"}


def sensor_table(role: str) -> str:
    """Return the name of the configuration table that describes the sensor of the channel ``role``."""
    return _TABLES.get(role, f"sensors.{role}")
