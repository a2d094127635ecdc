"""The flow over a stretch of a harmonic drive, with its exact derivative by the state. SI units."""

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Floats, clock_at
from ..model import Accuracy, Harmonic, Outcome, Specimen
from ..slots import derivative_of, unit_tangent
from ..stepping import advance_harmonic, harmonic_tables, new_state
from ._integrate import MAX_IMPACT_RATE_HZ, new_record, start_motion


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
    moving = new_state(specimen, start_motion(state), accuracy)
    changes = unit_tangent()
    record = new_record(0.0, duration_s, None, MAX_IMPACT_RATE_HZ)._replace(tangent=changes)
    tables = harmonic_tables(specimen, drive)
    code = advance_harmonic(moving, clock_at(0.0), duration_s, tables, accuracy.tolerance, record)
    if code != Outcome.REACHED_END:
        return np.full(6, np.nan), np.full((6, 6), np.nan)
    return moving[:6].copy(), derivative_of(changes)
