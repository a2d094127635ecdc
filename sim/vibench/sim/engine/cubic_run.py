"""A motion of a specimen on a base whose displacement is a cubic on each of equal intervals. SI units."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ..model.modes import state_matrix
from ..model.outcome import Outcome
from ..model.power_law import PowerLaw
from ..model.specimen import Specimen
from .library import Engine, Tables
from .run import DIRECTIONS, Floats, RunRecord, native_engine, refuse_inside_a_stop
from .scene import fill_power, fill_specimen
from .structures import Structure


def cubic_tables(engine: Engine, specimen: Specimen, interval_s: float) -> Tables:
    """Prepare runs over intervals of one length; threads may share the tables.

    Raises ValueError when the engine refuses the interval or the specimen.
    """
    if not 0.0 < interval_s < math.inf:
        msg = f"Interval {interval_s} s is not allowed: it must be positive and finite."
        raise ValueError(msg)
    scene = engine.new("CubicScene", interval=interval_s)
    fill_specimen(scene["specimen"], specimen)
    scene["fastest"] = np.max(np.abs(np.linalg.eigvals(state_matrix(specimen)[0])))
    if isinstance(specimen.contact, PowerLaw):
        fill_power(engine, scene, specimen.contact)
    return engine.prepare_cubics(scene)


def start_on_cubics(
    engine: Engine, tables: Tables, specimen: Specimen, state: Structure, motion: ArrayLike, tolerance: float
) -> None:
    """Put a `State` to x, y, z, vx, vy, vz, absolute [m, m/s], shape (6,); a stop that is reached is found.

    Raises ValueError when the motion is inside a rigid stop.
    """
    state["motion"] = motion
    refuse_inside_a_stop(state["motion"], specimen)
    engine.start(tables, state, tolerance)


class CubicRun:
    """One motion, advanced interval by interval."""

    def __init__(
        self,
        specimen: Specimen,
        interval_s: float,
        initial_state: ArrayLike,
        tolerance: float,
        *,
        start_time_s: float = 0.0,
    ) -> None:
        """Start from x, y, z, vx, vy, vz, absolute [m, m/s], shape (6,).

        Raises ValueError when the interval, the specimen or the start is not allowed.
        """
        self._engine = engine = native_engine()
        self._tables = cubic_tables(engine, specimen, interval_s)
        self._interval_s = interval_s
        self._tolerance = tolerance
        self._state = engine.new("State", clock_high=start_time_s)
        start_on_cubics(engine, self._tables, specimen, self._state, initial_state, tolerance)

    def advance(
        self, pieces: Floats, record: RunRecord, *, first_from_s: float = 0.0, last_to_s: float | None = None
    ) -> Outcome:
        """Advance over a row of intervals.

        Parameters
        ----------
        pieces
            c0 ... c3 of the base's displacement on each, shape (intervals, 4).
        record
            Filled on the way.
        first_from_s, last_to_s
            Where the run begins in the first interval and ends in the last, since their starts [s].

        """
        drive = self._engine.new("CubicDrive", base=pieces, first_from=first_from_s)
        drive["last_to"] = self._interval_s if last_to_s is None else last_to_s
        return self._run(drive, record)

    def follow(self, pieces: Floats, record: RunRecord) -> tuple[Floats, Floats]:
        """Advance over whole intervals, as far as possible.

        Returns motions at the ends of those that were passed, shape (passed, 6), and impacts in each.
        """
        motions, impacts = np.empty((len(pieces), DIRECTIONS)), np.empty(len(pieces))
        drive = self._engine.new("CubicDrive", base=pieces, motions=motions, impacts=impacts)
        drive["last_to"] = self._interval_s
        self._run(drive, record)
        passed = int(drive["done"])
        return motions[:passed], impacts[:passed]

    def _run(self, drive: Structure, record: RunRecord) -> Outcome:
        code = self._engine.run_cubics(self._tables, self._state, drive, self._tolerance, record.structure)
        if code < 0:
            msg = "The native engine refuses these intervals: their ends must lie within them."
            raise ValueError(msg)
        return Outcome(code)

    @property
    def motion(self) -> Floats:
        """x, y, z, vx, vy, vz now, shape (6,)."""
        return np.array(self._state["motion"])

    @property
    def time_s(self) -> float:
        """How far the motion has come."""
        return float(self._state["clock_high"])
