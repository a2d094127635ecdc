"""Branches of harmonic balances: from every first-order solution of a power law, or from exact motions."""

import time
from collections.abc import Iterator

import numpy as np

from ..model import Harmonic, Specimen
from ..periodic import (
    ArcSteps,
    Balance,
    BalanceEnd,
    BalanceOptions,
    DrivePath,
    HarmonicSet,
    OrbitShape,
    PowerSpring,
    balance,
    balance_branch_within,
    first_order_guesses,
    orbit_guess,
    spring_of,
    structure_of,
)
from ._found_branch import BranchOrigin, FoundBranch, known_among
from ._motion_search import MotionSearch, periodic_motions

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
    """Give every branch of harmonic balances that is found in a range, one by one.

    Parameters
    ----------
    specimen
        Not rigid stops: they push with no finite force. Of power laws every first-order solution at
        ``search.places`` values begins a branch (Gong et al. 2025, eq. 5); of other laws every motion of the
        drive's period that `periodic_motions` finds there.
    path, low, high, steps
        As for `shot_branches`.
    options
        Harmonics from ``fewest`` to ``most``; 1 and 1 is the paper's first-order balance.
    search
        Where branches begin.

    Yields
    ------
    Branches of the drive's own period: subharmonic motions have no such balance.

    """
    structure, spring = structure_of(specimen), spring_of(specimen)
    known: list[FoundBranch] = []
    for value in np.linspace(low, high, search.places):
        drive = Harmonic(*path.drive(float(value)))
        began = time.perf_counter()
        for start, origin in _starts(specimen, drive, options, search):
            is_known = known_among(known, specimen, path, drive, start.state[None, :])
            if is_known or len(known) >= search.most_branches:
                continue
            branch = balance_branch_within(structure, spring, start, path, low, high, options, steps)
            is_mirrored = options.kept is HarmonicSet.ODD
            found = FoundBranch(
                branch=branch,
                shape=OrbitShape.MIRRORED if is_mirrored else OrbitShape.REPEATED,
                periods=1,
                origin=origin,
                has_twin=False,
                elapsed_s=time.perf_counter() - began,
            )
            known.append(found)
            yield found
            began = time.perf_counter()


def _starts(
    specimen: Specimen, drive: Harmonic, options: BalanceOptions, search: MotionSearch
) -> Iterator[tuple[Balance, BranchOrigin]]:
    structure, spring = structure_of(specimen), spring_of(specimen)
    where = drive.frequency_hz, drive.amplitude_m
    match spring:
        case PowerSpring():
            for guess in first_order_guesses(structure, spring, *where):
                found = balance(structure, spring, *where, options, guess)
                if found.outcome is not BalanceEnd.NO_SOLUTION:
                    yield found, BranchOrigin.FIRST_ORDER
        case _:
            for orbit in periodic_motions(specimen, drive, search):
                if orbit.period_map.periods > 1:
                    continue
                found = balance(structure, spring, *where, options, orbit_guess(orbit))
                if found.outcome is not BalanceEnd.NO_SOLUTION:
                    yield found, BranchOrigin.SEARCH
