"""A run that reads, at even intervals, how much small changes of the state have grown. SI units.

Between readings the changes are carried along exactly; at a reading they are made orthogonal and of unit
length in the energy norm s' diag(K, M) s, and the logarithms of what was divided out are kept (Benettin,
Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980) 9 and 21). The energy without stops is the specimen's
natural norm: free motion can only shrink in it, so that what grows was made to grow by impacts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..engine.run import GrowthReadings, NativeRun, RunRecord, most_impacts
from ..model.accuracy import Accuracy
from ..model.arrays import Floats, Table
from ..model.drive import Harmonic
from ..model.modes import modal_form
from ..model.outcome import Outcome
from ..model.specimen import Specimen
from ..motion.integrate import MAX_IMPACT_RATE_HZ, check_impact_rate, start_motion

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
    check_impact_rate(max_impact_rate_hz)
    count = interval.count_in(duration_s)
    run = NativeRun(specimen, drive, start_motion(initial_state), accuracy.tolerance)
    metric = energy_metric(specimen)
    run.carry(starting_changes(metric, changes))
    record = RunRecord(most_impacts(max_impact_rate_hz, duration_s))
    parts = _parts(specimen, interval.length_s) if changes > 1 else 1
    readings = GrowthReadings(changes, count, interval.length_s, parts, metric)
    outcome = Outcome.REACHED_END
    stride = count if enough is None else math.ceil(count / CHECKS)
    while readings.made < count and outcome is Outcome.REACHED_END:
        outcome = run.read(readings, min(count, readings.made + stride), record)
        if enough is not None and enough(readings.growth):
            break
    return TangentRun(
        interval=interval,
        growth=readings.growth,
        impacts=readings.impacts,
        section=readings.motions,
        impact_times_s=record.impact_times_s.copy(),
        # Free phasors only shrink.
        is_quiet=run.reach_m < min(specimen.gaps_m),
        final_state=run.motion,
        end_time_s=run.time_s,
        outcome=outcome,
    )


def _parts(specimen: Specimen, interval_s: float) -> int:
    """In how many parts an interval is cut so that no change is lost among the others."""
    modes = modal_form(specimen).rates
    turns, decays = float(np.max(np.abs(modes))), float(np.max(-modes.real))
    return max(1, math.ceil(interval_s * max(turns / LONGEST_TURN, decays / LONGEST_DECAY)))


def energy_metric(specimen: Specimen) -> Table:
    """Give the matrix of twice the energy without stops, shape (6, 6)."""
    metric = np.zeros((6, 6))
    metric[:3, :3], metric[3:, 3:] = specimen.stiffness_matrix, specimen.mass_matrix
    return metric


def starting_changes(metric: Table, changes: int) -> Table:
    """Make changes in general directions, the same in every run, orthonormal in the metric."""
    size = len(metric)
    general = np.cos(np.outer(np.arange(1.0, changes + 1.0), np.arange(1.0, size + 1.0)))
    root = np.linalg.cholesky(metric)
    rows, lengths = np.linalg.qr((general / np.sqrt(np.diag(metric)) @ root).T)
    return np.linalg.solve(root.T, rows * np.sign(np.diag(lengths))).T
