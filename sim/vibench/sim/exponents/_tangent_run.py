"""A run that reads, at even intervals, how much small changes of the state have grown. SI units.

Between readings the changes are carried along exactly; at a reading they are made orthogonal and of unit
length in the energy norm s' diag(K, M) s, and the logarithms of what was divided out are kept (Benettin,
Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980) 9 and 21). The energy without stops is the specimen's
natural norm: free motion can only shrink in it, so that what grows was made to grow by impacts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..flight import FlightTables, start_flight
from ..kernels import Floats, Table, Vector, clock_at, kernel, orthonormal_rows, orthonormalise
from ..model import Accuracy, Harmonic, Outcome, Specimen
from ..motion import MAX_IMPACT_RATE_HZ, new_record, start_motion
from ..slots import GROWTH, IMPACTS, REACHED_END, SIDE, TANGENT_SIZE, PowerTerms, Record
from ..stepping import HarmonicTables, Workspace, advance_by_law, harmonic_tables, new_state, workspace_for

LONGEST_TURN, LONGEST_DECAY = 2.0 * math.pi, 20.0
"""Several changes are made orthogonal at least this often, in radians and decays of the fastest mode: they
stay apart by several digits."""
CHECKS = 32
"""How often at most a run asks whether it has lasted long enough."""
ALMOST = 1e-9
"""A duration this close to a whole number of intervals is taken for it."""
Enough = Callable[[Floats], bool]
"""Asked on the way, with the growth of the intervals so far, shape (n, m): may the run end here?"""
CYCLES = 2.0
"""Cycles of the slowest mode in an interval, unless another is asked for."""


@dataclass(frozen=True)
class Interval:
    """Time between readings."""

    length_s: float
    periods: int
    """Drive periods in it; 0 if it is no whole number of them."""

    def count_in(self, duration_s: float) -> int:
        """Say how many fit into a duration."""
        return math.floor(duration_s / self.length_s * (1.0 + ALMOST))


def interval_for(specimen: Specimen, drive: Harmonic, about_s: float | None = None) -> Interval:
    """Choose whole drive periods of ``about_s`` [s], two cycles of the slowest mode when None.

    Drive periods longer than twice that are cut where they need not be whole.
    """
    about = CYCLES / float(specimen.natural_frequencies_hz[0]) if about_s is None else about_s
    if not 0.0 < about < math.inf:
        msg = f"Interval {about} s is not allowed: it must be positive and finite."
        raise ValueError(msg)
    periods = max(1, round(about * drive.frequency_hz))
    if periods > 2.0 * about * drive.frequency_hz:
        return Interval(about, 0)
    return Interval(periods / drive.frequency_hz, periods)


class Readings(NamedTuple):
    """What a run with a tangent fills, one row an interval."""

    growth: Table
    impacts: NDArray[np.int64]
    section: Table


@dataclass(frozen=True, eq=False)
class TangentRun:
    """How small changes of a motion grew, interval by interval."""

    interval: Interval
    growth: Floats
    """Logarithm of the factor by which each change grew in each interval, shape (n, m)."""
    impacts: NDArray[np.int64]
    """In each interval, shape (n,)."""
    section: Floats
    """x, y, z, vx, vy, vz at each interval's end, shape (n, 6)."""
    impact_times_s: Floats
    is_quiet: bool
    """At the end it is certain that no impact will follow."""
    final_state: Floats
    """Shape (6,), at ``end_time_s``."""
    end_time_s: float
    outcome: Outcome

    @property
    def rates(self) -> Floats:
        """Local exponents, shape (n, m) [1/s]."""
        return self.growth / self.interval.length_s


