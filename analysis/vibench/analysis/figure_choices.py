"""Choices for figures, in a separate module so that commands can list them without matplotlib."""

from enum import StrEnum


class ImageKind(StrEnum):
    """Image formats of figures; the value is the file suffix."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


SHOWN = {
    "response_i": "Response I of m0 over A0",
    "response_ii": "Response II of m0 over A0",
    "relative_i": "Response I of p over A0",
    "relative_ii": "Response II of p over A0",
    "impact_rate": "impacts per second",
    "contact_energy": "largest energy in a stop [J]",
    "lyapunov": "largest Lyapunov exponent [1/s]",
    "duration": "simulated time [s]",
    "motions": "number of motions reached from the initial states",
}
"""Quantities that a map can show in addition to the kinds of motion."""
