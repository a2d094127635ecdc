"""The flow over a stretch of a harmonic drive, with its exact derivative by the state. SI units."""

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import DIRECTIONS, NativeRun, RunRecord, most_impacts
from ..model.accuracy import Accuracy
from ..model.arrays import Floats
from ..model.drive import Harmonic
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from .integrate import MAX_IMPACT_RATE_HZ, start_motion


def flow_derivative(
    specimen: Specimen,
    drive: Harmonic,
    state: ArrayLike,
    duration_s: float,
    accuracy: Accuracy = Accuracy.REFERENCE,
) -> tuple[Floats, Floats]:
    """Follow a motion from the drive's time zero and differentiate where it gets to.

    Where a rigid stop is just grazed no derivative exists, and very large numbers are returned.

    Parameters
    ----------
    specimen, drive
        What moves, and what moves it.
    state
        x, y, z, vx, vy, vz at time zero, shape (6,).
    duration_s
        [s].
    accuracy
        Of the motion; its derivative is as exact.

    Returns
    -------
    The state at the end, shape (6,), and its derivative by ``state``, shape (6, 6); NaN when the run was
    lost.

    """
    run = NativeRun(specimen, drive, start_motion(state), accuracy.tolerance)
    run.carry(np.eye(DIRECTIONS))
    outcome = run.advance(duration_s, RunRecord(most_impacts(MAX_IMPACT_RATE_HZ, duration_s)))
    if outcome is not Outcome.REACHED_END:
        return np.full(6, np.nan), np.full((6, 6), np.nan)
    return run.motion, (np.exp(run.growth)[:, None] * run.changes).T
