"""Branches of exact motions: from every motion that a search finds, and from every bifurcation on them."""

import time
from collections.abc import Iterator

import numpy as np

from ..kernels import Vector
from ..model import Harmonic, Specimen
from ..motion import state_scales
from ..periodic import (
    ArcSteps,
    BifurcationKind,
    BranchEvent,
    DrivePath,
    OrbitShape,
    PeriodicOrbit,
    PeriodMap,
    ShootingEnd,
    periodic_branch_within,
    periodic_orbit,
)
from ._found_branch import BranchOrigin, FoundBranch, known_among
from ._motion_search import MotionSearch, orbit_states, periodic_motions, simplest

STEPS = ArcSteps(first=0.01, longest=0.1, shortest=1e-7, tolerance=1e-9, most_points=3000)
PUSHES = (0.01, 0.03, 0.1, 0.3)
"""How far from a bifurcation along the direction that leaves it a new branch is looked for, over the gap."""
OFFSETS = (-3e-4, 3e-4, -3e-3, 3e-3)
"""And how far beside it, as part of the range."""
LEFT = 1e-4
"""A motion this far from the simpler one, over the gap, has left it."""
SWITCHED = {
    BifurcationKind.SYMMETRY_BREAKING: BranchOrigin.SYMMETRY_BREAKING,
    BifurcationKind.PERIOD_DOUBLING: BranchOrigin.PERIOD_DOUBLING,
}


def shot_branches(
    specimen: Specimen,
    path: DrivePath,
    low: float,
    high: float,
    search: MotionSearch = MotionSearch(),  # noqa: B008 - frozen
    steps: ArcSteps = STEPS,
) -> Iterator[FoundBranch]:
    """Give every branch of periodic motions that is found in a range, one by one.

    Parameters
    ----------
    specimen
        Any contact law. On rigid stops a branch ends where a contact grazes: no derivative goes on there.
    path
        `FrequencyPath` or `AmplitudePath`.
    low, high
        Range of the parameter, ascending [Hz, or m].
    search
        Where motions are looked for. A branch that the search misses is missing here: more starts find more.
    steps
        Along the branches; the range is ten units long, a displacement of the gap one.

    Yields
    ------
    Branches with the stability, the events and the error of each point; chaos and quasi-periodic motions
    are none.

    """
    known: list[FoundBranch] = []
    for value in np.linspace(low, high, search.places):
        drive = Harmonic(*path.drive(float(value)))
        began = time.perf_counter()
        for orbit in periodic_motions(specimen, drive, search):
            fresh = [(orbit, BranchOrigin.SEARCH)]
            while fresh and len(known) < search.most_branches:
                motion, origin = fresh.pop()
                if known_among(known, specimen, path, motion.drive, orbit_states(motion)):
                    continue
                found = _followed(motion, path, (low, high), steps, origin, began)
                known.append(found)
                yield found
                fresh += _switched(found, specimen, path, (low, high), search)
                began = time.perf_counter()


def _followed(
    orbit: PeriodicOrbit,
    path: DrivePath,
    bounds: tuple[float, float],
    steps: ArcSteps,
    origin: BranchOrigin,
    began: float,
) -> FoundBranch:
    mapping = orbit.period_map
    branch = periodic_branch_within(orbit, path, *bounds, steps)
    lower, upper = mapping.specimen.gaps_m
    return FoundBranch(
        branch=branch,
        shape=mapping.shape,
        periods=mapping.periods,
        origin=origin,
        has_twin=lower == upper and mapping.shape is OrbitShape.REPEATED and mapping.periods % 2 == 1,
        elapsed_s=time.perf_counter() - began,
    )


def _switched(
    found: FoundBranch,
    specimen: Specimen,
    path: DrivePath,
    bounds: tuple[float, float],
    search: MotionSearch,
) -> list[tuple[PeriodicOrbit, BranchOrigin]]:
    """Find a motion on each branch that leaves this one."""
    mapping = PeriodMap(specimen, found.shape, found.periods)
    left = []
    for event in found.branch.events:
        factor = 2 if event.kind is BifurcationKind.PERIOD_DOUBLING else 1
        leaves = event.kind in SWITCHED and mapping.periods * factor <= search.most_periods
        # A branch that joins a simpler one tells of an event of that one, not of its own.
        is_own = (event.kind is BifurcationKind.SYMMETRY_BREAKING) == (found.shape is OrbitShape.MIRRORED)
        if not leaves or not is_own:
            continue
        target = PeriodMap(specimen, OrbitShape.REPEATED, mapping.periods * factor)
        orbit = _leaving(event, mapping, target, path, bounds)
        if orbit is not None:
            left.append((orbit, SWITCHED[event.kind]))
    return left


def _leaving(
    event: BranchEvent, mapping: PeriodMap, target: PeriodMap, path: DrivePath, bounds: tuple[float, float]
) -> PeriodicOrbit | None:
    here = Harmonic(event.frequency_hz, event.amplitude_m)
    direction = _direction(mapping, event.state, here)
    scales = state_scales(mapping.specimen, here)
    value = event.parameter(path.parameter)
    for offset in OFFSETS:
        beside = value + offset * (bounds[1] - bounds[0])
        if not bounds[0] <= beside <= bounds[1]:
            continue
        drive = Harmonic(*path.drive(beside))
        for push in PUSHES:
            start = event.state + push * direction * scales
            orbit = periodic_orbit(mapping.specimen, drive, target.shape, target.periods, start)
            if orbit.outcome is ShootingEnd.CONVERGED and _has_left(orbit):
                return orbit
    return None


def _direction(mapping: PeriodMap, state: Vector, drive: Harmonic) -> Vector:
    """Direction, over the scales, of the multiplier nearest to -1; its largest part is 1."""
    values, vectors = np.linalg.eig(mapping.derivative(state, drive))
    direction = vectors[:, int(np.argmin(np.abs(values + 1.0)))].real
    return np.asarray(direction / np.abs(direction).max())


def _has_left(orbit: PeriodicOrbit) -> bool:
    return simplest(orbit) is orbit and float(np.abs(orbit.signs.apart).max(initial=1.0)) > LEFT
