"""A motion of a chain, advanced by the native engine. SI units."""

import numpy as np
from numpy.typing import NDArray

from ..engine.run import Watch, native_engine
from ..engine.scene import collision_structure, fill_drive, power_structure
from ..model.accuracy import Accuracy
from ..model.arrays import Complex, Floats
from ..model.drive import Harmonic
from ..model.outcome import Outcome
from ._base_force import Pieces
from ._chain import Chain
from ._tables import ChainTables

STATES_PER_CELL = 6
"""x, y, z, vx, vy, vz."""
MOST_WINDOWS = 10**11
"""Of a run; `check_work` refuses it long before."""


class ChainRun:
    """One motion of a chain: where it is, and what was kept and observed on the way."""

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
        """Make room for impacts, and for samples at ``start_time_s`` + k / ``sample_rate_hz``."""
        engine, cells = native_engine(), chain.size
        self._states = engine.rows("CellState", cells)
        # Only what has been filled is ever read.
        self._times, self._places = np.empty(most_impacts), np.empty(most_impacts)
        self._samples = np.empty((samples, cells, STATES_PER_CELL))
        self.peaks_m, self._lines = np.zeros((cells, 2)), np.zeros(cells, np.complex128)
        """Largest abs of x and p of every cell that was observed, shape (cells, 2)."""
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
        """Put the chain to x, y, z, vx, vy, vz of every cell, shape (cells, 6), at an instant."""
        x, y, z, vx, vy, vz = motion.T
        for name, values in {"x": x, "p": y - z, "z": z, "vx": vx, "vp": vy - vz, "vz": vz}.items():
            self._states[name] = values
        self._motion["clock_high"], self._motion["clock_low"] = time_s, 0.0
        native_engine().call("start_chain", self._motion)

    def drive_by(self, pieces: Pieces) -> None:
        """Be driven by these from now on, not by the harmonic drive."""
        native_engine().fill(
            self._motion, pieces=pieces.terms, piece_start=pieces.start_s, piece_length=pieces.length_s
        )

    def watch(self, what: Watch) -> None:
        """Observe this from now on."""
        self._motion["watch"] = what

    def advance(self, until_s: float) -> Outcome:
        """Advance to an instant [s]; one that has passed already changes nothing."""
        self._motion["until"] = until_s
        return Outcome(native_engine().call("follow_chain", self._motion))

    @property
    def motion(self) -> Floats:
        """x, y, z, vx, vy, vz of every cell now, shape (cells, 6)."""
        s = self._states
        return np.column_stack([s["x"], s["p"] + s["z"], s["z"], s["vx"], s["vp"] + s["vz"], s["vz"]])

    @property
    def time_s(self) -> float:
        """How far the motion has come."""
        return float(self._motion["clock_high"])

    @property
    def forces(self) -> Complex:
        """Integral of each cell's force against exp(-i (omega t + phase)), of observed lines [N s]."""
        return self._lines

    @property
    def impacts(self) -> int:
        """Contacts that began, so far."""
        return int(self._motion["impacts"])

    @property
    def impact_times_s(self) -> Floats:
        """When they began: ascending but within a window."""
        return self._times[: self.impacts]

    @property
    def impact_cells(self) -> NDArray[np.int64]:
        """Where they began."""
        return self._places[: self.impacts].astype(np.int64)

    def samples(self, outcome: Outcome) -> Floats:
        """x, y, z, vx, vy, vz of every cell at the samples of a run that ended so, shape (n, cells, 6)."""
        kept = int(self._motion["samples_kept"])
        if outcome is not Outcome.REACHED_END:
            return self._samples[:kept]
        # A sample that rounding puts at, or a hair beyond, the very end.
        self._samples[kept:] = self.motion
        return self._samples
