"""How a law holds a whole branch, by the model: before anything moves."""

from dataclasses import dataclass
from enum import StrEnum
from math import inf

import numpy as np

from ..model import Harmonic, Specimen
from ..periodic import (
    BalanceEnd,
    Branch,
    FrequencyPath,
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

_POINTS = 8
"""Unstable motions of a branch that are looked at."""
_PERIODS = 10
_FROM_ABOVE = (3.0, 2.5, 2.0, 1.7, 1.4, 1.2, 1.0)
"""Levels, over the one that is asked for, along which motions among stops are led down to it."""


@dataclass(frozen=True)
class BranchHold:
    """What a law makes of the unstable motions of a branch."""

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
        As the host knows them. The slope of a smooth spring is taken along the fundamental of p.
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
    unstable = np.flatnonzero(sizes > 1.0)
    if not unstable.size:
        return BranchHold(0.0, start_hz, inf)
    rates = np.log(sizes[unstable]) * branch.frequencies_hz[unstable]
    fastest = int(unstable[np.argmax(rates)])
    growth_s, at_hz = float(1 / rates.max()), float(branch.frequencies_hz[fastest])
    if smooth is None:
        return BranchHold(None, at_hz, growth_s)
    chosen = np.unique(unstable[np.linspace(0, unstable.size - 1, _POINTS).astype(int)])
    held = [_multiplier(plant, law, smooth, branch, int(index)) for index in chosen]
    worst = int(np.argmax(held))
    return BranchHold(held[worst], float(branch.frequencies_hz[chosen[worst]]), growth_s)


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


def _multiplier(
    plant: SampledPlant, law: LinearLaw, spring: RestoringForce, branch: Branch, index: int
) -> float:
    """Give the largest multiplier of the loop along one motion of a branch."""
    frequency_hz = branch.frequencies_hz[index]
    count = round(_PERIODS * plant.timing.rate_hz / frequency_hz)
    size = branch.response_ii[index, -1] * branch.amplitudes_m[index]
    p = size * np.cos(2 * np.pi * _PERIODS * np.arange(count) / count)
    return float(loop_multipliers(plant, law, [spring.stiffness(p, p)], _PERIODS)[0])
