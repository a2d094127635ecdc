"""Integration of a chain under a drive. SI units."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.run import (
    MAX_IMPACT_RATE_HZ,
    MOST_IMPACTS,
    SPARE_IMPACTS,
    Accuracy,
    AccuracyWord,
    Outcome,
    Watch,
    native_engine,
    next_slice,
)
from ..engine.scene import collision_structure, fill_drive, power_structure
from ..motion.integrate import ROUNDING, Trajectory, check_impact_rate, check_times, check_within, integrate
from ..specimen.drive import Drive, Harmonic
from ..specimen.specimen import Complex, Floats
from ..specimen.stops import member
from ._chain import Chain
from ._tables import ChainTables, Pieces, chain_tables, longest_window_s, pieces_between

STATES_PER_CELL = 6
"""Number of state variables of a cell: x, y, z, vx, vy, vz."""
MOST_WINDOWS = 10**11
"""Largest number of windows of a run; `check_work` usually refuses runs with far fewer windows."""
SLICE_CELL_WINDOWS = 1 << 12
"""Product of the numbers of windows and cells between two time-limit checks, a few milliseconds apart."""


class ChainRun:
    """Integration of a chain in progress, with its current state, samples and observations."""

    def __init__(
        self,
        chain: Chain,
        drive: Harmonic,
        tables: ChainTables,
        accuracy: Accuracy,
        *,
        most_impacts: int,
        start_time_s: float = 0.0,
        samples: int = 0,
        sample_rate_hz: float = 1.0,
    ) -> None:
        """Allocate memory for impacts, and for samples at ``start_time_s`` + k / ``sample_rate_hz``."""
        engine, cells = native_engine(), chain.size
        self._states = engine.rows("CellState", cells)
        # Do not initialise these arrays, because only filled entries are read.
        self._times, self._places = np.empty(most_impacts), np.empty(most_impacts)
        self._samples = np.empty((samples, cells, STATES_PER_CELL))
        self.peaks_m, self._lines = np.zeros((cells, 2)), np.zeros(cells, np.complex128)
        """Largest observed abs(x) and abs(p) of every cell, shape (cells, 2) [m]."""
        self._motion = engine.new(
            "ChainMotion",
            kinds=tables.kinds.view(np.float64),
            kind_of=tables.kind_of,
            states=self._states.view(np.float64),
            tolerance=accuracy.tolerance,
            fastest=tables.fastest,
            windows=tables.windows,
            clashes=tables.clash,
            collisions=collision_structure(engine).ctypes.data,
            power_shapes=power_structure(engine).ctypes.data,
            windows_left=MOST_WINDOWS,
            start=start_time_s,
            sample_rate=sample_rate_hz,
            samples=self._samples,
            impact_times=self._times,
            impact_cells=self._places,
            peaks=self.peaks_m,
            lines=self._lines.view(np.float64),
            memory=np.empty(engine.chain_memory(cells, len(tables.kinds))),
        )
        fill_drive(self._motion["drive"], drive, chain.cells[0])

    def place(self, motion: Floats, time_s: float) -> None:
        """Set the state x, y, z, vx, vy, vz of every cell, shape (cells, 6), and the time [s]."""
        x, y, z, vx, vy, vz = motion.T
        for name, values in {"x": x, "p": y - z, "z": z, "vx": vx, "vp": vy - vz, "vz": vz}.items():
            self._states[name] = values
        self._motion["clock_high"], self._motion["clock_low"] = time_s, 0.0
        native_engine().call("start_chain", self._motion)

    def drive_by(self, pieces: Pieces) -> None:
        """Replace the harmonic drive by piecewise polynomials from now on."""
        native_engine().fill(
            self._motion, pieces=pieces.terms, piece_start=pieces.start_s, piece_length=pieces.length_s
        )

    def watch(self, what: Watch) -> None:
        """Set the quantities of the motion to observe from now on."""
        self._motion["watch"] = what

    def advance(self, until_s: float) -> Outcome:
        """Integrate the chain to a time [s] and return the outcome; do nothing if that time has passed."""
        self._motion["until"] = until_s
        size, left = max(1, SLICE_CELL_WINDOWS // len(self._states)), int(self._motion["windows_left"])
        while True:
            self._motion["windows_left"] = allowed = next_slice(left, size)
            code = native_engine().call("follow_chain", self._motion)
            left -= allowed - int(self._motion["windows_left"])
            if code != Outcome.TOO_LONG or left <= 0:
                self._motion["windows_left"] = max(left, 0)
                return Outcome(code)

    @property
    def motion(self) -> Floats:
        """Current x, y, z, vx, vy, vz of every cell, shape (cells, 6)."""
        s = self._states
        return np.column_stack([s["x"], s["p"] + s["z"], s["z"], s["vx"], s["vp"] + s["vz"], s["vz"]])

    @property
    def time_s(self) -> float:
        """Current time of the motion [s]."""
        return float(self._motion["clock_high"])

    @property
    def forces(self) -> Complex:
        """Integral of each cell's contact force times exp(-i (omega t + phase)), shape (cells,) [N s]."""
        return self._lines

    @property
    def impacts(self) -> int:
        """Number of contacts of all cells so far."""
        return int(self._motion["impacts"])

    @property
    def impact_times_s(self) -> Floats:
        """Times at which contacts begin, shape (count,) [s]; not sorted within a time window."""
        return self._times[: self.impacts]

    @property
    def impact_cells(self) -> NDArray[np.int64]:
        """Index of the cell in contact, in the order of `impact_times_s`, shape (count,)."""
        return self._places[: self.impacts].astype(np.int64)

    def samples(self, outcome: Outcome) -> Floats:
        """Return the samples of x, y, z, vx, vy, vz of every cell in a finished run, shape (n, cells, 6)."""
        kept = int(self._motion["samples_kept"])
        if outcome is not Outcome.REACHED_END:
            return self._samples[:kept]
        # Because of rounding, the last sample time may lie just after the end of the run.
        self._samples[kept:] = self.motion
        return self._samples


