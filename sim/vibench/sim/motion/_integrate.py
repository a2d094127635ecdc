"""The motion of a specimen under a drive, from a state to a later time. SI units."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Floats, Vector, clock_at
from ..model import (
    Accuracy,
    AccuracyWord,
    Drive,
    Harmonic,
    LinearSweep,
    LogarithmicSweep,
    Outcome,
    Sampled,
    Specimen,
    Sweep,
    chosen,
)
from ..slots import IMPACTS, MOST_STEPS, NEXT_SAMPLE, OBSERVATIONS_SIZE, Record
from ..stepping import advance_harmonic, advance_intervals, harmonic_tables, interval_tables, new_state
from ._base_motion import BaseMotion, sampled_motion, sweep_interval_s, sweep_motion

MAX_IMPACT_RATE_HZ = 200_000.0
"""Several times the busiest motions known of the paper's specimen: at 50 um 4300 impacts a second on Hertz's
stops, 23000 in the chatter on rigid ones of restitution 0.8; chatter of 0.95 may need more."""
MOST_IMPACTS = 1 << 26
"""In one run: the memory of their times is half a gigabyte (none until they happen)."""
LATEST_START_S = 1e8
"""Three years: the end of a run is one number, whose last digit there is 1e-8 s."""
MOST_SAMPLES = 1e9
"""48 gigabytes."""
SPARE_IMPACTS = 100
"""Allowed on top of the rate, for short runs."""
BATCH = 1 << 16
"""Intervals of a sweep that are cut at a time: bounds the memory of a long sweep."""
ROUNDING = 1e-9
"""A duration this close to a whole number of samples or intervals is taken for it."""


@dataclass(frozen=True, eq=False)
class Impacts:
    """When m1 touched a stop."""

    times_s: Floats
    """Ascending, shape (count,) [s]."""

    @property
    def count(self) -> int:
        """How many contacts began."""
        return len(self.times_s)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Where the specimen went, when it struck, and how the run ended."""

    time_s: Floats
    """Shape (n,); empty when no sample rate was asked for."""
    states: Floats
    """Shape (n, 6): x, y, z, vx, vy, vz [m, m/s], absolute."""
    final_state: Floats
    """Shape (6,), at ``end_time_s``."""
    end_time_s: float
    impacts: Impacts
    outcome: Outcome
    """Look here first: only REACHED_END reached the time that was asked for."""
    accuracy: Accuracy


