"""A motion under a drive that is cut into intervals, a cubic on each: sweeps, and recorded displacements."""

from ..engine.cubic_run import CubicRun
from ..engine.run import RunRecord
from ..kernels.arrays import Table, Vector
from ..model.accuracy import Accuracy
from ..model.drive import Sampled, Sweep
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from .base_motion import sampled_motion, sweep_interval_s, sweep_motion
from .integrate import ROUNDING, check_within

BATCH = 1 << 16
"""Intervals of a sweep that are cut at a time: bounds the memory of a long sweep."""


def integrate_cubics(
    specimen: Specimen,
    drive: Sampled | Sweep,
    start_s: float,
    end_s: float,
    accuracy: Accuracy,
    start: Vector,
    record: RunRecord,
) -> tuple[CubicRun, Outcome]:
    """Follow a specimen as `integrate` does, from one instant to another.

    Raises ValueError when the drive is over before the run is.
    """
    check_within(drive.duration_s, end_s)
    if isinstance(drive, Sampled):
        base = sampled_motion(drive)
        interval = base.interval

        def cut(begin: int, stop: int) -> Table:
            return base.pieces[begin:stop]
    else:
        interval = sweep_interval_s(drive, accuracy)

        def cut(begin: int, stop: int) -> Table:
            return sweep_motion(drive, interval, begin, stop - begin).pieces

    run = CubicRun(specimen, interval, start, accuracy.tolerance, start_time_s=start_s)
    first, first_from = _place(start_s, interval)
    last, last_to = _place(end_s, interval)
    if last_to == 0.0:
        last, last_to = last - 1, interval
    outcome = Outcome.REACHED_END
    for begin in range(first, last + 1, BATCH):
        stop = min(begin + BATCH, last + 1)
        outcome = run.advance(
            cut(begin, stop),
            record,
            first_from_s=first_from if begin == first else 0.0,
            last_to_s=last_to if stop == last + 1 else interval,
        )
        if outcome is not Outcome.REACHED_END:
            break
    return run, outcome


def _place(time_s: float, interval_s: float) -> tuple[int, float]:
    """Find the interval that begins at or holds an instant, and how far into it that is."""
    position = time_s / interval_s
    nearest = round(position)
    if abs(position - nearest) < ROUNDING * max(1.0, position):
        return nearest, 0.0
    return int(position), time_s - int(position) * interval_s
