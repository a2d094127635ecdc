"""How a law holds a whole branch, by the model: before anything moves."""

from dataclasses import dataclass
from math import inf

import numpy as np

from ..model import Harmonic
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


@dataclass(frozen=True)
class BranchHold:
    """What a law makes of the unstable motions of a branch."""

    multiplier: float | None
    """The largest over a period with the law acting; None where stops, or no branch, leave it unknown."""
    at_hz: float
    """Where that is, or where the growth is fastest [Hz]."""
    growth_s: float
    """In which the least stable motion grows by e where the base moves as a sine; infinite for none [s]."""


def branch_hold(
    plant: SampledPlant, law: LinearLaw, level_m: float, start_hz: float, range_hz: tuple[float, float]
) -> BranchHold:
    """Follow the model's branch under one level of the base, and see how a law holds it.

    Parameters
    ----------
    plant, law
        As the host knows them. The slope of a smooth spring is taken along the fundamental of p.
    level_m
        Amplitude of the base's displacement [m].
    start_hz, range_hz
        Where the branch begins from rest, and where it is left [Hz].

    """
    smooth = _smooth_spring(plant)
    branch = _branch(plant, smooth, level_m, start_hz, range_hz)
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


def _branch(
    plant: SampledPlant,
    smooth: RestoringForce | None,
    level_m: float,
    start_hz: float,
    range_hz: tuple[float, float],
) -> Branch | None:
    path, specimen = FrequencyPath((level_m,)), plant.specimen
    if smooth is not None:
        structure = structure_of(specimen)
        start = balance(structure, smooth, start_hz, level_m)
        if start.outcome is BalanceEnd.NO_SOLUTION:
            return None
        return balance_branch_within(structure, smooth, start, path, *range_hz)
    orbit = periodic_orbit(specimen, Harmonic(start_hz, level_m))
    if orbit.outcome is not ShootingEnd.CONVERGED:
        return None
    return periodic_branch_within(orbit, path, *range_hz)


def _multiplier(
    plant: SampledPlant, law: LinearLaw, spring: RestoringForce, branch: Branch, index: int
) -> float:
    """Give the largest multiplier of the loop along one motion of a branch."""
    frequency_hz = branch.frequencies_hz[index]
    count = round(_PERIODS * plant.timing.rate_hz / frequency_hz)
    size = branch.response_ii[index, -1] * branch.amplitudes_m[index]
    p = size * np.cos(2 * np.pi * _PERIODS * np.arange(count) / count)
    return float(loop_multipliers(plant, law, [spring.stiffness(p, p)], _PERIODS)[0])
