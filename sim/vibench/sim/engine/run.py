"""Motion of a specimen under a harmonic or sampled drive, integrated by the native engine. SI units."""

import math
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import IntEnum, StrEnum
from functools import lru_cache
from typing import Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..specimen.contact_laws import PowerLaw, RigidStops
from ..specimen.drive import Harmonic
from ..specimen.modes import state_matrix
from ..specimen.specimen import Floats, Specimen, Y, Z, gong2025
from ..specimen.stops import require_positive
from .library import Engine, EngineError, Structure, Tables, library_path
from .scene import fill_power, fill_specimen, scene_of

MOST_STEPS = 2_000_000_000
"""Largest number of time steps out of contact: enough for two days of the paper's motion."""
MOST_IMPACTS = 1 << 26
"""Largest number of impacts in one run. The impact times take up to 0.5 GB, allocated as impacts occur."""
SPARE_IMPACTS = 100
"""Number of impacts allowed beyond the mean rate, so that even a short run may have a few impacts."""
DIRECTIONS = 6
"""Dimension of a state, which is also the largest number of tangent vectors."""
INSIDE = 1e-9
"""Relative distance beyond a rigid stop at which an initial state still counts as touching the stop."""
KNOWN_DURATION_S = 0.03
KNOWN_MOTION = (
    -2.11343791e-05,
    -6.81040288e-05,
    -3.33122184e-05,
    5.06300264e-03,
    2.63303389e-02,
    -1.20895040e-02,
)
"""Known state of the paper's specimen (loss 0.5 s/m), 30 ms after a start from rest at 20 um and 130 Hz."""
KNOWN_TO = 1e-6
"""Allowed deviation from the known state, in units of 100 um and 0.1 m/s."""
SLICE_STEPS = 1 << 20
"""Number of time steps between two time-limit checks; these steps take a few milliseconds."""
WITHOUT_LIMIT = 64
"""Factor on the number of steps between checks if there is no time limit, for which only Ctrl-C matters."""
_END_S: ContextVar[float] = ContextVar("end of the computing time", default=math.inf)


@contextmanager
def time_limit(end_s: float) -> Iterator[None]:
    """Let runs and `check_time` in this block raise TimeoutError after ``end_s`` (`time.monotonic`) [s]."""
    before = _END_S.set(min(end_s, _END_S.get()))
    try:
        yield
    finally:
        _END_S.reset(before)


def check_time() -> None:
    """Raise TimeoutError if the innermost `time_limit` has expired."""
    if time.monotonic() > _END_S.get():
        raise TimeoutError("The requested computing time is over.")


Part = TypeVar("Part")


def parts_within(end_s: float, parts: Iterable[Part]) -> Iterator[Part]:
    """Yield the parts that are computed before ``end_s``, a value of `time.monotonic` [s]."""
    computing = iter(parts)
    while True:
        try:
            with time_limit(end_s):
                check_time()
                part = next(computing)
        except (StopIteration, TimeoutError):
            return
        yield part


def next_slice(steps_left: int, size: int) -> int:
    """Check the time limit; return the number of steps until the next check, when Python also sees Ctrl-C."""
    check_time()
    return min(steps_left, size if _END_S.get() < math.inf else WITHOUT_LIMIT * size)


class Accuracy(StrEnum):
    """Accuracy level: largest allowed error of the state after some seconds of periodic impacts.

    Errors are in units of 100 um and 0.1 m/s, measured against an independent solution (docs/accuracy.md).
    """

    QUICK = "quick"
    """Error 1e-5: enough for chaotic motion, whose results a stricter level does not improve."""
    STANDARD = "standard"
    """Error 1e-6: between the two other levels."""
    REFERENCE = "reference"
    """Error 1e-9: reference with which the two other levels are checked."""

    @property
    def tolerance(self) -> float:
        """Relative tolerance of one time step in contact; smaller than `promise` because errors add up."""
        return _TOLERANCES[self]

    @property
    def promise(self) -> float:
        """Largest error of the state of a periodic motion, in the units of the class docstring."""
        return _PROMISES[self]


AccuracyWord = Literal["quick", "standard", "reference"]
_TOLERANCES = {Accuracy.QUICK: 3e-6, Accuracy.STANDARD: 3e-7, Accuracy.REFERENCE: 1e-10}
_PROMISES = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-9}

