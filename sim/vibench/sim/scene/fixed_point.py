"""Newton's iteration for the periodic motion near a run. SI units."""

from dataclasses import dataclass

import numpy as np

from ..specimen.state import Floats
from .followed_run import FollowedRun

TOLERANCE = 1e-10
"""Tolerance of the map: far below the distance at which a motion counts as settled."""
RETURNED = 1e-10
"""A motion is periodic when it returns this close, relative to its size."""
ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """A stable periodic motion."""

    run: FollowedRun
    """Run on this motion."""
    away: Floats
    """Inverse of the identity minus the scaled derivative of the map, shape (6, 6)."""
    distance: float
    """Distance of the given run from this motion, over the size of the motion."""


def stable_motion(near: FollowedRun, period: int) -> FixedPoint | None:
    """Find the stable motion of this many drive periods near a run; None if there is none."""
    try:
        return _fixed_point(near, period)
    except (ValueError, np.linalg.LinAlgError):
        # The iteration came to a state that is not allowed, or a multiplier is one.
        return None


def _fixed_point(near: FollowedRun, period: int) -> FixedPoint | None:
    run, gone = near.apart(TOLERANCE), np.inf
    scales = np.repeat([1.0, 2.0 * np.pi * run.drive.frequency_hz], 3)
    start = run.state / scales
    size = float(np.abs(start).max(initial=1e-300))
    for _ in range(ITERATIONS):
        image, slope = run.image(period)
        off = (image - run.state) / scales
        if not np.all(np.isfinite(slope)) or not np.abs(off).max() < gone:
            return None
        gone = float(np.abs(off).max())
        scaled = slope * scales / scales[:, None]
        away = np.linalg.inv(np.eye(6) - scaled)
        if gone < RETURNED * size:
            distance = float(np.abs(run.state / scales - start).max()) / size
            is_stable = np.abs(np.linalg.eigvals(scaled)).max() < 1.0
            return FixedPoint(run, away, distance) if is_stable else None
        run = run.pushed(away @ off * scales)
    return None
