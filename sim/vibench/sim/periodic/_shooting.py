"""Periodic motions with impacts by shooting: a state that the exact flow brings back to itself. SI units.

Newton's iteration on the period map finds stable and unstable motions alike, of any number of drive
periods (Nayfeh and Balachandran, Applied Nonlinear Dynamics, Wiley 1995, section 6.4).
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Complex, Vector
from ..model import Harmonic, Specimen, X, Y, Z, chosen
from ..motion import integrate, start_motion, state_scales
from ._floquet import multipliers
from ._frequency_time import phasors_of
from ._orbit_events import OrbitSigns, Symmetry
from ._period_map import OrbitShape, OrbitShapeWord, PeriodMap

NEWTON_ITERATIONS = 30
MOST_HALVINGS = 8
RETURNED = 1e-9
"""A motion is periodic when it comes back this close, over the state's scale."""
SAMPLES = 4096
"""Samples of a drive period from which responses are taken."""
SETTLING_PERIODS = 400
"""Drive periods followed before shooting begins, where no state is given."""


class ShootingEnd(StrEnum):
    """Whether a periodic motion was found, and what to change."""

    CONVERGED = "converged"
    NO_ORBIT = "no periodic motion near the start: start elsewhere, or ask for another shape or period"


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A periodic motion, its stability and its responses."""

    drive: Harmonic
    period_map: PeriodMap
    state: Vector
    """x, y, z, vx, vy, vz at the drive's time zero, shape (6,)."""
    signs: OrbitSigns
    defect: float
    """How far from itself the motion comes back, over the state's scale."""
    response_i: Vector
    """Largest magnitude of x, y, z and p over the drive amplitude, shape (4,)."""
    response_ii: Vector
    """Amplitude at the drive frequency, likewise."""
    outcome: ShootingEnd

    @property
    def floquet_multipliers(self) -> Complex:
        """Over the whole period of the motion, largest first, shape (6,)."""
        return self.signs.over_period

    @property
    def is_stable(self) -> bool:
        """All multipliers inside the unit circle."""
        return bool(abs(self.floquet_multipliers[0]) < 1.0)

    @property
    def impacts(self) -> int:
        """Contacts that begin in a period of the motion."""
        return self.signs.contacts


def periodic_orbit(
    specimen: Specimen,
    drive: Harmonic,
    shape: OrbitShape | OrbitShapeWord = OrbitShape.REPEATED,
    periods: int = 1,
    start: ArrayLike | None = None,
) -> PeriodicOrbit:
    """Find a periodic motion near a state.

    Parameters
    ----------
    specimen, drive
        The drive's amplitude must be positive, its phase zero.
    shape, periods
        How it repeats: see `OrbitShape`; ``periods`` is for a repeated one.
    start
        x, y, z, vx, vy, vz at time zero, shape (6,); None takes where a run from rest is after 400 periods.

    Returns
    -------
    The motion; look at ``outcome`` first.

    """
    if drive.amplitude_m == 0.0 or drive.phase_rad != 0.0:
        msg = f"Drive {drive} is not allowed for shooting: give a positive amplitude and phase zero."
        raise ValueError(msg)
    mapping = PeriodMap(specimen, chosen(OrbitShape, shape), periods)
    settling = SETTLING_PERIODS / drive.frequency_hz
    first = integrate(specimen, drive, settling).final_state if start is None else start_motion(start)
    scales = state_scales(specimen, drive)
    state = first.copy()
    gone = (mapping.image(state, drive) - state) / scales
    for _ in range(NEWTON_ITERATIONS):
        if not _size(gone) > RETURNED:
            break
        slope = mapping.derivative(state, drive) - np.eye(6)
        if not bool(np.all(np.isfinite(slope))):
            break
        step = np.linalg.lstsq(slope, gone)[0] * scales
        state, gone, is_better = _damped(mapping, drive, state, step, gone)
        if not is_better:
            break
    return described_orbit(mapping, drive, state, _size(gone))


def _damped(
    mapping: PeriodMap, drive: Harmonic, state: Vector, step: Vector, gone: Vector
) -> tuple[Vector, Vector, bool]:
    """Halve the step until the motion comes back closer; gives the state, how far it goes, and success."""
    scales = state_scales(mapping.specimen, drive)
    for halving in range(MOST_HALVINGS):
        trial = state - 0.5**halving * step
        trial_gone = (mapping.image(trial, drive) - trial) / scales
        if _size(trial_gone) < _size(gone):
            return trial, trial_gone, True
    return state, gone, False


def _size(values: Vector) -> float:
    size = float(np.max(np.abs(values)))
    return size if math.isfinite(size) else math.inf


def described_orbit(mapping: PeriodMap, drive: Harmonic, state: Vector, defect: float) -> PeriodicOrbit:
    """Stability and responses of a motion that starts at ``state``."""
    run = mapping.orbit(state, drive, SAMPLES)
    turns = math.ceil(mapping.turns)
    moved = run.states[: turns * SAMPLES]
    waves = np.column_stack([moved[:, X], moved[:, Y], moved[:, Z], moved[:, Y] - moved[:, Z]])
    derivative = mapping.derivative(state, drive)
    is_mirrored = mapping.shape is OrbitShape.MIRRORED
    symmetry = Symmetry.MIRRORED if is_mirrored else Symmetry.NONE
    lines = np.array([abs(phasors_of(wave)[turns]) for wave in waves.T])
    found = bool(defect <= RETURNED and np.all(np.isfinite(derivative)))
    return PeriodicOrbit(
        drive=drive,
        period_map=mapping,
        state=state,
        signs=OrbitSigns(multipliers(np.nan_to_num(derivative)), run.impacts.count, symmetry),
        defect=defect,
        response_i=np.abs(waves).max(axis=0) / drive.amplitude_m,
        response_ii=lines / drive.amplitude_m,
        outcome=ShootingEnd.CONVERGED if found else ShootingEnd.NO_ORBIT,
    )