MOST_CELL_WINDOWS = 10**10
"""Largest product of the numbers of windows and cells; larger runs would take hours."""


@dataclass(frozen=True, eq=False)
class ChainImpacts:
    """Start times and cells of all contacts in a run."""

    times_s: Floats
    """Times at which contacts begin, ascending, shape (count,) [s]."""
    cells: NDArray[np.int64]
    """Index of the cell in which each contact occurs, from 0 at the base, shape (count,)."""
    per_cell: NDArray[np.int64]
    """Number of contacts in each cell, shape (cells,)."""

    @property
    def count(self) -> int:
        """Number of contacts of all cells in the run."""
        return len(self.times_s)


@dataclass(frozen=True, eq=False)
class ChainTrajectory:
    """Motion, impacts and outcome of a run of a chain."""

    time_s: Floats
    """Sample times, shape (n,) [s]; empty if no sample rate was requested."""
    states: Floats
    """x, y, z, vx, vy, vz of every cell in the inertial frame, shape (n, cells, 6) [m, m/s]."""
    final_state: Floats
    """x, y, z, vx, vy, vz of every cell at ``end_time_s``, shape (cells, 6) [m, m/s]."""
    end_time_s: float
    impacts: ChainImpacts
    outcome: Outcome
    """Outcome of the run; only REACHED_END means that the run reached the requested time."""
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
    """Integrate a chain of cells under a drive.

    Motion without contact is exact for a harmonic drive; other drives are treated as piecewise polynomials.
    Bounds on p ensure that no contact is missed. Contacts, in any number of cells at once, are integrated
    with the tolerance of ``accuracy``. Sampling does not change the time steps. A single cell is integrated
    by `vibench.sim.motion`. Raises ValueError when an argument is not allowed, the run would take hours, or
    the drive ends before the run.

    Parameters
    ----------
    chain, drive, duration_s, accuracy, sample_rate_hz, start_time_s
        As in `vibench.sim.motion.integrate`.
    initial_state
        x, y, z, vx, vy, vz of every cell in the inertial frame, shape (cells, 6) [m, m/s]; None for rest.
        Cells may be in contact.
    max_impact_rate_hz
        Mean impact rate per cell above which the run ends with TOO_MANY_IMPACTS.
    """
    accuracy = member(Accuracy, accuracy)
    check_times(duration_s, start_time_s, sample_rate_hz)
    if chain.size == 1:
        start = None if initial_state is None else start_motion(chain, initial_state)[0]
        alone = integrate(
            chain.cells[0], drive, duration_s, accuracy, start, sample_rate_hz,
            start_time_s=start_time_s, max_impact_rate_hz=max_impact_rate_hz,
        )  # fmt: skip
        return _of_one(alone)
    motion, tables = start_motion(chain, initial_state), chain_tables(chain, drive, accuracy)
    check_work(chain, duration_s, longest_window_s(tables, drive))
    rate_hz = 1.0 if sample_rate_hz is None else sample_rate_hz
    count = 0 if sample_rate_hz is None else math.floor(duration_s * sample_rate_hz * (1.0 + ROUNDING)) + 1
    run = ChainRun(
        chain,
        drive if isinstance(drive, Harmonic) else Harmonic(1.0, 0.0),
        tables,
        accuracy,
        most_impacts=most_chain_impacts(chain, max_impact_rate_hz, duration_s),
        start_time_s=start_time_s,
        samples=count,
        sample_rate_hz=rate_hz,
    )
    run.place(motion, start_time_s)
    end = start_time_s + duration_s
    if isinstance(drive, Harmonic):
        outcome = run.advance(end)
    else:
        check_within(drive.duration_s, end)
        for pieces, until in pieces_between(tables, chain.cells[0], drive, start_time_s, end):
            run.drive_by(pieces)
            outcome = run.advance(until)
            if outcome is not Outcome.REACHED_END:
                break
    return _trajectory(chain, run, start_time_s, rate_hz, outcome, accuracy)


