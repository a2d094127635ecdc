"""Newton's iteration for the stable periodic motion near a run. SI units."""

from dataclasses import dataclass

import numpy as np

from ..specimen.state import Floats
from .followed_run import FollowedRun

TOLERANCE = 1e-10
"""Integration tolerance of the period map, far below the distance at which a motion counts as settled."""
RETURNED = 1e-10
"""Largest change of state over one period of a periodic motion, relative to the motion's size."""
ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """Stable periodic motion found near a run."""

    run: FollowedRun
    """Run whose current state is on the periodic motion."""
    away: Floats
    """Inverse of (identity - Jacobian of the period map), scaled, shape (6, 6)."""
    distance: float
    """Distance of the given run from the periodic motion, relative to the size of the motion."""


def stable_motion(near: FollowedRun, period: int) -> FixedPoint | None:
    """Return the stable periodic motion of this period (in drive periods) near a run, or None."""
    try:
        return _fixed_point(near, period)
    except (ValueError, np.linalg.LinAlgError):
        # The iteration left the allowed states, or a Floquet multiplier equals 1.
        return None


def _fixed_point(near: FollowedRun, period: int) -> FixedPoint | None:
    run, gone = near.copy(TOLERANCE), np.inf
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
        run = run.with_push(away @ off * scales)
    return None