_TEXTS = (
    "reached the end time",
    "more impacts than allowed: raise max_impact_rate_hz, shorten the run, or look for chatter",
    "the motion overflows or loses all its digits: lower the drive, or check the specimen's numbers",
    "a contact made no progress: start less deep in a stop, request less accuracy, or check the specimen",
    "more steps than allowed: a mode is very fast; check masses and stiffnesses, or simulate less time",
)


class Outcome(IntEnum):
    """Outcome of a run, with the codes of the engine."""

    REACHED_END = 0
    TOO_MANY_IMPACTS = 1
    NOT_FINITE = 2
    STALLED = 3
    TOO_LONG = 4

    @property
    def text(self) -> str:
        """Description of the outcome and advice for the user."""
        return _TEXTS[self]


def outcome_of(code: int, refused: str) -> Outcome:
    """Return the outcome of a code of the engine; raise ValueError if the engine refused ``refused``."""
    if code < 0:
        raise ValueError(f"The native engine refuses {refused}.")
    return Outcome(code)


class Watch(IntEnum):
    """Quantities of the motion that a run observes."""

    NOTHING = 0
    PEAKS = 1
    """Largest absolute displacements abs(x) and abs(p)."""
    PEAKS_AND_LINES = 2
    """Largest abs(x) and abs(p), and the components of x and p at the drive frequency."""


class RunRecord:
    """Record of a run's impacts, samples and observations; recording does not affect the time steps."""

    def __init__(
        self,
        most_impacts: int,
        *,
        start_s: float = 0.0,
        sample_rate_hz: float = 1.0,
        samples: int = 0,
        steps: int | None = None,
        engine: Engine | None = None,
    ) -> None:
        """Allocate memory for impacts, and for samples at ``start_s`` + k / ``sample_rate_hz``."""
        # Do not initialise the arrays: this takes as long as a short run, and only filled entries are read.
        self._samples = np.empty((samples, DIRECTIONS))
        self._times = np.empty(most_impacts)
        self.structure = record = (native_engine() if engine is None else engine).new("Record")
        """The `Record` of native/structures.hpp that the engine fills."""
        record["start"], record["sample_rate"] = start_s, sample_rate_hz
        record["samples"], record["sample_room"] = self._samples.ctypes.data, samples
        record["impact_times"], record["impact_room"] = self._times.ctypes.data, most_impacts
        record["steps_left"] = MOST_STEPS if steps is None else steps

    def watch(self, what: Watch) -> None:
        """Set the quantities of the motion to observe from now on."""
        self.structure["watch"] = what

    @property
    def impacts(self) -> int:
        """Number of contacts that began in the run so far."""
        return int(self.structure["impacts"])

    @property
    def impact_times_s(self) -> Floats:
        """Times at which contacts begin, shape (impacts,) [s]."""
        return self._times[: self.impacts]

    @property
    def samples(self) -> Floats:
        """Samples of x, y, z, vx, vy, vz so far, shape (n, 6)."""
        return self._samples[: int(self.structure["samples_kept"])]

    def all_samples(self, last: ArrayLike) -> Floats:
        """Return all samples, shape (n, 6); ``last`` replaces samples that rounding puts past the end."""
        self._samples[int(self.structure["samples_kept"]) :] = last
        return self._samples

    @property
    def steps_left(self) -> int:
        """Number of time steps that the run may still take."""
        return max(0, int(self.structure["steps_left"]))

    @property
    def peak_x_m(self) -> float:
        """Largest observed absolute displacement of m0, abs(x) [m]."""
        return float(self.structure["peak_x"])

    @property
    def peak_p_m(self) -> float:
        """Largest observed absolute displacement of m1 against m2, abs(p) [m]."""
        return float(self.structure["peak_p"])

    @property
    def area_x(self) -> complex:
        """Integral of x exp(-i (omega t + phase)) while spectral lines were observed [m s]."""
        return complex(self.structure["line_x"])

    @property
    def area_p(self) -> complex:
        """Integral of p exp(-i (omega t + phase)) while spectral lines were observed [m s]."""
        return complex(self.structure["line_p"])


class _Run:
    _state: Structure

    @property
    def motion(self) -> Floats:
        """Current state x, y, z, vx, vy, vz, shape (6,) [m, m/s]."""
        return np.array(self._state["motion"])

    @property
    def time_s(self) -> float:
        """Current time of the motion [s]."""
        return float(self._state["clock_high"])