def integrate(
    specimen: Specimen,
    drive: Drive,
    duration_s: float,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    initial_state: ArrayLike | None = None,
    sample_rate_hz: float | None = None,
    *,
    start_time_s: float = 0.0,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> Trajectory:
    """Follow a specimen under a drive.

    Flight is exact (harmonic drives in closed form, others as cubics on intervals), contacts are proved
    or excluded by bounds and resolved with the tolerance of ``accuracy``. Sampling changes no step, so
    the motion is the same with any sample rate.

    Parameters
    ----------
    specimen, drive
        What moves, and what moves it.
    duration_s
        [s]; within the drive, if that is a sweep or samples.
    accuracy
        Relative error allowed in a step of a contact.
    initial_state
        x, y, z, vx, vy, vz, absolute [m, m/s], shape (6,); at rest when None. May be in contact.
    sample_rate_hz
        Samples at start_time_s + k / sample_rate_hz up to the end; None keeps none.
    start_time_s
        Time on the drive's clock at which the run begins: to go on from an earlier final state.
    max_impact_rate_hz
        A run that strikes more often than this on average ends with TOO_MANY_IMPACTS.

    Raises
    ------
    ValueError
        When an argument is not allowed, or the drive is over before the run is.

    """
    accuracy = chosen(Accuracy, accuracy)
    check_times(duration_s, start_time_s, sample_rate_hz)
    state = new_state(specimen, start_motion(initial_state), accuracy)
    clock = clock_at(float(start_time_s))
    end = float(start_time_s + duration_s)
    record = new_record(start_time_s, duration_s, sample_rate_hz, max_impact_rate_hz)
    match drive:
        case Harmonic():
            code = advance_harmonic(
                state, clock, end, harmonic_tables(specimen, drive), accuracy.tolerance, record
            )
        case Sampled():
            check_within(drive.duration_s, end)
            code = _run_motion(state, clock, end, sampled_motion(drive), specimen, accuracy, record)
        case LinearSweep() | LogarithmicSweep():
            check_within(drive.duration_s, end)
            code = _run_sweep(state, clock, end, drive, specimen, accuracy, record)
    return _trajectory(state, clock, end, record, Outcome(code), accuracy)


def _run_motion(
    state: Vector,
    clock: Vector,
    end: float,
    motion: BaseMotion,
    specimen: Specimen,
    accuracy: Accuracy,
    record: Record,
) -> int:
    """Advance over intervals that are all cut already."""
    tables = interval_tables(specimen, motion.interval, accuracy)
    first, first_from = _place(float(clock[0]), motion.interval, len(motion.pieces))
    last, last_to = _place_end(end, motion.interval, len(motion.pieces))
    return advance_intervals(
        state, clock, motion.pieces[first : last + 1], first_from, last_to, tables, record
    )


def _run_sweep(
    state: Vector,
    clock: Vector,
    end: float,
    drive: Sweep,
    specimen: Specimen,
    accuracy: Accuracy,
    record: Record,
) -> int:
    """Advance over a sweep, a batch of intervals at a time."""
    interval = sweep_interval_s(drive, accuracy)
    tables = interval_tables(specimen, interval, accuracy)
    intervals = round(drive.duration_s / interval)
    first, first_from = _place(float(clock[0]), interval, intervals)
    last, last_to = _place_end(end, interval, intervals)
    for begin in range(first, last + 1, BATCH):
        stop = min(begin + BATCH, last + 1)
        code = advance_intervals(
            state,
            clock,
            sweep_motion(drive, interval, begin, stop - begin).pieces,
            first_from if begin == first else 0.0,
            last_to if stop == last + 1 else interval,
            tables,
            record,
        )
        if code != Outcome.REACHED_END:
            return code
    return int(Outcome.REACHED_END)


def _place(time_s: float, interval_s: float, intervals: int) -> tuple[int, float]:
    """Find the interval that begins at or holds an instant, and how far into it that is."""
    position = time_s / interval_s
    nearest = round(position)
    if abs(position - nearest) < ROUNDING * max(1.0, position) and nearest < intervals:
        return nearest, 0.0
    index = min(int(position), intervals - 1)
    return index, time_s - index * interval_s


def _place_end(time_s: float, interval_s: float, intervals: int) -> tuple[int, float]:
    """Find the interval that ends at or holds an instant, and how far into it that is."""
    position = time_s / interval_s
    nearest = round(position)
    if abs(position - nearest) < ROUNDING * max(1.0, position) and 0 < nearest <= intervals:
        return nearest - 1, interval_s
    index = min(int(position), intervals - 1)
    return index, time_s - index * interval_s


def start_motion(initial_state: ArrayLike | None) -> Vector:
    """Check where a run starts; at rest when None."""
    motion = np.zeros(6) if initial_state is None else np.asarray(initial_state, dtype=np.float64)
    if motion.shape != (6,) or not bool(np.all(np.isfinite(motion))):
        msg = f"Initial state {motion} is not allowed: give six finite numbers x, y, z, vx, vy, vz."
        raise ValueError(msg)
    return motion


def new_record(
    start_s: float, duration_s: float, sample_rate_hz: float | None, impact_rate_hz: float
) -> Record:
    """Make what a run fills: room for its samples and for the impacts that are allowed."""
    check_impact_rate(impact_rate_hz)
    count = 0 if sample_rate_hz is None else math.floor(duration_s * sample_rate_hz * (1.0 + ROUNDING)) + 1
    return Record(
        start=float(start_s),
        sample_rate=1.0 if sample_rate_hz is None else float(sample_rate_hz),
        samples=np.zeros((count, 6)),
        impact_times=np.zeros(min(math.ceil(impact_rate_hz * duration_s) + SPARE_IMPACTS, MOST_IMPACTS)),
        counts=np.array([0, 0, MOST_STEPS]),
        observations=np.zeros(OBSERVATIONS_SIZE),
        tangent=None,
    )


def _trajectory(
    state: Vector, clock: Vector, end: float, record: Record, outcome: Outcome, accuracy: Accuracy
) -> Trajectory:
    motion = state[:6].copy()
    reached = end if outcome is Outcome.REACHED_END else float(clock[0])
    kept = int(record.counts[NEXT_SAMPLE])
    if outcome is Outcome.REACHED_END and kept < len(record.samples):
        # A sample that rounding puts at, or a hair beyond, the very end.
        record.samples[kept:] = motion
        kept = len(record.samples)
    return Trajectory(
        time_s=record.start + np.arange(kept) / record.sample_rate,
        states=record.samples[:kept],
        final_state=motion,
        end_time_s=reached,
        impacts=Impacts(record.impact_times[: record.counts[IMPACTS]].copy()),
        outcome=outcome,
        accuracy=accuracy,
    )


def check_impact_rate(max_impact_rate_hz: float) -> None:
    """Refuse a number of impacts that no run can be held to."""
    if not 0.0 <= max_impact_rate_hz < math.inf:
        msg = f"Impact rate {max_impact_rate_hz} Hz is not allowed: it must be zero or more, and finite."
        raise ValueError(msg)


def check_times(duration_s: float, start_time_s: float, sample_rate_hz: float | None) -> None:
    """Refuse times and rates that no run can have."""
    if not 0.0 <= duration_s < math.inf:
        msg = f"Duration {duration_s} s is not allowed: it must be zero or positive, and finite."
        raise ValueError(msg)
    if not 0.0 <= start_time_s <= LATEST_START_S:
        msg = f"Start time {start_time_s} s is not allowed: it must lie between 0 and {LATEST_START_S:g} s."
        raise ValueError(msg)
    if sample_rate_hz is not None and not 0.0 < sample_rate_hz < math.inf:
        msg = f"Sample rate {sample_rate_hz} Hz is not allowed: it must be positive and finite, or None."
        raise ValueError(msg)
    if sample_rate_hz is not None and duration_s * sample_rate_hz > MOST_SAMPLES:
        msg = (
            f"{duration_s * sample_rate_hz:.3g} samples are not allowed: {MOST_SAMPLES:.1g} at most; "
            "lower the sample rate or cut the run."
        )
        raise ValueError(msg)


def check_within(available_s: float, end_s: float) -> None:
    """Refuse a run that outlasts its drive."""
    if end_s > available_s * (1.0 + ROUNDING):
        msg = f"The run ends at {end_s} s, the drive at {available_s} s: shorten the run or extend the drive."
        raise ValueError(msg)