def run_with_tangent(
    specimen: Specimen,
    drive: Harmonic,
    changes: int,
    duration_s: float,
    interval: Interval,
    accuracy: Accuracy = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
    enough: Enough | None = None,
) -> TangentRun:
    """Follow a motion from the drive's time zero, with ``changes`` (1 to 6) small changes of it.

    The run ends with the last interval that fits, or where ``enough`` says so.
    """
    tables = harmonic_tables(specimen, drive)
    count = interval.count_in(duration_s)
    state = new_state(specimen, start_motion(initial_state), accuracy)
    metric = energy_metric(specimen)
    record = new_record(0.0, duration_s, None, max_impact_rate_hz)
    tangent = starting_changes(metric, changes)
    record = record._replace(tangent=tangent)
    readings = Readings(np.zeros((count, changes)), np.zeros(count, np.int64), np.zeros((count, 6)))
    clock = clock_at(0.0)
    workspace = workspace_for(len(tables.flight.rates), record.observations, tangent)
    parts = _parts(tables.flight, interval.length_s) if changes > 1 else 1
    made, code = 0, REACHED_END
    stride = count if enough is None else math.ceil(count / CHECKS)
    while made < count and code == REACHED_END:
        last = min(count, made + stride)
        code, made = _take_readings(
            state,
            clock,
            interval.length_s,
            parts,
            made,
            last,
            tables,
            accuracy.tolerance,
            record,
            tangent,
            metric,
            readings,
            workspace,
        )
        if enough is not None and enough(readings.growth[:made]):
            break
    return TangentRun(
        interval=interval,
        growth=readings.growth[:made],
        impacts=readings.impacts[:made],
        section=readings.section[:made],
        impact_times_s=record.impact_times[: record.counts[IMPACTS]].copy(),
        is_quiet=bool(_is_quiet(state, clock, tables.flight, tables.power)),
        final_state=state[:6].copy(),
        end_time_s=float(clock[0]),
        outcome=Outcome(code),
    )


def _parts(tables: FlightTables, interval_s: float) -> int:
    """In how many parts an interval is cut so that no change is lost among the others."""
    modes = tables.rates[:-1]
    turns, decays = float(np.max(np.abs(modes))), float(np.max(-modes.real))
    return math.ceil(interval_s * max(turns / LONGEST_TURN, decays / LONGEST_DECAY))


def energy_metric(specimen: Specimen) -> Table:
    """Give the matrix of twice the energy without stops, shape (6, 6)."""
    metric = np.zeros((6, 6))
    metric[:3, :3], metric[3:, 3:] = specimen.stiffness_matrix, specimen.mass_matrix
    return metric


def starting_changes(metric: Table, changes: int) -> Table:
    """Make changes in general directions, the same in every run, orthonormal in the metric."""
    size = len(metric)
    general = np.cos(np.outer(np.arange(1.0, changes + 1.0), np.arange(1.0, size + 1.0)))
    rows = orthonormal_rows(general / np.sqrt(np.diag(metric)), metric)
    return np.hstack([rows, np.zeros((changes, TANGENT_SIZE - GROWTH))])


@kernel
def _take_readings(
    state: Vector,
    clock: Vector,
    interval: float,
    parts: int,
    first: int,
    last: int,
    tables: HarmonicTables,
    tolerance: float,
    record: Record,
    tangent: Table,
    metric: Table,
    readings: Readings,
    workspace: Workspace,
) -> tuple[int, int]:
    """Advance from interval to interval; returns an `Outcome` code and the first that was not completed."""
    laws = (tables.power, tables.steps, tables.held, tables.collisions)
    for k in range(first, last):
        before = record.counts[IMPACTS]
        for part in range(parts):
            until = (k + (part + 1.0) / parts) * interval
            code = advance_by_law(
                state, clock, until, tables.flight, tolerance, record, *laws, tangent, workspace
            )
            if code != REACHED_END:
                return code, k
            readings.growth[k] += tangent[:, GROWTH]
            orthonormalise(tangent[:, :GROWTH], metric, readings.growth[k])
            tangent[:, GROWTH] = 0.0
        readings.impacts[k] = record.counts[IMPACTS] - before
        readings.section[k] = state[:GROWTH]
    return REACHED_END, last


@kernel
def _is_quiet(state: Vector, clock: Vector, tables: FlightTables, power: PowerTerms | None) -> int:
    """Say (1 or 0) whether it is certain that m1 will never touch a stop: free phasors only shrink."""
    if power is not None or state[SIDE] != 0.0:
        return 0
    phasors, reach = np.empty(len(tables.rates), np.complex128), 0.0
    start_flight(phasors, state, clock, tables)
    for j in range(len(phasors)):
        reach += abs(phasors[j] * tables.path[j])
    return 1 if reach < min(tables.par.lower, tables.par.upper) else 0
