"""A motion of a specimen under a harmonic drive, advanced by the native engine. SI units."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..model import Accuracy, Harmonic, Outcome, Specimen, gong2025
from ._library import Engine, EngineError, library_path
from ._scene import scene_of, shapes_for

MOST_STEPS = 2_000_000_000
"""Steps of flight in a run: seconds of work, and two days of the paper's specimen."""
KNOWN_DURATION_S = 0.03
KNOWN_MOTION = (
    -2.11343791e-05,
    -6.81040288e-05,
    -3.33122184e-05,
    5.06300264e-03,
    2.63303389e-02,
    -1.20895040e-02,
)
"""Where the paper's specimen is then, with a loss of 0.5 s/m, under 20 um at 130 Hz from rest."""
KNOWN_TO = 1e-6
"""Of 100 um and 0.1 m/s."""


class NativeRun:
    """One motion: where it is, and what was filled on its way."""

    def __init__(
        self,
        specimen: Specimen,
        drive: Harmonic,
        initial_state: ArrayLike,
        tolerance: float,
        *,
        start_time_s: float = 0.0,
        sample_rate_hz: float = 0.0,
        samples: int = 0,
        most_impacts: int = 0,
        engine: Engine | None = None,
    ) -> None:
        """Start from x, y, z, vx, vy, vz, absolute [m, m/s], shape (6,).

        Raises ValueError when the engine refuses the specimen, the drive or the start.
        """
        self._engine = engine = native_engine() if engine is None else engine
        self._tolerance = tolerance
        # The tables point into the shapes, which therefore live as long.
        self._shapes = shapes_for(engine, specimen)
        self._tables = engine.prepare(scene_of(engine, specimen, drive, self._shapes))
        self._samples = np.zeros((samples, 6))
        self._times = np.zeros(most_impacts)
        self._state, self._record = engine.new("State"), engine.new("Record")
        self._state["motion"], self._state["clock_high"] = initial_state, start_time_s
        record = self._record
        record["start"], record["sample_rate"] = start_time_s, sample_rate_hz
        record["samples"], record["sample_room"] = self._samples.ctypes.data, samples
        record["impact_times"], record["impact_room"] = self._times.ctypes.data, most_impacts
        record["steps_left"] = MOST_STEPS
        if engine.start(self._tables, self._state, tolerance) != 0:
            msg = f"A tolerance of {tolerance} is not allowed: it must lie between 0 and 1."
            raise ValueError(msg)

    def advance(self, until_s: float) -> Outcome:
        """Advance to an instant [s]; one that has passed already changes nothing.

        Raises ValueError when the engine refuses the instant.
        """
        code = self._engine.run(self._tables, self._state, until_s, self._tolerance, self._record)
        if code < 0:
            msg = f"The native engine refuses to advance to {until_s} s: the instant must be finite."
            raise ValueError(msg)
        return Outcome(code)

    @property
    def motion(self) -> NDArray[np.float64]:
        """x, y, z, vx, vy, vz now, shape (6,)."""
        return np.array(self._state["motion"])

    @property
    def time_s(self) -> float:
        """How far the motion has come."""
        return float(self._state["clock_high"])

    @property
    def impact_times_s(self) -> NDArray[np.float64]:
        """When m1 touched a stop, so far."""
        return self._times[: int(self._record["impacts"])]

    @property
    def samples(self) -> NDArray[np.float64]:
        """x, y, z, vx, vy, vz at the samples so far, shape (n, 6)."""
        return self._samples[: int(self._record["samples_kept"])]


@lru_cache(maxsize=1)
def native_engine() -> Engine:
    """Load the engine of this processor; it has then answered a known scene.

    Raises EngineError when there is none, or when its answer is wrong.
    """
    engine = Engine(library_path())
    check_known_answer(engine)
    return engine


def check_known_answer(engine: Engine) -> None:
    """Refuse an engine that was compiled wrongly, which can be silent and fast."""
    specimen, drive = gong2025(contact="hunt_crossley:0.5"), Harmonic(130.0, 20e-6)
    run = NativeRun(
        specimen, drive, np.zeros(6), Accuracy.STANDARD.tolerance, most_impacts=100, engine=engine
    )
    outcome = run.advance(KNOWN_DURATION_S)
    off = np.abs(run.motion - KNOWN_MOTION) / np.repeat([1e-4, 0.1], 3)
    if outcome is not Outcome.REACHED_END or not math.isfinite(off.max()) or off.max() > KNOWN_TO:
        msg = f"{engine.path} answers a known scene wrongly, by {off.max():.1e}: rebuild it, or report this."
        raise EngineError(msg)
