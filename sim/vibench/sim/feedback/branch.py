"""How a law holds a whole branch, by the model: before anything moves."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import ceil
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..model.arrays import Floats
from ..model.drive import Harmonic
from ..model.specimen import Specimen
from ..model.state import VY, VZ, Y, Z
from ..periodic.balance_branch import balance_branch_within
from ..periodic.balance_solver import balance
from ..periodic.branch import BifurcationKind, Branch
from ..periodic.branch_following import FrequencyPath
from ..periodic.condensation import structure_of
from ..periodic.continuation import ArcEnd
from ..periodic.harmonic_balance import BalanceEnd
from ..periodic.orbit_branch import periodic_branch_within
from ..periodic.period_map import PeriodMap
from ..periodic.restoring_force import RestoringForce, spring_of
from ..periodic.shooting import ShootingEnd, periodic_orbit
from .law import LinearLaw
from .loop import loop_multiplier
from .plant import SampledPlant

Points = NDArray[np.int64]
_POINTS = 25
"""Motions of a branch that are looked at, stable ones too: a late law may lose what needs none."""
_PERIODS, _WHOLE = range(1, 41), 2e-5
"""Of a motion that are gone through: as few as take a whole number of samples within this part of it."""
_WAVE, _WAVE_OF_STOPS = 512, 8192
"""Samples of a period by which the slope of the spring is known along it."""
_PART_S = 1e-6
"""Part of a sample for which the slope of stops is taken: a contact lasts a hundred of them."""
_FROM_ABOVE = (3.0, 2.5, 2.0, 1.7, 1.4, 1.2, 1.0)
"""Levels, over the one that is asked for, along which motions among stops are led down to it."""


@dataclass(frozen=True)
class BranchHold:
    """What a law makes of the motions of a branch, from its start on."""

    multiplier: float
    """The largest over a period with the law acting."""
    at_hz: float
    """Where that is [Hz]."""
    held_hz: float | None
    """Up to where every motion is held; None where not even the first is [Hz]."""
    folds: int
    """That lie before."""
    end: ArcEnd | None
    """Why the model left the branch."""


class MotionSlopes(NamedTuple):
    """Slopes of the spring's force along a motion, as `loop_multiplier` takes them."""

    stiffness: Floats
    damping: Floats
    periods: int
    parts: int


class Begin(StrEnum):
    """From which side the level is met where a branch begins."""

    REST = "rest"
    ABOVE = "above"
    """From three times the level, which is where motions with impacts are found."""


def branch_hold(
    plant: SampledPlant,
    law: LinearLaw,
    level_m: float,
    start_hz: float,
    range_hz: tuple[float, float],
    begin: Begin = Begin.REST,
    way: Literal["up", "down"] = "up",
    allowed: float = 1.0,
) -> BranchHold | None:
    """Follow the model's branch under one level of the base, and see how a law holds it.

    Parameters
    ----------
    plant, law
        As the host knows them; of a specimen without rigid stops.
    level_m
        Amplitude of the base's displacement [m].
    start_hz, range_hz
        Where the branch begins, and where it is left [Hz].
    begin
        From which side the level is met there; where there are no stops, from rest.
    way
        Which way the branch is begun.
    allowed
        Multiplier up to which a motion counts as held.

    Returns
    -------
    None where the model has no motion to begin with.

    """
    spring = spring_of(plant.specimen)
    if spring.kinks:
        branch = impact_branch(plant.specimen, level_m, start_hz, range_hz, begin)
    else:
        branch = _smooth_branch(plant.specimen, spring, level_m, start_hz, range_hz)
    if branch is None:
        return None
    start = int(np.argmin(np.abs(branch.frequencies_hz - start_hz)))
    ahead = np.arange(start, len(branch.frequencies_hz)) if way == "up" else np.arange(start, -1, -1)
    points = ahead[np.unique(np.linspace(0, ahead.size - 1, _POINTS).astype(int))]
    held = branch_multipliers(plant, law, branch, points)
    worst = int(np.argmax(held))
    last = _last_held(plant, law, branch, points, held, allowed)
    low, high = sorted((start, start if last is None else last))
    return BranchHold(
        multiplier=float(held[worst]),
        at_hz=float(branch.frequencies_hz[points[worst]]),
        held_hz=None if last is None else float(branch.frequencies_hz[last]),
        folds=sum(each.kind is BifurcationKind.FOLD and low <= each.index < high for each in branch.events),
        end=branch.end if way == "up" else branch.begin,
    )


