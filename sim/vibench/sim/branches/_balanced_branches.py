"""Branches of harmonic balances, from first-order solutions of a power law or from exact motions."""

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from ..periodic.balance_branch import (
    BalanceOptions,
    balance,
    balance_branch_within,
    first_order_guesses,
    orbit_guess,
)
from ..periodic.branch import OrbitShape
from ..periodic.branch_following import DrivePath
from ..periodic.continuation import ArcSteps
from ..periodic.harmonic_balance import Balance, BalanceEnd, HarmonicSet, structure_of
from ..periodic.restoring_force import PowerSpring, spring_of
from ..specimen.drive import Harmonic
from ..specimen.specimen import Specimen
from ._motion_search import MotionSearch, periodic_motions
from ._shot_branches import BranchOrigin, BranchStart, FoundBranch, branches_from

STEPS = ArcSteps(first=0.01, longest=0.03, shortest=1e-7, tolerance=1e-10, most_points=3000)


def balanced_branches(
    specimen: Specimen,
    path: DrivePath,
    low: float,
    high: float,
    options: BalanceOptions,
    search: MotionSearch = MotionSearch(),  # noqa: B008 - frozen
    steps: ArcSteps = STEPS,
) -> Iterator[FoundBranch]:
    """Yield the branches of harmonic balances found in a range, one by one.

    Parameters
    ----------
    specimen
        Any law except rigid stops. For power laws, every first-order solution at ``search.places`` values
        starts a branch (Gong et al. 2025, eq. 5); for other laws, every motion of the
        drive's period that `periodic_motions` finds there.
    path, low, high, steps
        As for `shot_branches`.
    options
        Harmonics from ``fewest`` to ``most``; 1 and 1 is the paper's first-order balance.
    search
        Settings of the search for starts.

    Yields
    ------
    Branches of motions with the drive's period; subharmonic motions are not included.
    """
    steps = replace(steps, until_s=time.monotonic() + search.time_s)
    structure, spring = structure_of(specimen), spring_of(specimen)
    shape = OrbitShape.MIRRORED if options.kept is HarmonicSet.ODD else OrbitShape.REPEATED

    def follow(start: BranchStart[Balance]) -> FoundBranch:
        branch = balance_branch_within(structure, spring, start.motion, path, low, high, options, steps)
        return FoundBranch(branch, shape, periods=1, origin=start.origin, has_twin=False)

    starts = partial(_starts, specimen, options, search, steps.until_s)
    return branches_from(specimen, path, (low, high), search, starts, follow, lambda _: (), steps.until_s)


def _starts(
    specimen: Specimen, options: BalanceOptions, search: MotionSearch, until_s: float, drive: Harmonic
) -> Iterator[BranchStart[Balance]]:
    structure, spring = structure_of(specimen), spring_of(specimen)
    where = drive.frequency_hz, drive.amplitude_m
    if isinstance(spring, PowerSpring):
        guesses, origin = iter(first_order_guesses(structure, spring, *where)), BranchOrigin.FIRST_ORDER
    else:
        orbits = periodic_motions(specimen, drive, search, until_s)
        guesses = (orbit_guess(orbit) for orbit in orbits if orbit.period_map.periods == 1)
        origin = BranchOrigin.SEARCH
    for guess in guesses:
        found = balance(structure, spring, *where, options, guess)
        if found.outcome is not BalanceEnd.NO_SOLUTION:
            yield BranchStart(found, origin, drive, found.state[None, :])
