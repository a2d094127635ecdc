"""Sensitivities of sensors in the units of their data sheets."""

import re
from itertools import product

_VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6}
_STANDARD_GRAVITY, _POUND_KG = 9.80665, 0.45359237
"""By definition (NIST SP 811)."""
_UNITS = {
    "m s-2": {"m/s2": 1.0, "m s-2": 1.0, "ms-2": 1.0, "g": _STANDARD_GRAVITY, "gn": _STANDARD_GRAVITY},
    "m s-1": {"m/s": 1.0, "m s-1": 1.0, "mm/s": 1e-3, "mm s-1": 1e-3, "um/s": 1e-6, "in/s": 0.0254},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": _POUND_KG * _STANDARD_GRAVITY},
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": 0.0254},
}
"""Units of data sheets in SI units, by the unit of the recorded quantity."""
_EXAMPLES = {
    "m s-2": "'100 mV/g' or '10 mV/(m/s2)'",
    "m s-1": "'250 mm/s/V' or '4 V/(m/s)'",
    "N": "'11.2 mV/N'",
    "m": "'80 um/V' or '12.5 mV/um'",
}
_SMALLEST = 1e-12
"""Of a number in front of a unit; what lies beyond, or beyond its inverse, is a slip."""
_NUMBER = re.compile(r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_SIGNS = str.maketrans({"µ": "u", "μ": "u", "²": "2", "¹": "1", "⁻": "-", "−": "-", "·": " ", "⋅": " "})


def volts_per_unit(text: str, unit: str) -> float:
    """Read a sensitivity with its unit, as data sheets print it [V per ``unit``].

    ``text`` is ``"100 mV/g"`` or ``"250 mm/s/V"``; ``unit`` is the recorded unit, such as ``"m s-2"``.

    Raises ValueError when the text has no number above 0 or another unit, or can be read in two ways.
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
            f"{text!r} is a charge, and the converter measures volts; give the sensitivity of the sensor "
            f"with its charge amplifier, such as {example}"
        )
    raise ValueError(
        f"{text!r} is not a sensitivity for {unit!r}; give a number above 0 with a unit, such as {example}"
    )


def _plain(unit: str) -> str:
    """Write a unit with one spelling of powers, products and spaces."""
    letters = unit.translate(_SIGNS).replace("**", "").replace("^", "").replace("*", " ")
    return re.sub(r"\s*([/()])\s*", r"\1", letters).strip()
