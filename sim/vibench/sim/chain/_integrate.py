"""The motion of a chain under a drive, from a state to a later time. SI units."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine import MOST_IMPACTS, SPARE_IMPACTS
from ..flight import SERIES_TERMS
from ..kernels import Complex, Floats, Table, clock_at
from ..model import Accuracy, AccuracyWord, Drive, Harmonic, Outcome, chosen
from ..motion import (
    MAX_IMPACT_RATE_HZ,
    ROUNDING,
    Trajectory,
    check_impact_rate,
    check_times,
    check_within,
    integrate,
)
from ._base_force import PIECE_TERMS, longest_window_s, with_pieces
from ._cell_contact import begin_pressing
from ._cell_flow import CURVATURE_TERMS, POWER, SIDE, fill_curvature
from ._chain import MASSES_PER_CELL, Chain
from ._crossing import IMPACTS, NEXT_SAMPLE, ChainRecord
from ._observer import NOTHING, ChainObservations
from ._run import advance_chain, chain_cells
from ._tables import OBSERVED, PATH, ChainTables, chain_tables
from ._windows import drive_term, fill_observed, law_of

MOST_CELL_WINDOWS = 10**10
"""Windows of a run times its cells: hours."""
STATES_PER_CELL = 2 * MASSES_PER_CELL
"""x, y, z, vx, vy, vz."""


@dataclass(frozen=True, eq=False)
class ChainImpacts:
    """When and where a sphere touched a stop."""

    times_s: Floats
    """Ascending, shape (count,) [s]."""
    cells: NDArray[np.int64]
    """Which cell, counted from 0 at the base; shape (count,)."""
    per_cell: NDArray[np.int64]
    """How many in each cell, shape (cells,)."""

    @property
    def count(self) -> int:
        """How many contacts began."""
        return len(self.times_s)


@dataclass(frozen=True, eq=False)
class ChainTrajectory:
    """Where a chain went, where and when it struck, and how the run ended."""

    time_s: Floats
    """Shape (n,); empty when no sample rate was asked for."""
    states: Floats
    """Shape (n, cells, 6): x, y, z, vx, vy, vz of every cell [m, m/s], absolute."""
    final_state: Floats
    """Shape (cells, 6), at ``end_time_s``."""
    end_time_s: float
    impacts: ChainImpacts
    outcome: Outcome
    """Look here first: only REACHED_END reached the time that was asked for."""
    accuracy: Accuracy


def integrate_chain(
    chain: Chain,
    drive: Drive,
    duration_s: float,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
    sample_rate_hz: float | None = None,
    *,
    start_time_s: float = 0.0,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> ChainTrajectory:
    """Follow a chain of cells under a drive.

    Flight is exact (a harmonic drive in closed form, others as polynomials on pieces); contacts are proved or
    excluded by bounds and resolved with the tolerance of ``accuracy``, however many cells press at once.
    Sampling changes no step. One cell is the specimen, and is followed as `vibench.sim.motion` does.

    Parameters
    ----------
    chain, drive
        What moves, and what moves its base.
    duration_s
        [s]; within the drive, if that is a sweep or samples.
    accuracy
        Relative error allowed in a step of a contact.
    initial_state
        x, y, z, vx, vy, vz of every cell, absolute [m, m/s], shape (cells, 6); at rest when None. Cells may
        be in contact.
    sample_rate_hz
        Samples at start_time_s + k / sample_rate_hz up to the end; None keeps none.
    start_time_s
        Time on the drive's clock at which the run begins: to go on from an earlier final state.
    max_impact_rate_hz
        A run whose cells strike more often than this, each on average, ends with TOO_MANY_IMPACTS.

    Raises
    ------
    ValueError
        When an argument is not allowed, the run would take hours, or the drive is over before the run is.

    """
    accuracy = chosen(Accuracy, accuracy)
    check_times(duration_s, start_time_s, sample_rate_hz)
    if chain.size == 1:
        start = None if initial_state is None else start_motion(chain, initial_state)[0]
        run = integrate(
            chain.cells[0], drive, duration_s, accuracy, start, sample_rate_hz,
            start_time_s=start_time_s, max_impact_rate_hz=max_impact_rate_hz,
        )  # fmt: skip
        return _of_one(run)
    harmonic = drive if isinstance(drive, Harmonic) else Harmonic(1.0, 0.0)
    tables = chain_tables(chain, harmonic, accuracy)
    check_work(chain, duration_s, longest_window_s(tables, drive))
    cells, phasors = start_chain(chain, initial_state, start_time_s, tables, accuracy)
    clock, end = clock_at(start_time_s), start_time_s + duration_s
    record = new_chain_record(chain, start_time_s, duration_s, sample_rate_hz, max_impact_rate_hz)
    observations, code = new_observations(chain, NOTHING), int(Outcome.REACHED_END)
    for batch, until in _batches(chain, drive, tables, start_time_s, end):
        code = advance_chain(cells, phasors, clock, until, batch, accuracy.tolerance, record, observations)
        if code != Outcome.REACHED_END:
            break
    return _trajectory(chain, phasors, float(clock[0]), tables, record, Outcome(code), accuracy)


def check_work(chain: Chain, duration_s: float, window_s: float) -> None:
    """Refuse a run of more windows, each ``window_s`` at most, than anybody waits for."""
    work = duration_s / window_s * chain.size
    if work > MOST_CELL_WINDOWS:
        msg = (
            f"{duration_s:g} s of {chain.size} cells are not allowed: they take {work:.2g} windows of "
            f"{window_s:.2g} s, one for each cell, and {MOST_CELL_WINDOWS:.0e} are the most; shorten the "
            "run, or lower the highest frequency of drive and cells."
        )
        raise ValueError(msg)


def _batches(
    chain: Chain, drive: Drive, tables: ChainTables, start_s: float, end_s: float
) -> Iterable[tuple[ChainTables, float]]:
    """Give what the kernels need to know of the drive, and until when that is all."""
    match drive:
        case Harmonic():
            return [(tables, end_s)]
        case _:
            check_within(drive.duration_s, end_s)
            return with_pieces(tables, chain.cells[0], drive, start_s, end_s)


def start_chain(
    chain: Chain, initial_state: ArrayLike | None, time_s: float, tables: ChainTables, accuracy: Accuracy
) -> tuple[Table, Complex]:
    """Turn a state into what the kernels advance: a row for each cell, and the phasors of them all.

    Raises ValueError when the state has not the shape (cells, 6), or is not finite.
    """
    motion = start_motion(chain, initial_state)
    flat = np.concatenate([motion[:, :MASSES_PER_CELL].ravel(), motion[:, MASSES_PER_CELL:].ravel()])
    clock = clock_at(time_s)
    drive = drive_term(clock, 0.0, tables)
    phasors = np.append(tables.rows @ (flat - (drive * tables.shapes[-1]).real), drive)
    cells = chain_cells(chain.size)
    terms, series, curvature = np.zeros_like(phasors), np.zeros(SERIES_TERMS), np.zeros(CURVATURE_TERMS)
    for place in range(chain.size):
        law, markov = law_of(tables.laws[place]), tables.markov[place, PATH]
        p = float(motion[place, 1] - motion[place, 2])
        rate = float(motion[place, 4] - motion[place, 5])
        if law.kind == POWER:
            cells[place, SIDE] = 1.0
        elif not -law.lower < p < law.upper:
            fill_observed(series, phasors, place, PATH, terms, np.zeros(PIECE_TERMS), tables)
            fill_curvature(curvature, series)
            begin_pressing(
                cells[place], math.copysign(1.0, p), p, rate, float(curvature[0]), markov, law,
                accuracy.tolerance,
            )  # fmt: skip
    return cells, phasors


def start_motion(chain: Chain, initial_state: ArrayLike | None) -> Floats:
    """Check a state, or take rest: shape (cells, 6)."""
    shape = (chain.size, STATES_PER_CELL)
    motion = np.zeros(shape) if initial_state is None else np.asarray(initial_state, dtype=np.float64)
    if motion.shape != shape or not bool(np.all(np.isfinite(motion))):
        msg = (
            f"An initial state of shape {motion.shape} is not allowed: give finite numbers "
            f"x, y, z, vx, vy, vz for each of the {chain.size} cells, shape {shape}."
        )
        raise ValueError(msg)
    return motion


def _of_one(run: Trajectory) -> ChainTrajectory:
    """Give the motion of one cell, which is that of the specimen, as that of a chain."""
    impacts = run.impacts
    return ChainTrajectory(
        time_s=run.time_s,
        states=run.states[:, None, :],
        final_state=run.final_state[None, :],
        end_time_s=run.end_time_s,
        impacts=ChainImpacts(
            impacts.times_s, np.zeros(impacts.count, np.int64), np.array([impacts.count], np.int64)
        ),
        outcome=run.outcome,
        accuracy=run.accuracy,
    )


def new_observations(chain: Chain, mode: int) -> ChainObservations:
    """Make what a run observes into."""
    return ChainObservations(mode, np.zeros((OBSERVED, chain.size)), np.zeros(chain.size, np.complex128))


def new_chain_record(
    chain: Chain, start_s: float, duration_s: float, sample_rate_hz: float | None, impact_rate_hz: float
) -> ChainRecord:
    """Make what a run fills: room for its samples and for the impacts that are allowed."""
    check_impact_rate(impact_rate_hz)
    count = 0 if sample_rate_hz is None else math.floor(duration_s * sample_rate_hz * (1.0 + ROUNDING)) + 1
    impacts = min(chain.size * (math.ceil(impact_rate_hz * duration_s) + SPARE_IMPACTS), MOST_IMPACTS)
    return ChainRecord(
        start=start_s,
        sample_rate=1.0 if sample_rate_hz is None else sample_rate_hz,
        samples=np.zeros((count, STATES_PER_CELL * chain.size)),
        impact_times=np.zeros(impacts),
        impact_cells=np.zeros(impacts, np.int64),
        counts=np.zeros(2, np.int64),
    )


def state_of_phasors(chain: Chain, phasors: Complex, tables: ChainTables) -> Floats:
    """Displacements and velocities of every cell, shape (cells, 6)."""
    return _by_cell((phasors @ tables.shapes).real, chain)


def impacts_of(chain: Chain, record: ChainRecord) -> ChainImpacts:
    """Put the impacts of a run in order."""
    made = record.counts[IMPACTS]
    order = np.argsort(record.impact_times[:made], kind="stable")
    cells = record.impact_cells[:made][order]
    return ChainImpacts(record.impact_times[:made][order], cells, np.bincount(cells, minlength=chain.size))


def _by_cell(flat: Floats, chain: Chain) -> Floats:
    """Reorder displacements and velocities of all, shape (..., 6 cells), into (..., cells, 6)."""
    halves = flat.reshape(*flat.shape[:-1], 2, chain.size, MASSES_PER_CELL)
    return np.concatenate([halves[..., 0, :, :], halves[..., 1, :, :]], axis=-1)


def _trajectory(
    chain: Chain,
    phasors: Complex,
    reached: float,
    tables: ChainTables,
    record: ChainRecord,
    outcome: Outcome,
    accuracy: Accuracy,
) -> ChainTrajectory:
    final = state_of_phasors(chain, phasors, tables)
    kept = int(record.counts[NEXT_SAMPLE])
    states = _by_cell(record.samples, chain)
    if outcome is Outcome.REACHED_END and kept < len(states):
        # A sample that rounding puts at, or a hair beyond, the very end.
        states[kept:] = final
        kept = len(states)
    return ChainTrajectory(
        time_s=record.start + np.arange(kept) / record.sample_rate,
        states=states[:kept],
        final_state=final,
        end_time_s=reached,
        impacts=impacts_of(chain, record),
        outcome=outcome,
        accuracy=accuracy,
    )