class NativeRun(_Run):
    """Motion under a harmonic drive, with the current state and tangent vectors."""

    def __init__(
        self,
        specimen: Specimen,
        drive: Harmonic,
        initial_state: ArrayLike,
        tolerance: float,
        *,
        start_time_s: float = 0.0,
        engine: Engine | None = None,
    ) -> None:
        """Start from x, y, z, vx, vy, vz in the inertial frame, shape (6,) [m, m/s].

        Raises ValueError when the engine rejects the specimen, the drive or the start.
        """
        self.engine = engine = native_engine() if engine is None else engine
        self.specimen = specimen
        self._tables = engine.prepare(scene_of(engine, specimen, drive))
        self._tangent = engine.new("Tangent")
        self._state = engine.new("State")
        self._state["clock_high"] = start_time_s
        self.tolerance = tolerance
        """Relative tolerance of a time step in contact."""
        self.place(initial_state)

    def place(self, motion: ArrayLike) -> None:
        """Set x, y, z, vx, vy, vz, shape (6,), and determine whether m1 is in contact.

        Raises ValueError when the motion is inside a rigid stop.
        """
        start_at(self.engine, self._tables, self.specimen, self._state, motion, self.tolerance)

    def copy(self, tolerance: float | None = None) -> Self:
        """Return an independent copy of the run; with a new `tolerance`, the copy has no tangent vectors."""
        twin = object.__new__(type(self))  # this is faster than copy.copy
        twin.__dict__.update(self.__dict__, _state=self._state.copy(), _tangent=self._tangent.copy())
        if tolerance is not None:
            twin.tolerance = tolerance
            twin.carry(np.empty((0, DIRECTIONS)))
        return twin

    def carry(self, changes: Floats) -> None:
        """Propagate tangent vectors of shape (n, 6) from now on; n = 0 ends the propagation."""
        self._tangent["changes"] = len(changes)
        self._tangent["rows"][: len(changes)] = changes
        self._tangent["growth"] = 0.0

    @property
    def changes(self) -> Floats:
        """Tangent vectors divided by exp(`growth`), shape (n, 6)."""
        return np.array(self._tangent["rows"][: int(self._tangent["changes"])])

    @property
    def growth(self) -> Floats:
        """Natural logarithm of the factor by which each tangent vector was divided, shape (n,)."""
        return np.array(self._tangent["growth"][: int(self._tangent["changes"])])

    def advance(self, until_s: float, record: RunRecord) -> Outcome:
        """Advance to a time [s] and return the outcome; do nothing if the time has already passed.

        Raises ValueError when the engine rejects the time.
        """
        tangent = self._tangent if self._tangent["changes"] > 0 else None
        left = int(record.structure["steps_left"])
        while True:
            record.structure["steps_left"] = allowed = next_slice(left, SLICE_STEPS)
            code = self.engine.run(
                self._tables, self._state, until_s, self.tolerance, record.structure, tangent
            )
            left -= allowed - int(record.structure["steps_left"])
            if code != Outcome.TOO_LONG or left <= 0:
                break
        record.structure["steps_left"] = max(left, 0)
        return outcome_of(code, f"to advance to {until_s} s: the end time must be finite")

    def advance_with_jacobian(self, until_s: float, record: RunRecord) -> tuple[Floats, Floats]:
        """Advance to a time [s]; return the state, (6,), and d(state) / d(state now), (6, 6); NaN on failure.

        At a grazing impact on a rigid stop, where no derivative exists, very large numbers are returned.
        """
        self.carry(np.eye(DIRECTIONS))
        if self.advance(until_s, record) is not Outcome.REACHED_END:
            return np.full(DIRECTIONS, np.nan), np.full((DIRECTIONS, DIRECTIONS), np.nan)
        return self.motion, (np.exp(self.growth)[:, None] * self.changes).T

    def read(self, readings: "GrowthReadings", last: int, record: RunRecord) -> Outcome:
        """Advance to the end of interval ``last``; add the growth of tangent vectors to ``readings``."""
        code = self.engine.take_readings(
            *(self._tables, self._state, self.tolerance, record.structure),
            *(self._tangent, readings.structure, last),
        )
        return outcome_of(code, "exponents of a mode this fast or slow: check masses and stiffnesses")

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Memory addresses of tables, state and tangent vector (0 without one); valid as long as the run."""
        tangent = self._tangent.ctypes.data if self._tangent["changes"] > 0 else 0
        return self._tables.ctypes.data, self._state.ctypes.data, tangent

    def pass_over(self, length_s: float) -> None:
        """Skip a period [s] after which the motion repeats: increase the time and keep the state."""
        clock = float(self._state["clock_high"]), float(self._state["clock_low"]), length_s
        self._state["clock_high"] = high = math.fsum(clock)
        self._state["clock_low"] = math.fsum((*clock, -high))

    @property
    def is_in_flight(self) -> bool:
        """Whether m1 touches no stop."""
        return bool(self._state["side"] == 0.0)

    @property
    def reach_m(self) -> float:
        """Bound on abs(p) for all later times if no contact follows [m]; infinite in contact."""
        return self.engine.reach(self._tables, self._state)


class GrowthReadings:
    """Growth of tangent vectors in equal time intervals; the vectors are kept orthonormal in a metric."""

    def __init__(self, changes: int, room: int, interval_s: float, parts: int, metric: Floats) -> None:
        """Allocate memory for ``room`` intervals of ``interval_s`` [s], each with ``parts`` equal parts."""
        self._growth = np.zeros((room, changes))
        self._impacts = np.zeros(room, np.int64)
        self._motions = np.zeros((room, DIRECTIONS))
        self.structure = readings = native_engine().new("Readings")
        """Structure `Readings` that the engine fills."""
        readings["interval"], readings["parts"], readings["metric"] = interval_s, parts, metric
        readings["growth"], readings["impacts"] = self._growth.ctypes.data, self._impacts.ctypes.data
        readings["motions"], readings["room"] = self._motions.ctypes.data, room

    def add(self, growth: Floats, impacts: NDArray[np.int64], motions: Floats) -> None:
        """Add intervals of one tangent vector that were integrated elsewhere, one row for each interval."""
        rows = slice(self.completed, self.completed + len(growth))
        self._growth[rows, 0], self._impacts[rows], self._motions[rows] = growth, impacts, motions
        self.structure["made"] = rows.stop

    @property
    def completed(self) -> int:
        """Number of time intervals that were completed."""
        return int(self.structure["made"])

    @property
    def growth(self) -> Floats:
        """Natural logarithm of the growth of each tangent vector in each interval, shape (n, m)."""
        return self._growth[: self.completed]

    @property
    def impacts(self) -> NDArray[np.int64]:
        """Number of impacts in each completed interval, shape (n,)."""
        return self._impacts[: self.completed]

    @property
    def motions(self) -> Floats:
        """x, y, z, vx, vy, vz at the end of each interval, shape (n, 6)."""
        return self._motions[: self.completed]


def refuse_inside_a_stop(motion: Floats, specimen: Specimen) -> None:
    """Raise ValueError for an initial state in which m1 is beyond a rigid stop."""
    if not isinstance(specimen.contact, RigidStops):
        return
    lower, upper = specimen.gaps_m
    p = float(motion[Y] - motion[Z])
    beyond = max(p - upper, -p - lower)
    if beyond > INSIDE * (min(lower, upper) + float(np.abs(motion[:3]).sum())):
        raise ValueError(
            f"A start at y - z = {p} m is not allowed: rigid stops are at {-lower} and {upper} m; "
            "start between them."
        )


def most_impacts(rate_hz: float, duration_s: float) -> int:
    """Return the number of impacts at which a run ends, from the allowed mean impact rate [1/s]."""
    return min(math.ceil(rate_hz * duration_s) + SPARE_IMPACTS, MOST_IMPACTS)


@lru_cache(maxsize=1)
def native_engine() -> Engine:
    """Return the engine for this processor, loaded and checked with a known scene.

    Raises EngineError when there is no engine, or the engine's result is wrong.
    """
    engine = Engine(library_path())
    check_known_answer(engine)
    return engine


def check_known_answer(engine: Engine) -> None:
    """Raise EngineError if the engine gives a wrong result, for example after a faulty compilation."""
    specimen, drive = gong2025(contact="hunt_crossley:0.5"), Harmonic(130.0, 20e-6)
    run = NativeRun(specimen, drive, np.zeros(6), Accuracy.STANDARD.tolerance, engine=engine)
    outcome = run.advance(KNOWN_DURATION_S, RunRecord(100, engine=engine))
    off = np.abs(run.motion - KNOWN_MOTION) / np.repeat([1e-4, 0.1], 3)
    if outcome is not Outcome.REACHED_END or not math.isfinite(off.max()) or off.max() > KNOWN_TO:
        raise EngineError(
            f"{engine.path} fails its self-test by {off.max():.1e}: rebuild the file, or report this error."
        )


def cubic_tables(engine: Engine, specimen: Specimen, interval_s: float) -> Tables:
    """Return the tables for runs over intervals of ``interval_s`` [s]; threads may share them.

    Raises ValueError when the engine rejects the interval or the specimen.
    """
    require_positive("Interval", interval_s, "s")
    scene = engine.new("CubicScene", interval=interval_s)
    fill_specimen(scene["specimen"], specimen)
    scene["fastest"] = np.max(np.abs(np.linalg.eigvals(state_matrix(specimen)[0])))
    if isinstance(specimen.contact, PowerLaw):
        fill_power(engine, scene, specimen.contact)
    return engine.prepare_cubics(scene)


def start_at(
    engine: Engine, tables: Tables, specimen: Specimen, state: Structure, motion: ArrayLike, tolerance: float
) -> None:
    """Set ``state`` to x, y, z, vx, vy, vz, shape (6,), and decide whether m1 is in contact.

    Raises ValueError when the motion is inside a rigid stop, or the tolerance is not allowed.
    """
    state["motion"] = motion
    refuse_inside_a_stop(state["motion"], specimen)
    if engine.start(tables, state, tolerance) != 0:
        raise ValueError(f"A tolerance of {tolerance} is not allowed: it must lie between 0 and 1.")


class CubicRun(_Run):
    """Motion under a piecewise cubic base displacement, advanced interval by interval."""

    def __init__(
        self,
        specimen: Specimen,
        interval_s: float,
        initial_state: ArrayLike,
        tolerance: float,
        *,
        start_time_s: float = 0.0,
    ) -> None:
        """Start from x, y, z, vx, vy, vz in the inertial frame, shape (6,) [m, m/s].

        Raises ValueError when the interval, the specimen or the start is not allowed.
        """
        self._engine = engine = native_engine()
        self._tables = cubic_tables(engine, specimen, interval_s)
        self._interval_s = interval_s
        self._tolerance = tolerance
        self._state = engine.new("State", clock_high=start_time_s)
        start_at(engine, self._tables, specimen, self._state, initial_state, tolerance)

    def advance(
        self, pieces: Floats, record: RunRecord, *, first_from_s: float = 0.0, last_to_s: float | None = None
    ) -> Outcome:
        """Advance over consecutive intervals and return the outcome.

        Parameters
        ----------
        pieces
            Coefficients c0 to c3 of the base displacement on each interval, shape (intervals, 4).
        record
            Record of the run.
        first_from_s, last_to_s
            Start of the run within the first interval, and end within the last interval [s].
        """
        drive = self._engine.new("CubicDrive", base=pieces, first_from=first_from_s)
        drive["last_to"] = self._interval_s if last_to_s is None else last_to_s
        return self._run(drive, record)

    def follow(self, pieces: Floats, record: RunRecord) -> tuple[Floats, Floats]:
        """Advance over whole intervals until all are done or the run fails.

        Return the states at the ends of completed intervals, shape (passed, 6), and the impacts per interval.
        """
        motions, impacts = np.empty((len(pieces), DIRECTIONS)), np.empty(len(pieces))
        drive = self._engine.new("CubicDrive", base=pieces, motions=motions, impacts=impacts)
        drive["last_to"] = self._interval_s
        self._run(drive, record)
        passed = int(drive["done"])
        return motions[:passed], impacts[:passed]

    def _run(self, drive: Structure, record: RunRecord) -> Outcome:
        code = self._engine.run_cubics(self._tables, self._state, drive, self._tolerance, record.structure)
        return outcome_of(code, "the run: start and end must be within its intervals")


MAX_IMPACT_RATE_HZ = 200_000.0
"""Default limit of the mean impact rate. At 50 um the paper's specimen reaches 4300 impacts per second with
Hertz contacts, and 23000 in chatter on rigid stops with restitution 0.8."""


def start_motion(initial_state: ArrayLike | None) -> Floats:
    """Return the checked initial state, shape (6,); zeros (rest) for None."""
    motion = np.zeros(6) if initial_state is None else np.asarray(initial_state, dtype=np.float64)
    if motion.shape != (6,) or not bool(np.all(np.isfinite(motion))):
        raise ValueError(
            f"Initial state {motion} is not allowed: give six finite numbers x, y, z, vx, vy, vz."
        )
    return motion
