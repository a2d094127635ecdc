"""Branches of exact motions: from every motion that a search finds, and from every bifurcation on them."""

from collections.abc import Iterator

import numpy as np

from ..model.arrays import Vector
from ..model.drive import Harmonic
from ..model.specimen import Specimen
from ..motion.poincare import state_scales
from ..periodic.branch import BifurcationKind, BranchEvent
from ..periodic.branch_following import DrivePath
from ..periodic.continuation import ArcSteps
from ..periodic.orbit_branch import periodic_branch_within
from ..periodic.period_map import OrbitShape, PeriodMap
from ..periodic.shooting import PeriodicOrbit, ShootingEnd, periodic_orbit
from ._branch_search import BranchStart, branches_from
from ._found_branch import BranchOrigin, FoundBranch
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

    def starts(drive: Harmonic) -> Iterator[BranchStart[PeriodicOrbit]]:
        for orbit in periodic_motions(specimen, drive, search):
            yield _start(orbit, BranchOrigin.SEARCH)

    def leaving(found: FoundBranch) -> Iterator[BranchStart[PeriodicOrbit]]:
        return _switched(found, specimen, path, (low, high), search)

    def follow(start: BranchStart[PeriodicOrbit]) -> FoundBranch:
        branch = periodic_branch_within(start.motion, path, low, high, steps)
        shape, periods = start.motion.period_map.shape, start.motion.period_map.periods
        lower, upper = specimen.gaps_m
        has_twin = lower == upper and shape is OrbitShape.REPEATED and periods % 2 == 1
        return FoundBranch(branch, shape, periods, start.origin, has_twin)

    return branches_from(specimen, path, (low, high), search, starts, follow, leaving)


def _start(orbit: PeriodicOrbit, origin: BranchOrigin) -> BranchStart[PeriodicOrbit]:
    return BranchStart(orbit, origin, orbit.drive, orbit_states(orbit))


def _switched(
    found: FoundBranch,
    specimen: Specimen,
    path: DrivePath,
    bounds: tuple[float, float],
    search: MotionSearch,
) -> Iterator[BranchStart[PeriodicOrbit]]:
    """Find a motion on each branch that leaves this one."""
    mapping = PeriodMap(specimen, found.shape, found.periods)
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
            yield _start(orbit, SWITCHED[event.kind])


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
