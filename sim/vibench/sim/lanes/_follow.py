"""Motions of one specimen under harmonic drives, followed side by side by their states alone. SI units."""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import llvmlite.binding
import numpy as np

from ..collision import LEAST_TOLERANCE, CollisionFit, fit_collisions, time_over_fifth_root
from ..flight import GRID_TURN
from ..kernels import Complex, Floats, Table, Vector
from ..model import VY, VZ, Harmonic, Hertz, Specimen, Y, Z, harmonic_motion, modal_form
from ..slots import STATE_SIZE, parameters
from ._rows import (
    COLUMN,
    CUBE,
    DRIVE,
    DRIVE_TERM,
    FOUR_STEPS,
    FREQUENCY,
    GRID,
    KEPT,
    KICK,
    LEFT,
    ONE_STEP,
    ORDERS,
    PAIR,
    PERIOD,
    RATE,
    SERIES,
    SQUARE,
    TERM,
    TERMS,
)
from ._run import FAILED, FOLLOWED, IN_CONTACT, run_lanes, states_of_terms

MOST_DAMPED = 0.05
"""Damping ratio up to which lanes take a mode: beyond, their series would need more terms."""
LEAST_PART = 1e-9
"""Of a mode in p, over the largest: lanes follow p alone, and find everything else from it."""
FIT_ERROR = 2e-7
"""Largest error of a speed after a collision, over the speed before, that the fit may have."""
GUESS_POINTS = 64


@dataclass(frozen=True, eq=False)
class LaneRun:
    """What became of one motion."""

    states: Floats
    """Once a drive period, up to the end, shape (periods, 6); those within a contact are where the flight
    after it would have come from."""
    state: Vector
    """The end itself, shape (STATE_SIZE,)."""
    impacts: int


@dataclass(frozen=True, eq=False)
class _Numbers:
    """Of one specimen."""

    rates: Complex
    shapes: Complex
    """Motion of a unit of each mode in p, shape (3, 6)."""
    onto: Complex
    """What a state adds to the modes in p, shape (3, 6)."""
    kick: Complex
    fit: CollisionFit
    box: Vector


@cache
def lanes_pay() -> bool:
    """Whether this processor keeps eight numbers in two registers or one, and fuses products with sums."""
    features = llvmlite.binding.get_host_cpu_features()
    return bool(features.get("fma") and features.get("avx2"))


def lanes_serve(specimen: Specimen, tolerance: float) -> bool:
    """Whether lanes follow such a specimen at such a tolerance: Hertz's stops, three modes that turn."""
    return tolerance >= LEAST_TOLERANCE and _numbers(specimen) is not None


@lru_cache(maxsize=8)
def _numbers(specimen: Specimen) -> _Numbers | None:
    if not isinstance(specimen.contact, Hertz) or not math.isfinite(sum(specimen.gaps_m)):
        return None
    modes = modal_form(specimen)
    path = modes.shapes[:, Y] - modes.shapes[:, Z]
    turns = np.abs(modes.rates.imag)
    if (
        len(modes.rates) != DRIVE_TERM
        or np.any(-modes.rates.real > MOST_DAMPED * turns)
        or np.abs(path).min() < LEAST_PART * np.abs(path).max()
    ):
        return None
    fit = fit_collisions(specimen)
    if fit is None or not (fit.error < FIT_ERROR and np.all(fit.half > 0.0)):
        return None
    m1, m2 = specimen.masses[1:]
    onto = modes.rows * path[:, None]
    return _Numbers(
        rates=modes.rates,
        shapes=modes.shapes / path[:, None],
        onto=np.ascontiguousarray(onto),
        kick=(onto[:, VZ] / m2 - onto[:, VY] / m1) * (m1 * m2 / (m1 + m2)),
        fit=fit,
        box=_box_of(fit, time_over_fifth_root(specimen)),
    )


def _box_of(fit: CollisionFit, unit: float) -> Vector:
    """Give the numbers of `collide_lanes`: a guess of the fifth root, u over it, and the box of the fit."""
    middle, half = fit.middle[-1], fit.half[-1]
    roots = np.linspace(middle - half, middle + half, GUESS_POINTS) / unit
    guess = np.polyfit(roots ** (-5.0 / 4.0), roots, 3)
    return np.array([*guess, unit, middle, *(1.0 / fit.half)])


