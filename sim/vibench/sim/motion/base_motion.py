"""A drive cut into intervals on which the base displacement is a cubic polynomial. SI units.

Sampled drives: the C2 spline through the samples, which is the definition of the drive. Sweeps: the cubic
that matches displacement and velocity at both ends of each interval (C1). Its error in displacement is at
most amplitude (omega h)^4 / 384 for the highest frequency; h is chosen so that this is a thousandth of the
tolerance.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.accuracy import Accuracy
from ..model.drive import Sampled, Sweep

HERMITE = 384.0
"""Cubic Hermite interpolation errs by h^4 / 384 times the fourth derivative."""
SHARE = 1e-3
"""Part of the accuracy's tolerance that the interpolation of a sweep may use."""
SHORTEST_TURN = 0.005
"""Below this many radians an interval gains nothing: its error is 2e-12 of the amplitude."""


class BaseMotion(NamedTuple):
    """Base displacement as cubics on equal intervals."""

    interval: float
    """[s]."""
    pieces: NDArray[np.float64]
    """Shape (intervals, 4): c0 ... c3 of U(tau) = c0 + c1 tau + c2 tau^2 + c3 tau^3."""


def sampled_motion(drive: Sampled) -> BaseMotion:
    """Cut a sampled drive at its samples."""
    interval = 1.0 / drive.sample_rate_hz
    # In units of the interval: the spline of the sample numbers is exact about where the knots are.
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - harmonic drives do without scipy

    spline = CubicSpline(np.arange(len(drive.displacement_m), dtype=np.float64), drive.displacement_m)
    return BaseMotion(interval, np.ascontiguousarray(spline.c[::-1].T / interval ** np.arange(4)))


def sweep_interval_s(drive: Sweep, accuracy: Accuracy) -> float:
    """Length of interval at which the interpolation keeps to its share of the tolerance."""
    turn = max(SHORTEST_TURN, (HERMITE * SHARE * accuracy.tolerance) ** 0.25)
    intervals = math.ceil(drive.duration_s * 2.0 * math.pi * drive.highest_hz / turn)
    interval: float = drive.duration_s / intervals
    return interval


def sweep_motion(drive: Sweep, interval_s: float, first: int, count: int) -> BaseMotion:
    """Cut ``count`` intervals of a sweep, beginning with interval ``first``."""
    time_s = np.arange(first, first + count + 1, dtype=np.float64) * interval_s
    turns = drive.turns(time_s)
    angle = 2.0 * np.pi * (turns - np.floor(turns))
    value = drive.amplitude_m * np.sin(angle)
    slope = 2.0 * np.pi * drive.frequency_hz(time_s) * drive.amplitude_m * np.cos(angle) * interval_s
    rise = np.diff(value)
    quadratic = 3.0 * rise - 2.0 * slope[:-1] - slope[1:]
    cubic = slope[:-1] + slope[1:] - 2.0 * rise
    scaled = np.column_stack([value[:-1], slope[:-1], quadratic, cubic])
    return BaseMotion(interval_s, np.ascontiguousarray(scaled / interval_s ** np.arange(4)))
