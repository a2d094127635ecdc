"""Branches of exact motions and of harmonic-balance solutions, found by a search or at bifurcations."""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.run import parts_within
from ..periodic.balance_branch import (
    BalanceOptions,
    balance,
    balance_branch_within,
    first_order_guesses,
    orbit_guess,
)
from ..periodic.branch import BifurcationKind, Branch, BranchEvent, OrbitShape
from ..periodic.branch_following import DrivePath, parameter_value
from ..periodic.continuation import ArcEnd, ArcSteps
from ..periodic.harmonic_balance import Balance, BalanceEnd, HarmonicSet, structure_of
from ..periodic.newton import NEUTRAL
from ..periodic.orbit_branch import periodic_branch_within
from ..periodic.restoring_force import PowerSpring, spring_of
from ..periodic.shooting import PeriodicOrbit, PeriodMap, ShootingEnd, periodic_orbit
from ..specimen.drive import Harmonic
from ..specimen.specimen import Floats, Specimen, state_scales
from ._motion_search import MotionSearch, orbit_states, periodic_motions, simplest

INTERPOLATED = 0.06
"""Largest distance of a branch from the chord between two neighbouring points, relative to the chord's
length. The value follows from the largest rotation of the tangent in one step."""
SAME_MOTION = 1e-5
"""Additional distance between scaled states that `lies_on` allows for rounding errors."""
LATE, LEAST_LATE_S = 0.25, 0.1
"""Extra time allowed to end a branch after the time limit: fraction of the limit, and lower bound [s]."""
LENGTHS = 10.0
"""Length of the whole parameter range in the scaled units of branch following."""


class BranchOrigin(StrEnum):
    """Way in which the first motion of a branch was found."""

    SEARCH = "a motion found from rest, between the stops or from a random state"
    SYMMETRY_BREAKING = "switched to where a symmetry breaks"
    PERIOD_DOUBLING = "switched to where a period doubles"
    PHASE_RESONANCE = "the phase resonance of the motion without contacts"
    FIRST_ORDER = "a solution of the first-order balance"


@dataclass(frozen=True, eq=False)
class FoundBranch:
    """Branch of periodic motions, with their period and symmetry, and its origin and computing time."""

    branch: Branch
    shape: OrbitShape
    periods: int
    """Period of the branch's motions, in drive periods."""
    origin: BranchOrigin
    has_twin: bool
    """Whether the mirror images of the branch's motions form another branch."""
    elapsed_s: float = 0.0
    """Computing time for finding and following the branch [s]."""

    @property
    def is_isolated(self) -> bool:
        """Whether the branch is a closed curve, which sweeps along other branches cannot reach."""
        return self.branch.begin is self.branch.end is ArcEnd.CLOSED


def lies_on(found: FoundBranch, specimen: Specimen, path: DrivePath, drive: Harmonic, states: Floats) -> bool:
    """Return whether a branch contains any of the given states, shape (n, 6), at the given drive."""
    branch, value = found.branch, parameter_value(path, drive)
    scales = state_scales(specimen, drive)
    along = branch.parameters
    reach = max(float(np.ptp(along)), 1e-9 * value)
    for k in np.flatnonzero((along[:-1] - value) * (along[1:] - value) <= 0.0):
        span = along[k + 1] - along[k]
        part = 0.0 if span == 0.0 else (value - along[k]) / span
        here, there = branch.states[k] / scales, branch.states[k + 1] / scales
        nearest = np.abs(here + part * (there - here) - states / scales).max(axis=1).min()
        length = float(np.linalg.norm(there - here)) + LENGTHS * abs(float(span)) / reach
        if nearest < INTERPOLATED * length + SAME_MOTION:
            return True
    return False


M = TypeVar("M")
"""Type of a motion: `PeriodicOrbit` from shooting, or `Balance` from harmonic balance."""


@dataclass(frozen=True, eq=False)
class BranchStart(Generic[M]):
    """Periodic motion from which a new branch is followed, unless a known branch contains it."""

    motion: M
    origin: BranchOrigin
    drive: Harmonic
    states: Floats
    """States of the motion and (if known) of its mirror image, once per drive period, shape (n, 6)."""


