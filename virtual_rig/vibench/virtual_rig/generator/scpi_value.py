"""SCPI parameters and replies: numbers with their unit, words, booleans, binary blocks."""

import math
import re
from collections.abc import Mapping
from decimal import Decimal

from .scpi_header import mnemonic_matches
from .scpi_status import ErrorCode, ScpiError

INFINITE = 9.9e37
"""What SCPI sends for infinity (SCPI-1999, volume 1, 7.2.1.4)."""

# SCPI multipliers: M is milli except before HZ, where it is mega (SCPI-1999, volume 1, 7.1.4.3).
FREQUENCY_UNITS: Mapping[str, float] = {
    "": 1.0,
    "UHZ": 1e-6,
    "HZ": 1.0,
    "KHZ": 1e3,
    "MHZ": 1e6,
    "MAHZ": 1e6,
    "GHZ": 1e9,
}
VOLTAGE_UNITS: Mapping[str, float] = {"": 1.0, "UV": 1e-6, "MV": 1e-3, "V": 1.0, "KV": 1e3}
AMPLITUDE_UNITS: Mapping[str, float] = {
    **VOLTAGE_UNITS,
    "UVPP": 1e-6,
    "MVPP": 1e-3,
    "VPP": 1.0,
}
RESISTANCE_UNITS: Mapping[str, float] = {"": 1.0, "OHM": 1.0, "KOHM": 1e3, "MOHM": 1e6}
PERCENT_UNITS: Mapping[str, float] = {"": 1.0, "PCT": 1.0, "%": 1.0}
NO_UNITS: Mapping[str, float] = {"": 1.0}

_NUMBER = re.compile(r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?)\s*(?P<unit>[A-Z%]*)", re.IGNORECASE)


def text(parameter: bytes) -> str:
    """Decode a parameter that must be plain text."""
    try:
        return parameter.decode("ascii")
    except UnicodeDecodeError:
        raise ScpiError(ErrorCode.DATA_TYPE_ERROR) from None


def number(parameter: bytes, units: Mapping[str, float]) -> float:
    """Read ``1.5kHz`` or ``INF``: the value in the base unit.

    Raises ScpiError: -131 for a unit that does not belong here, -104 for what is no number.
    """
    if mnemonic_matches(text(parameter), "INFinity"):
        return INFINITE
    value, unit = number_and_unit(parameter)
    if unit not in units:
        raise ScpiError(ErrorCode.INVALID_SUFFIX)
    return _finite(value * units[unit])


def _finite(value: float) -> float:
    """Refuse what overflows: -123, the exponent is too large (SCPI-1999, volume 2, 21.8.9)."""
    if not math.isfinite(value):
        raise ScpiError(ErrorCode.EXPONENT_TOO_LARGE)
    return value


def number_and_unit(parameter: bytes) -> tuple[float, str]:
    """Split ``31 deg`` into 31.0 and ``"DEG"``."""
    found = _NUMBER.fullmatch(text(parameter))
    if found is None:
        raise ScpiError(ErrorCode.DATA_TYPE_ERROR)
    return _finite(float(found["number"])), found["unit"].upper()


def integer(parameter: bytes) -> int:
    """Read a whole number; fractions are rounded, as SCPI asks."""
    return round(number(parameter, NO_UNITS))


def boolean(parameter: bytes) -> bool:
    """Read ON, OFF or a number; anything that rounds to zero is OFF."""
    word = text(parameter).upper()
    if word in ("ON", "OFF"):
        return word == "ON"
    return integer(parameter) != 0


def block(parameter: bytes) -> bytes:
    """Return the data of a definite or indefinite binary block (IEEE 488.2-1992, 7.7.6)."""
    if not parameter.startswith(b"#") or not parameter[1:2].isdigit():
        raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
    digits = int(parameter[1:2])
    if digits == 0:
        return parameter[2:]
    number = parameter[2 : 2 + digits]
    if not number.isdigit() or len(parameter) != 2 + digits + int(number):
        raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
    return parameter[2 + digits :]


def as_block(data: bytes) -> bytes:
    """Wrap data as a definite-length block."""
    count = str(len(data))
    return f"#{len(count)}{count}".encode("ascii") + data


def as_number(value: float) -> bytes:
    """Write a number the way the instrument answers: ``1.5E+03``, ``9.9E+37``, ``0.0E+00``."""
    sign, digits, exponent = Decimal(repr(float(f"{value:.12g}"))).normalize().as_tuple()
    if not isinstance(exponent, int) or not any(digits):
        return b"0.0E+00"
    mantissa = "".join(map(str, digits))
    power = exponent + len(mantissa) - 1
    return f"{'-' if sign else ''}{mantissa[0]}.{mantissa[1:] or '0'}E{power:+03d}".encode("ascii")
