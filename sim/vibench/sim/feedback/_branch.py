"""How a law holds a whole branch, by the model: before anything moves."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import inf

import numpy as np

from ..kernels import Floats
from ..model import Harmonic, Specimen, Y, Z
from ..periodic import (
    BalanceEnd,
    Branch,
    FrequencyPath,
    PeriodMap,
    RestoringForce,
    ShootingEnd,
    balance,
    balance_branch_within,
    periodic_branch_within,
    periodic_orbit,
    spring_of,
    structure_of,
)
from ._law import LinearLaw
from ._loop import loop_multipliers
from ._plant import SampledPlant

_POINTS = 25
"""Motions of a branch that are looked at, stable ones too: a late law may lose what needs none."""
_PERIODS = range(10, 41)
"""Of a motion that are gone through: so many that they take a whole number of samples, or nearly so."""
_WAVE = 512
"""Samples of a period by which the slope of the spring is known along it."""
_FROM_ABOVE = (3.0, 2.5, 2.0, 1.7, 1.4, 1.2, 1.0)
"""Levels, over the one that is asked for, along which motions among stops are led down to it."""


@dataclass(frozen=True)
class BranchHold:
    """What a law makes of the motions of a branch."""

    multiplier: float | None
    """The largest over a period with the law acting; None where stops, or no branch, leave it unknown."""
    at_hz: float
    """Where that is, or where the growth is fastest [Hz]."""
    growth_s: float
    """In which the least stable motion grows by e where the base moves as a sine; infinite for none [s]."""


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
) -> BranchHold:
    """Follow the model's branch under one level of the base, and see how a law holds it.

    Parameters
    ----------
    plant, law
        As the host knows them.
    level_m
        Amplitude of the base's displacement [m].
    start_hz, range_hz
        Where the branch begins, and where it is left [Hz].
    begin
        From which side the level is met there; where there are no stops, from rest.

    """
    smooth = _smooth_spring(plant)
    if smooth is None:
        branch = impact_branch(plant.specimen, level_m, start_hz, range_hz, begin)
    else:
        branch = _smooth_branch(plant.specimen, smooth, level_m, start_hz, range_hz)
    if branch is None:
        return BranchHold(None, start_hz, inf)
    sizes = np.abs(branch.multipliers[:, 0])
    rates = np.log(sizes) * branch.frequencies_hz
    fastest = int(np.argmax(rates))
    growth_s = float(1 / rates[fastest]) if sizes[fastest] > 1.0 else inf
    if smooth is None:
        return BranchHold(None, float(branch.frequencies_hz[fastest]), growth_s)
    points = np.unique(np.linspace(0, sizes.size - 1, _POINTS).astype(int))
    held = branch_multipliers(plant, law, branch, points)
    worst = int(np.argmax(held))
    return BranchHold(float(held[worst]), float(branch.frequencies_hz[points[worst]]), growth_s)


def _smooth_spring(plant: SampledPlant) -> RestoringForce | None:
    """Give a spring without stops; None for stops, whose contacts are shorter than a sample."""
    if plant.specimen.contact.stops.restitution is not None:
        return None
    spring = spring_of(plant.specimen)
    return None if spring.kinks else spring


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


def branch_multipliers(plant: SampledPlant, law: LinearLaw, branch: Branch, points: Iterable[int]) -> Floats:
    """Give the largest multiplier over a period of motions of a branch, with the law acting.

    Parameters
    ----------
    plant, law
        Of a specimen with a smooth spring; `loop_multipliers`.
    branch
        Of that specimen.
    points
        Which of its motions.

    Returns
    -------
    Magnitudes, shape (points,).

    """
    courses = [motion_slopes(plant.specimen, branch, point, plant.timing.rate_hz) for point in points]
    return np.array([loop_multipliers(plant, law, [each], periods)[0] for each, periods in courses])


def motion_slopes(specimen: Specimen, branch: Branch, point: int, rate_hz: float) -> tuple[Floats, int]:
    """Give the slope of a smooth spring along one motion of a branch, with all its harmonics.

    Parameters
    ----------
    specimen, branch
        The branch is the specimen's.
    point
        Which of its motions.
    rate_hz
        Samples a second.

    Returns
    -------
    dF/dp in the middle between samples, shape (samples,) [N/m], and over how many periods they go.

    """
    spring = spring_of(specimen)
    drive = Harmonic(float(branch.frequencies_hz[point]), float(branch.amplitudes_m[point]))
    samples = rate_hz / drive.frequency_hz * np.array(_PERIODS)
    best = int(np.argmin(np.abs(samples - np.round(samples)) / samples))
    periods, count = _PERIODS[best], round(samples[best])
    states = PeriodMap(specimen).orbit(branch.states[point], drive, _WAVE).states
    p = states[:_WAVE, Y] - states[:_WAVE, Z]
    turns = (np.arange(count) + 0.5) * periods / count
    wave = np.interp(turns, np.arange(_WAVE) / _WAVE, p, period=1.0)
    return spring.stiffness(wave, np.zeros_like(wave)), periods