def branches_from(
    specimen: Specimen,
    path: DrivePath,
    bounds: tuple[float, float],
    search: MotionSearch,
    starts: Callable[[Harmonic], Iterator[BranchStart[M]]],
    follow: Callable[[BranchStart[M]], FoundBranch],
    leaving: Callable[[FoundBranch], Iterable[BranchStart[M]]],
    until_s: float,
) -> Iterator[FoundBranch]:
    """Yield branches through new motions, and branches that fork off these branches, until a time limit."""
    known: list[FoundBranch] = []
    last_s = until_s + max(LEAST_LATE_S, LATE * (until_s - time.monotonic()))
    for value in np.linspace(*bounds, search.places):
        began = time.perf_counter()
        for start in parts_within(until_s, starts(Harmonic(*path.drive(float(value))))):
            fresh = [start]
            while fresh and len(known) < search.most_branches and time.monotonic() < until_s:
                one = fresh.pop()
                if any(lies_on(each, specimen, path, one.drive, one.states) for each in known):
                    continue
                # After ``until_s``, end the branch at its next point, or earlier if this takes too long.
                for found in parts_within(last_s, map(follow, [one])):
                    known.append(replace(found, elapsed_s=time.perf_counter() - began))
                    yield known[-1]
                    fresh += parts_within(until_s, leaving(known[-1]))
                began = time.perf_counter()


SHOT_STEPS = ArcSteps(first=0.01, longest=0.1, shortest=1e-7, tolerance=1e-9, most_points=3000)
PUSHES = (0.01, 0.03, 0.1, 0.3)
"""Distances [gaps] from the state at a bifurcation to the first guesses for branch switching."""
OFFSETS = (-3e-4, 3e-4, -3e-3, 3e-3)
"""Distances from a bifurcation, relative to the parameter's range, that are tried for branch switching."""
LEFT = 1e-4
"""Distance [gaps] from the old branch above which a motion counts as being on the new branch."""
SWITCHED = {
    BifurcationKind.SYMMETRY_BREAKING: BranchOrigin.SYMMETRY_BREAKING,
    BifurcationKind.PERIOD_DOUBLING: BranchOrigin.PERIOD_DOUBLING,
}


def shoot_branches(
    specimen: Specimen,
    path: DrivePath,
    low: float,
    high: float,
    search: MotionSearch = MotionSearch(),  # noqa: B008 - frozen
    steps: ArcSteps = SHOT_STEPS,
) -> Iterator[FoundBranch]:
    """Yield the branches of periodic motions found in a range, one by one.

    Parameters
    ----------
    specimen
        Specimen with any contact law. With rigid stops a branch ends at grazing, where no derivative exists.
    path
        `FrequencyPath` or `AmplitudePath`.
    low, high
        Range of the parameter, ascending [Hz, or m].
    search
        Settings of the search, which may miss branches; more starts find more branches.
    steps
        Step lengths and tolerances. In scaled units the range has length 10, and the gap has length 1.

    Yields
    ------
    Branches with stability, events and error of each point. Chaotic and quasi-periodic motions are not
    included.
    """
    steps = replace(steps, until_s=time.monotonic() + search.time_s)

    def starts(drive: Harmonic) -> Iterator[BranchStart[PeriodicOrbit]]:
        for orbit in periodic_motions(specimen, drive, search, steps.until_s):
            yield _start(orbit, BranchOrigin.SEARCH)

    def leaving(found: FoundBranch) -> Iterator[BranchStart[PeriodicOrbit]]:
        return _branch_switches(found, specimen, path, (low, high), search)

    def follow(start: BranchStart[PeriodicOrbit]) -> FoundBranch:
        branch = periodic_branch_within(start.motion, path, low, high, steps)
        shape, periods = start.motion.period_map.shape, start.motion.period_map.periods
        lower, upper = specimen.gaps_m
        has_twin = lower == upper and shape is OrbitShape.REPEATED and periods % 2 == 1
        return FoundBranch(branch, shape, periods, start.origin, has_twin)

    return branches_from(specimen, path, (low, high), search, starts, follow, leaving, steps.until_s)


