"""The motion once a drive period: the stroboscopic map, and what it tells of a motion's period. SI units."""

import numpy as np
from numpy.typing import ArrayLike

from ..model.accuracy import Accuracy
from ..model.arrays import Floats
from ..model.drive import Harmonic
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from .integrate import integrate


def state_scales(specimen: Specimen, drive: Harmonic) -> Floats:
    """Measure of a state, shape (6,): the gap for displacements, gap times 2 pi f for velocities."""
    speed = 2.0 * np.pi * drive.frequency_hz
    return min(specimen.gaps_m) * np.repeat([1.0, speed], 3)


def stroboscopic_section(
    specimen: Specimen,
    drive: Harmonic,
    periods: int,
    accuracy: Accuracy = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
) -> Floats:
    """Follow a motion from time zero and keep its state after every drive period, shape (periods, 6).

    Raises ValueError when ``periods`` is below 1, or the run did not reach its end.
    """
    if periods < 1:
        msg = f"A section of {periods} periods is not allowed: ask for 1 or more."
        raise ValueError(msg)
    run = integrate(
        specimen,
        drive,
        periods / drive.frequency_hz,
        accuracy,
        initial_state,
        sample_rate_hz=drive.frequency_hz,
    )
    if run.outcome is not Outcome.REACHED_END:
        msg = f"The motion at {drive.frequency_hz} Hz and {drive.amplitude_m} m was lost: {run.outcome.text}."
        raise ValueError(msg)
    return run.states[1 : periods + 1]


def smallest_period(section: Floats, scales: Floats, tolerance: float = 1e-6, most: int = 32) -> int | None:
    """Find the fewest drive periods after which the last points of a section repeat; None if they do not.

    Parameters
    ----------
    section
        Shape (n, 6), settled; at least twice the period long.
    scales
        From `state_scales`.
    tolerance
        Largest change of a state over its scale that counts as the same.
    most
        Longest period tried.

    """
    points = section / scales
    for period in range(1, min(most, len(points) // 2) + 1):
        change = points[-period:] - points[-2 * period : len(points) - period]
        if float(np.abs(change).max()) < tolerance:
            return period
    return None
