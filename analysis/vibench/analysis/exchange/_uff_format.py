"""Universal dataset 58, as far as writing and reading share it."""

import re

DELIMITER = "    -1"
TIME_RESPONSE = 1
REAL_SINGLE, REAL_DOUBLE = 2, 4
SINGLE_BYTES, DOUBLE_BYTES = 4, 8
EVENLY_SPACED = 1
TIME_AXIS = 17
UNKNOWN = (0, 0, 0, 0)
QUANTITIES = {
    "displacement": (8, 1, 0, 0),
    "velocity": (11, 1, 0, 0),
    "acceleration": (12, 1, 0, 0),
    "force": (13, 0, 1, 0),
}
"""Specific data type, and the exponents of length, force and temperature (addendum A)."""
MONTHS = ("JAN", "FEB", "MAR", "APR", "MAY", "JUN", "JUL", "AUG", "SEP", "OCT", "NOV", "DEC")
ID_WIDTH = 80
RATE = re.compile(r"\bsample_rate_hz=(\S+)")


def id_line(text: str) -> str:
    """One of the five ID lines; they may not be empty."""
    return f"{text.strip() or 'NONE':<{ID_WIDTH}.{ID_WIDTH}}"


def rate_line(sample_rate_hz: float, first_sample: int) -> str:
    """Write what the increment of time cannot hold: every digit of the sample rate."""
    return f"sample_rate_hz={sample_rate_hz!r} first_sample={first_sample}"


def exact_rate_hz(line: str) -> float | None:
    """Read back what :func:`rate_line` wrote; None when somebody else wrote the line."""
    found = RATE.search(line)
    return None if found is None else float(found[1])