def check_work(chain: Chain, duration_s: float, window_s: float) -> None:
    """Raise ValueError if a run in time windows of ``window_s`` [s] would take hours of computing."""
    work = duration_s / window_s * chain.size
    if work > MOST_CELL_WINDOWS:
        raise ValueError(
            f"{duration_s:g} s of {chain.size} cells are not allowed: they need {work:.2g} cell windows of "
            f"{window_s:.2g} s (windows times cells); at most {MOST_CELL_WINDOWS:.0e} are allowed. "
            "Shorten the run, or lower the highest frequency of drive and cells."
        )


def start_motion(chain: Chain, initial_state: ArrayLike | None) -> Floats:
    """Return the checked initial state, shape (cells, 6); zeros (rest) for None."""
    shape = (chain.size, STATES_PER_CELL)
    motion = np.zeros(shape) if initial_state is None else np.asarray(initial_state, dtype=np.float64)
    if motion.shape != shape or not bool(np.all(np.isfinite(motion))):
        raise ValueError(
            f"An initial state of shape {motion.shape} is not allowed: give finite numbers "
            f"x, y, z, vx, vy, vz for each of the {chain.size} cells, shape {shape}."
        )
    return motion


def _of_one(run: Trajectory) -> ChainTrajectory:
    """Convert the trajectory of a single specimen to the trajectory of a chain of one cell."""
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


def most_chain_impacts(chain: Chain, rate_hz: float, duration_s: float) -> int:
    """Return the number of impacts at which a run ends, from the allowed mean impact rate per cell [1/s].

    Raises ValueError when the rate is not allowed.
    """
    check_impact_rate(rate_hz)
    return min(chain.size * (math.ceil(rate_hz * duration_s) + SPARE_IMPACTS), MOST_IMPACTS)


def _trajectory(
    chain: Chain, run: ChainRun, start_s: float, rate_hz: float, outcome: Outcome, accuracy: Accuracy
) -> ChainTrajectory:
    states, final, order = run.samples(outcome), run.motion, np.argsort(run.impact_times_s, kind="stable")
    cells = run.impact_cells[order]
    return ChainTrajectory(
        time_s=start_s + np.arange(len(states)) / rate_hz,
        states=states,
        final_state=final,
        end_time_s=run.time_s,
        impacts=ChainImpacts(run.impact_times_s[order], cells, np.bincount(cells, minlength=chain.size)),
        outcome=outcome,
        accuracy=accuracy,
    )
