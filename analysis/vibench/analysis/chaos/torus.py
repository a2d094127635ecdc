"""Whether the points of a section lie on a closed curve that they run round at one frequency."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from ..signals.arrays import Reals

_HARMONICS = 8
_EXPLAINED = 0.02
"""Part of the spread that the harmonics of one rotation may leave unexplained on a smooth closed curve."""
_NOISE_MARGIN = 1.5
_CLEAR = 0.8
"""Largest residual beside one rotation that stands out of noise."""
_MAINS_HZ = (50.0, 60.0)
_MAINS_HARMONICS = 3
_MAINS_WITHIN = 1e-3
"""Relative deviation of a grid's frequency."""


@dataclass(frozen=True)
class Rotation:
    """The best closed curve through a section's points."""

    turns_per_period: float
    """How far the points run round it in a drive period, 0 to 0.5."""
    left_over: float
    """Root mean square distance of the points from it, over their spread."""


def rotation(points: Reals) -> Rotation:
    """Fit the harmonics of one frequency to the points of a section.

    Parameters
    ----------
    points
        Shape (periods, coordinates).

    """
    centred = points - points.mean(axis=0)
    count = len(centred)
    window = np.hanning(count)[:, np.newaxis]
    power = np.sum(np.abs(np.fft.rfft(window * centred, axis=0)) ** 2, axis=1)
    strongest = int(np.argmax(power[1:])) + 1
    best = minimize_scalar(
        lambda turns: _residual(centred, turns),
        bounds=((strongest - 1) / count, (strongest + 1) / count),
        method="bounded",
        options={"xatol": 1e-3 / count**1.5},
    )
    spread = float(np.sqrt(np.mean(centred**2)))
    return Rotation(float(best.x), float(best.fun) / spread if spread > 0 else 0.0)


def is_torus(found: Rotation, noise_over_spread: float) -> bool:
    """Whether the closed curve explains all but noise."""
    return found.left_over <= min(max(_EXPLAINED, _NOISE_MARGIN * noise_over_spread), _CLEAR)


def mains_hz(found: Rotation, drive_hz: float, periods: int) -> float | None:
    """Return the mains frequency, or its harmonic, that explains this rotation of the points; else None."""
    for mains in _MAINS_HZ:
        for hum_hz in mains * np.arange(1, _MAINS_HARMONICS + 1):
            turns = hum_hz / drive_hz
            seen = abs(turns - round(turns))
            if abs(seen - found.turns_per_period) <= _MAINS_WITHIN * turns + 0.5 / periods:
                return float(hum_hz)
    return None


def _residual(centred: Reals, turns: float) -> float:
    angle = 2 * np.pi * turns * np.arange(len(centred))[:, np.newaxis] * np.arange(1, _HARMONICS + 1)
    basis = np.hstack((np.cos(angle), np.sin(angle), np.ones((len(centred), 1))))
    fitted, *_ = np.linalg.lstsq(basis, centred, rcond=None)
    return float(np.sqrt(np.mean((centred - basis @ fitted) ** 2)))