def _smooth_branch(
    specimen: Specimen,
    smooth: RestoringForce,
    level_m: float,
    start_hz: float,
    range_hz: tuple[float, float],
) -> Branch | None:
    structure = structure_of(specimen)
    start = balance(structure, smooth, start_hz, level_m)
    if start.outcome is BalanceEnd.NO_SOLUTION:
        return None
    return balance_branch_within(structure, smooth, start, FrequencyPath((level_m,)), *range_hz)


def impact_branch(
    specimen: Specimen, level_m: float, start_hz: float, range_hz: tuple[float, float], begin: Begin
) -> Branch | None:
    """Follow the branch that a loop would begin among stops; None where no motion repeats at its start."""
    state = None
    for factor in (1.0,) if begin is Begin.REST else _FROM_ABOVE:
        orbit = periodic_orbit(specimen, Harmonic(start_hz, factor * level_m), start=state)
        if orbit.outcome is not ShootingEnd.CONVERGED:
            return None
        state = orbit.state
    return periodic_branch_within(orbit, FrequencyPath((level_m,)), *range_hz)


def _last_held(
    plant: SampledPlant, law: LinearLaw, branch: Branch, points: Points, held: Floats, allowed: float
) -> int | None:
    """Give the last motion of a branch up to which a law holds every one; None where it loses the first."""
    first = int(np.argmax(held > allowed))
    if held[first] <= allowed:
        return int(points[-1])
    if first == 0:
        return None
    last, lost = int(points[first - 1]), int(points[first])
    while abs(lost - last) > 1:
        middle = (last + lost) // 2
        if branch_multipliers(plant, law, branch, [middle])[0] <= allowed:
            last = middle
        else:
            lost = middle
    return last


def branch_multipliers(plant: SampledPlant, law: LinearLaw, branch: Branch, points: Iterable[int]) -> Floats:
    """Give the largest multiplier over a period of motions of a branch, with the law acting.

    Parameters
    ----------
    plant, law
        `loop_multiplier`.
    branch
        Of the plant's specimen.
    points
        Which of its motions.

    Returns
    -------
    Magnitudes, shape (points,).

    """
    rate_hz = plant.timing.rate_hz
    courses = [motion_slopes(plant.specimen, branch, point, rate_hz) for point in points]
    return np.array([loop_multiplier(plant, law, *each) for each in courses])


def motion_slopes(specimen: Specimen, branch: Branch, point: int, rate_hz: float) -> MotionSlopes:
    """Give the slopes of the spring's force along one motion of a branch, with all its harmonics.

    Parameters
    ----------
    specimen, branch
        The branch is the specimen's.
    point
        Which of its motions.
    rate_hz
        Samples a second.

    """
    spring = spring_of(specimen)
    drive = Harmonic(float(branch.frequencies_hz[point]), float(branch.amplitudes_m[point]))
    samples = rate_hz / drive.frequency_hz * np.array(_PERIODS)
    best = int(np.argmin(np.maximum(np.abs(np.round(samples) / samples - 1.0), _WHOLE)))
    periods, count = _PERIODS[best], round(samples[best])
    parts, wave = (ceil(1.0 / (rate_hz * _PART_S)), _WAVE_OF_STOPS) if spring.kinks else (1, _WAVE)
    states = PeriodMap(specimen).orbit(branch.states[point], drive, wave).states[:wave]
    turns = (np.arange(count * parts) + 0.5) * periods / (count * parts)
    p, rate = (
        np.interp(turns, np.arange(wave) / wave, states[:, y] - states[:, z], period=1.0)
        for y, z in ((Y, Z), (VY, VZ))
    )
    return MotionSlopes(spring.stiffness(p, rate), spring.damping(p, rate), periods, parts)
