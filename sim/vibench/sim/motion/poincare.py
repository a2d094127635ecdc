"""Period of a motion from its states once per drive period, and derivative of its final state. SI units."""

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import DIRECTIONS, MAX_IMPACT_RATE_HZ, NativeRun, RunRecord, most_impacts, start_motion
from ..specimen.accuracy import Accuracy
from ..specimen.drive import Harmonic
from ..specimen.outcome import Outcome
from ..specimen.specimen import Specimen
from ..specimen.state import Floats


def smallest_period(section: Floats, scales: Floats, tolerance: float = 1e-6, most: int = 32) -> int | None:
    """Return the smallest number of drive periods after which a motion repeats; None if it does not.

    Parameters
    ----------
    section
        States of the settled motion once per drive period, at least two periods long, shape (n, 6).
    scales
        Scales of a state from `state_scales`, shape (6,).
    tolerance
        Largest change of a state, relative to its scale, at which a motion counts as repeating.
    most
        Longest period to try.
    """
    points = section / scales
    for period in range(1, min(most, len(points) // 2) + 1):
        change = points[-period:] - points[-2 * period : len(points) - period]
        if float(np.abs(change).max()) < tolerance:
            return period
    return None


def flow_derivative(
    specimen: Specimen,
    drive: Harmonic,
    state: ArrayLike,
    duration_s: float,
    accuracy: Accuracy = Accuracy.REFERENCE,
) -> tuple[Floats, Floats]:
    """Return the final state of a run from time zero of the drive, and d(final state) / d(initial state).

    The shapes are (6,) and (6, 6); NaN if the run did not finish. At a grazing impact on a rigid stop, where
    no derivative exists, very large numbers are returned.

    Parameters
    ----------
    specimen, drive
        Specimen, and motion of its base.
    state
        x, y, z, vx, vy, vz at time zero, shape (6,).
    duration_s
        Length of the run [s].
    accuracy
        Accuracy of the motion and of its derivative.
    """
    run = NativeRun(specimen, drive, start_motion(state), accuracy.tolerance)
    run.carry(np.eye(DIRECTIONS))
    outcome = run.advance(duration_s, RunRecord(most_impacts(MAX_IMPACT_RATE_HZ, duration_s)))
    if outcome is not Outcome.REACHED_END:
        return np.full(6, np.nan), np.full((6, 6), np.nan)
    return run.motion, (np.exp(run.growth)[:, None] * run.changes).T
