"""A motion under a drive that is cut into intervals, a cubic on each: sweeps, and recorded displacements."""

import numpy as np

from ..kernels import Vector, clock_at
from ..model import Accuracy, Outcome, Sampled, Specimen, Sweep
from ..slots import IMPACTS, NEXT_SAMPLE, Record
from ..stepping import advance_intervals, interval_tables, new_state
from ._base_motion import BaseMotion, sampled_motion, sweep_interval_s, sweep_motion
from ._integrate import ROUNDING, Impacts, Trajectory, check_within

BATCH = 1 << 16
"""Intervals of a sweep that are cut at a time: bounds the memory of a long sweep."""


def integrate_cubics(
    specimen: Specimen,
    drive: Sampled | Sweep,
    start_s: float,
    end_s: float,
    accuracy: Accuracy,
    start: Vector,
    most_impacts: int,
    samples: int,
    sample_rate_hz: float,
) -> Trajectory:
    """Follow a specimen as `integrate` does, from one instant to another.

    Raises ValueError when the drive is over before the run is.
    """
    check_within(drive.duration_s, end_s)
    state = new_state(specimen, start, accuracy)
    clock = clock_at(start_s)
    record = Record(
        start=start_s,
        sample_rate=sample_rate_hz,
        samples=np.zeros((samples, 6)),
        impact_times=np.zeros(most_impacts),
        counts=np.array([0, 0]),
    )
    if isinstance(drive, Sampled):
        code = _run_motion(state, clock, end_s, sampled_motion(drive), specimen, accuracy, record)
    else:
        code = _run_sweep(state, clock, end_s, drive, specimen, accuracy, record)
    motion, outcome = state[:6].copy(), Outcome(code)
    kept = int(record.counts[NEXT_SAMPLE])
    if outcome is Outcome.REACHED_END and kept < samples:
        # A sample that rounding puts at, or a hair beyond, the very end.
        record.samples[kept:] = motion
        kept = samples
    return Trajectory(
        time_s=start_s + np.arange(kept) / sample_rate_hz,
        states=record.samples[:kept],
        final_state=motion,
        end_time_s=end_s if outcome is Outcome.REACHED_END else float(clock[0]),
        impacts=Impacts(record.impact_times[: record.counts[IMPACTS]].copy()),
        outcome=outcome,
        accuracy=accuracy,
    )


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