def _start(orbit: PeriodicOrbit, origin: BranchOrigin) -> BranchStart[PeriodicOrbit]:
    return BranchStart(orbit, origin, orbit.drive, orbit_states(orbit))


def _branch_switches(
    found: FoundBranch,
    specimen: Specimen,
    path: DrivePath,
    bounds: tuple[float, float],
    search: MotionSearch,
) -> Iterator[BranchStart[PeriodicOrbit]]:
    """Yield one motion on each branch that forks off a given branch at a bifurcation."""
    mapping = PeriodMap(specimen, found.shape, found.periods)
    for event in found.branch.events:
        factor = 2 if event.kind is BifurcationKind.PERIOD_DOUBLING else 1
        leaves = event.kind in SWITCHED and mapping.periods * factor <= search.most_periods
        # Two branches meet at a bifurcation: switch branches only from the branch with the simpler motion.
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


def _has_left(orbit: PeriodicOrbit) -> bool:
    return simplest(orbit) is orbit and float(np.abs(orbit.signs.apart).max(initial=1.0)) > LEFT


def _direction(mapping: PeriodMap, state: Floats, drive: Harmonic) -> Floats:
    """Return the scaled eigenvector of the Floquet multiplier nearest to -1, shape (6,); largest entry 1."""
    _, _, derivative = next(mapping.iterates(state, drive))
    values, vectors = np.linalg.eig(derivative)
    direction = vectors[:, int(np.argmin(np.abs(values + 1.0)))].real
    return np.asarray(direction / np.abs(direction).max())


UPDATES_TO_HOLD = 10.0
"""Number of updates that a stabilising control loop needs while a perturbation grows by a factor e."""


def growth_time_s(frequency_hz: ArrayLike, multiplier: ArrayLike, periods: int = 1) -> NDArray[np.float64]:
    """Return the time in which a small perturbation grows by a factor e [s]; infinite without growth.

    It is T / ln|mu|, with the motion's period T and largest multiplier mu, for a prescribed base motion.

    Parameters
    ----------
    frequency_hz
        Drive frequencies [Hz], an array of any shape.
    multiplier
        Magnitude of the largest Floquet multiplier over one period of the motion; same shape as frequency_hz.
    periods
        Period of the motion in drive periods.
    """
    size = np.asarray(multiplier, dtype=np.float64)
    rate = np.where(size > 1.0 + NEUTRAL, np.log(np.maximum(size, 1.0)), 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(periods / (np.asarray(frequency_hz, dtype=np.float64) * rate))


def least_growth_time_s(loop_time_s: float) -> float:
    """Return the shortest growth time of an unstable motion that a control loop can stabilise [s].

    Raises ValueError when ``loop_time_s`` is not positive and finite.

    Parameters
    ----------
    loop_time_s
        Delay of the loop, from the motion to the corrected drive [s].
    """
    if not 0.0 < loop_time_s < math.inf:
        raise ValueError(f"A loop time of {loop_time_s} s is not allowed: give a positive, finite time.")
    return UPDATES_TO_HOLD * loop_time_s


BALANCE_STEPS = ArcSteps(first=0.01, longest=0.03, shortest=1e-7, tolerance=1e-10, most_points=3000)


def balance_branches(
    specimen: Specimen,
    path: DrivePath,
    low: float,
    high: float,
    options: BalanceOptions,
    search: MotionSearch = MotionSearch(),  # noqa: B008 - frozen
    steps: ArcSteps = BALANCE_STEPS,
) -> Iterator[FoundBranch]:
    """Yield the branches of harmonic balances found in a range, one by one.

    Parameters
    ----------
    specimen
        Specimen with any law except rigid stops. Starts are sought at ``search.places`` values of the
        parameter: for power laws, every first-order solution (Gong et al. 2025, eq. 5); for other laws, every
        motion from `periodic_motions` with the drive's period.
    path, low, high, steps
        As for `shoot_branches`.
    options
        Number of harmonics, from ``fewest`` to ``most``; 1 for both gives the paper's first-order balance.
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
