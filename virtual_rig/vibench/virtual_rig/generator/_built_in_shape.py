"""The 45 built-in shapes of the AFG1000 series, as tables of 14-bit codes.

Names as the programmer manual prints them (as quoted in public AFG1000 drivers; the IVI driver tkafg1k
lists the same 45). The manual gives no formulas: each table is the textbook function of that name,
scaled to the full code range. The paper's experiment needs none of them; do not rely on their detail.
"""

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ._arbitrary_memory import MOST_POINTS, TOP_CODE, Codes

Samples = NDArray[np.float64]
Formula = Callable[[Samples], Samples]
"""From phase (0..1) to any range; the table is scaled to the full code range."""

STAIRS = 8
"""Steps of the staircases."""
CODED_BITS = (1, 0, 1, 1, 0, 0, 1, 0)
"""The pattern of the coded pulse."""


def _steps(x: Samples) -> Samples:
    return np.floor(STAIRS * x)


def _beat(x: Samples) -> Samples:
    """One heartbeat: P wave, QRS complex, T wave, as a sum of bell curves."""
    waves = (
        (0.2, 0.025, 0.15),
        (0.36, 0.01, -0.15),
        (0.4, 0.012, 1.0),
        (0.44, 0.01, -0.25),
        (0.65, 0.04, 0.3),
    )
    return np.asarray(sum(height * np.exp(-0.5 * ((x - at) / width) ** 2) for at, width, height in waves))


def _tan_like(x: Samples) -> Samples:
    return np.clip(np.tan(np.pi * (x - 0.5) * 0.96), -10, 10)


FORMULAS: Mapping[str, Formula] = {
    "StairDown": lambda x: -_steps(x),
    "StairUp": _steps,
    "Stair Up&Dwn": lambda x: np.floor(STAIRS * (1 - np.abs(2 * x - 1))),
    "Trapezoid": lambda x: np.clip(2 - np.abs(8 * x - 4), -1, 1),
    "RoundHalf": lambda x: np.sqrt(np.clip(1 - (2 * x - 1) ** 2, 0, None)),
    "AbsSine": lambda x: np.abs(np.sin(2 * np.pi * x)),
    "AbsHalfSine": lambda x: np.clip(np.sin(2 * np.pi * x), 0, None),
    "ClippedSine": lambda x: np.clip(np.sin(2 * np.pi * x), -0.7, 0.7),
    "ChoppedSine": lambda x: np.where((4 * x) % 1 < 0.5, 0, np.sin(2 * np.pi * x)),
    "NegRamp": lambda x: -x,
    "OscRise": lambda x: np.exp(5 * (x - 1)) * np.sin(20 * np.pi * x),
    "OscDecay": lambda x: np.exp(-5 * x) * np.sin(20 * np.pi * x),
    "CodedPulse": lambda x: np.take(
        np.asarray(CODED_BITS, float), np.floor(len(CODED_BITS) * x).astype(int), mode="clip"
    ),
    "PosPulse": lambda x: np.where(x < 0.1, 1.0, 0.0),
    "NegPulse": lambda x: np.where(x < 0.1, -1.0, 0.0),
    "ExpRise": lambda x: 1 - np.exp(-5 * x),
    "ExpDecay": lambda x: np.exp(-5 * x),
    "Sinc": lambda x: np.sinc(16 * (x - 0.5)),
    "Tan": _tan_like,
    "Cotan": lambda x: -_tan_like(x),
    "SquareRoot": np.sqrt,
    "X^2": np.square,
    "HaverSine": lambda x: 0.5 * (1 - np.cos(2 * np.pi * x)),
    "Lorentz": lambda x: 1 / (1 + (20 * (x - 0.5)) ** 2),
    "Ln(x)": lambda x: np.log(x + 1 / MOST_POINTS),
    "X^3": lambda x: (2 * x - 1) ** 3,
    "CauchyDistr": lambda x: 1 / (1 + (10 * (x - 0.5)) ** 2),
    "BesselJ": lambda x: special.jv(1, 40 * (x - 0.5)),
    "BesselY": lambda x: special.yv(1, 1 + 20 * x),
    "ErrorFunc": lambda x: special.erf(6 * (x - 0.5)),
    "Airy": lambda x: special.airy(20 * x - 15)[0],
    "Rectangle": lambda x: np.where(np.abs(x - 0.5) < 0.25, 1.0, 0.0),
    "Gauss": lambda x: np.exp(-0.5 * ((x - 0.5) / 0.1) ** 2),
    "Hamming": lambda x: 0.54 - 0.46 * np.cos(2 * np.pi * x),
    "Hanning": lambda x: 0.5 * (1 - np.cos(2 * np.pi * x)),
    "Bartlett": lambda x: 1 - np.abs(2 * x - 1),
    "Blackman": lambda x: 0.42 - 0.5 * np.cos(2 * np.pi * x) + 0.08 * np.cos(4 * np.pi * x),
    "Laylight": lambda x: special.expit(20 * (x - 0.5)),
    "Triangle": lambda x: 1 - np.abs(4 * ((x + 0.25) % 1) - 2),
    "DC": np.zeros_like,
    "Heart": lambda x: np.sqrt(np.abs(np.cos(2 * np.pi * x))) * np.sign(np.sin(2 * np.pi * x)),
    "Round": lambda x: np.sign(0.5 - x) * np.sqrt(np.clip(1 - (4 * (x % 0.5) - 1) ** 2, 0, None)),
    "Chirp": lambda x: np.sin(2 * np.pi * (x + 15 * x**2)),
    "Rhombus": lambda x: (1 - np.abs(2 * x - 1)) * np.where(np.floor(64 * x) % 2 == 0, 1.0, -1.0),
    "Cardiac": _beat,
}


@cache
def codes(name: str) -> Codes:
    """Return the table of a built-in shape, 8192 codes that fill the range 0..16383."""
    phase = np.arange(MOST_POINTS) / MOST_POINTS
    values = np.asarray(FORMULAS[name](phase), dtype=np.float64)
    lowest, highest = values.min(), values.max()
    if highest == lowest:
        return np.full(MOST_POINTS, TOP_CODE // 2, dtype=np.uint16)
    return np.asarray(np.rint((values - lowest) / (highest - lowest) * TOP_CODE), dtype=np.uint16)