def follow_in_lanes(
    specimen: Specimen,
    tolerance: float,
    drives: Sequence[Harmonic],
    starts: Sequence[Floats],
    periods: Sequence[int],
) -> list[LaneRun | None]:
    """Follow motions of a specimen that `lanes_serve`, each for a number of its drive periods.

    Parameters
    ----------
    specimen, tolerance
        Of all; the tolerance is that of the contacts which are resolved by steps.
    drives
        Each begins at its phase at time zero.
    starts
        x, y, z, vx, vy, vz of each [m, m/s], between the stops.
    periods
        How long, in its own drive periods.

    Returns
    -------
    What became of each; None of one that was lost.

    """
    numbers = _numbers(specimen)
    if numbers is None:
        msg = "This specimen cannot be followed in lanes: they serve Hertz's stops and three modes that turn."
        raise ValueError(msg)
    motions = _motions_of(specimen, numbers, drives, np.array(starts))
    count, most = len(drives), max(periods)
    # The longest first, so that all lanes end at about the same time.
    order = np.argsort(-np.array(periods), kind="stable")
    wanted = np.array(periods)[order]
    kept, states = np.zeros(count, np.int64), np.zeros((count, most, KEPT))
    impacts, codes, ends = np.zeros(count, np.int64), np.full(count, FOLLOWED), np.zeros((count, STATE_SIZE))
    run_lanes(
        motions.columns[order],
        motions.shapes[order],
        motions.bases[order],
        numbers.onto,
        wanted,
        parameters(specimen),
        tolerance,
        numbers.box,
        numbers.fit.coefficients,
        states,
        kept,
        impacts,
        ends,
        codes,
    )
    followed = np.zeros((count, most, 6))
    states_of_terms(states, kept, motions.columns[order], motions.shapes[order], followed)
    found: list[LaneRun | None] = [None] * count
    for place, number in enumerate(order):
        if codes[place] != FAILED:
            found[number] = _run_of(
                followed[place, : kept[place]], ends[place], int(codes[place]), int(impacts[place])
            )
    return found


@dataclass(frozen=True, eq=False)
class _Motions:
    """What several motions come with, as `run_lanes` says."""

    columns: Table
    shapes: Complex
    bases: Complex


def _motions_of(
    specimen: Specimen, numbers: _Numbers, drives: Sequence[Harmonic], starts: Floats
) -> _Motions:
    count = len(drives)
    omegas = np.array([2.0 * math.pi * drive.frequency_hz for drive in drives])
    phases = np.array([cmath.exp(1j * drive.phase_rad) for drive in drives])
    moved = [
        harmonic_motion(specimen, omega, drive.amplitude_m)
        for omega, drive in zip(omegas.tolist(), drives, strict=True)
    ]
    steady, forces = np.array([motion for motion, _ in moved]), np.array([force for _, force in moved])
    path = steady[:, Y] - steady[:, Z]
    rates = np.column_stack([np.tile(numbers.rates, (count, 1)), 1j * omegas])
    grid = GRID_TURN / np.max(np.abs(rates), axis=1)
    shapes = np.empty((count, TERMS, 6), np.complex128)
    shapes[:, :DRIVE_TERM], shapes[:, DRIVE_TERM] = numbers.shapes, steady / path[:, None]
    terms = np.empty((count, TERMS), np.complex128)
    free = starts - (steady * phases[:, None]).real
    # Summed motion by motion: a product of matrices rounds by how many there are.
    terms[:, :DRIVE_TERM] = (free[:, None, :] * numbers.onto).sum(axis=2)
    terms[:, DRIVE_TERM] = path * phases
    columns = np.zeros((count, COLUMN))

    def write(row: int, values: Complex) -> None:
        columns[:, row : row + 2 * values.shape[-1]] = np.ascontiguousarray(values).view(np.float64)

    write(TERM, terms)
    write(RATE, rates)
    write(ONE_STEP, np.exp(rates * grid[:, None]))
    write(FOUR_STEPS, np.exp(4.0 * rates * grid[:, None]))
    for order in range(1, ORDERS):
        write(SERIES + PAIR * (order - 1), rates**order / math.factorial(order))
    columns[:, SQUARE : SQUARE + TERMS] = np.abs(rates) ** 2
    columns[:, CUBE : CUBE + TERMS] = np.abs(rates) ** 3
    write(KICK, numbers.kick)
    write(DRIVE, terms[:, DRIVE_TERM:])
    columns[:, FREQUENCY] = [drive.frequency_hz for drive in drives]
    columns[:, GRID] = grid
    columns[:, LEFT] = columns[:, PERIOD] = 1.0 / columns[:, FREQUENCY]
    bases = forces * phases
    return _Motions(columns, shapes, bases)


def _run_of(states: Floats, end: Vector, code: int, impacts: int) -> LaneRun:
    if code == IN_CONTACT:
        return LaneRun(np.vstack([states, end[:6]]), end.copy(), impacts)
    state = np.zeros(STATE_SIZE)
    state[:6] = states[-1]
    return LaneRun(states, state, impacts)
