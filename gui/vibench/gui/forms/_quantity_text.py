"""Quantities as people type them: "12,5", "5 ms", "45 µm", "2 kHz"."""

import re

from vibench.acquisition import ConfigurationError

PREFIXES = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "u": 1e-6, "μ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
_SHOWN = ((1e-12, "p"), (1e-9, "n"), (1e-6, "µ"), (1e-3, "m"))
_NUMBER = re.compile(r"^\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*$")
PREFIXED = frozenset({"m", "V", "Vpp", "s", "m/s", "A", "N", "Hz", "g", "kg"})
"""Units that are shown with a prefix where the number would be small."""


def quantity_text(value: float, unit: str) -> str:
    """Write a value with its unit, with every digit it has."""
    if unit in PREFIXED and unit != "kg" and 0 < abs(value) < 1e-2:
        size, prefix = next(
            ((size, prefix) for size, prefix in reversed(_SHOWN) if abs(value) >= size), _SHOWN[0]
        )
        # Twelve digits hide that 4.5e-05 / 1e-06 is not quite 45; parsing must give the same value back.
        shown = f"{value / size:.12g}"
        if parsed_quantity(f"{shown} {prefix}{unit}", unit) == value:
            return f"{shown} {prefix}{unit}"
    number = f"{value:.15g}" if float(f"{value:.15g}") == value else repr(value)
    return f"{number} {unit}".strip()


def parsed_quantity(text: str, unit: str) -> float:
    """Read a value in SI; a comma is a decimal point, a unit may carry a prefix.

    Raises
    ------
    ConfigurationError
        When it is no number, or its unit is another one.

    """
    match = _NUMBER.match(text)
    if match is None:
        example = f"12.5 {unit}".strip()
        raise ConfigurationError(f"{text!r} is not a number; write for example {example}")
    number, given = match[1].replace(",", "."), match[2]
    if given in ("", unit):
        return float(number)
    if unit and given.endswith(unit) and given.removesuffix(unit) in PREFIXES:
        return _scaled(number, given.removesuffix(unit))
    raise ConfigurationError(f"{given!r} is not a unit of this field; give {unit or 'a plain number'}")


def _scaled(number: str, prefix: str) -> float:
    """Move the decimal point in the text, so that 45 µm is the same number as 45e-6."""
    power = {"p": -12, "n": -9, "µ": -6, "u": -6, "μ": -6, "m": -3, "": 0, "k": 3, "M": 6}[prefix]
    mantissa, _, exponent = number.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + power}")
