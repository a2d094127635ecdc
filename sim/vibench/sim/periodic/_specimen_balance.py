"""Harmonic balance of a specimen under a drive, from the start that suits its contact. SI units."""

from dataclasses import replace

import numpy as np

from ..model import Harmonic, Specimen, Y, Z
from ._balance_branch import raised_balance
from ._balance_solver import BalanceOptions, Guess, balance, linear_guess
from ._condensation import structure_of
from ._frequency_time import phasors_of
from ._harmonic_balance import Balance, BalanceEnd
from ._restoring_force import spring_of
from ._shooting import SAMPLES, PeriodicOrbit, ShootingEnd, periodic_orbit

SPECTRUM_SHARE = 8
"""Harmonics kept of an orbit's spectrum: one in eight of those that its samples could show."""

CONTACT_HARMONICS = 255
"""With fewer, a balance of stiff stops may settle on a motion that is none."""


def orbit_guess(orbit: PeriodicOrbit) -> Guess:
    """Start a harmonic balance from an exact orbit of the drive's period."""
    states = orbit.period_map.orbit(orbit.state, orbit.drive, SAMPLES).states[:SAMPLES]
    harmonics = np.arange(SAMPLES // SPECTRUM_SHARE)
    return Guess(harmonics, phasors_of(states[:, Y] - states[:, Z])[harmonics])


def balance_specimen(
    specimen: Specimen,
    drive: Harmonic,
    options: BalanceOptions = BalanceOptions(),  # noqa: B008 - frozen
) -> Balance:
    """Find the periodic motion of a specimen by harmonic balance.

    A motion that meets stops starts from the exact orbit that shooting finds behind a run from rest; a
    smooth spring from its first-order motion, and if that fails from the branch from a weak drive upwards.
    The drive's phase must be zero. Look at ``outcome`` first: in chaos the motion found, if any, is unstable.
    """
    if drive.phase_rad != 0.0:
        msg = f"Drive phase {drive.phase_rad} rad is not allowed: harmonic balance takes phase zero."
        raise ValueError(msg)
    structure, spring = structure_of(specimen), spring_of(specimen)
    where = drive.frequency_hz, drive.amplitude_m
    if spring.kinks and abs(linear_guess(structure, *where).relative[0]) > spring.length:
        orbit = periodic_orbit(specimen, drive)
        if orbit.outcome is ShootingEnd.CONVERGED:
            many = replace(options, fewest=min(options.most, max(options.fewest, CONTACT_HARMONICS)))
            return balance(structure, spring, *where, many, orbit_guess(orbit))
    found = balance(structure, spring, *where, options)
    if found.outcome is BalanceEnd.NO_SOLUTION and not spring.kinks:
        return raised_balance(structure, spring, *where, options)[0]
    return found
