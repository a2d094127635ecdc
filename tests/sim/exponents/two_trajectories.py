"""The largest Lyapunov exponent from two whole motions that start close together. SI units.

No linearisation and no tangent: both motions strike when they strike, and their distance, brought back to
its first size again and again, tells the growth (Benettin, Galgani and Strelcyn, Phys. Rev. A 14 (1976)
2338). Slower and less exact than `vibench.sim.exponents`, and independent of it: the check that the tangent
is right.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vibench.sim import Accuracy, Harmonic, Outcome, Specimen
from vibench.sim.exponents import BlockedMean, blocked_mean
from vibench.sim.exponents._lyapunov import intervals_to_skip
from vibench.sim.exponents._tangent_run import energy_metric, interval_for
from vibench.sim.kernels import Floats, Table, Vector, clock_at, dot, kernel
from vibench.sim.motion import MAX_IMPACT_RATE_HZ, new_record, start_motion
from vibench.sim.slots import REACHED_END, Record
from vibench.sim.stepping import (
    HarmonicTables,
    Workspace,
    advance_by_law,
    harmonic_tables,
    new_state,
    place_on_its_side,
    workspace_for,
)

DISTANCE = 1e-7
"""Of the two motions after each return, over the state's scale: far above the error of a run at reference
accuracy, far below the gap."""
HALF = 6
"""Numbers of a motion."""


@dataclass(frozen=True, eq=False)
class TwoTrajectoryExponent:
    """An exponent from two motions. NaN where a run did not reach its end."""

    exponent_per_s: float
    standard_error_per_s: float
    blocks: BlockedMean | None
    local_exponents_per_s: Floats
    """In each interval, shape (n,)."""
    outcome: Outcome


def two_trajectory_exponent(
    specimen: Specimen,
    drive: Harmonic,
    accuracy: Accuracy = Accuracy.REFERENCE,
    duration_s: float = 25.0,
    settle_s: float = 5.0,
    initial_state: ArrayLike | None = None,
    *,
    interval_s: float | None = None,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> TwoTrajectoryExponent:
    """Follow two motions a ten-millionth of the gap apart, and average how fast they part.

    Arguments as in `vibench.sim.lyapunov_exponent`. Intervals are short, a quarter of the slowest
    mode's cycle when None: in a longer one chaos may part the motions for good.
    """
    about = 0.25 / float(specimen.natural_frequencies_hz[0]) if interval_s is None else interval_s
    interval = interval_for(specimen, drive, about)
    skipped = intervals_to_skip(interval, duration_s, settle_s)
    count = interval.count_in(settle_s + duration_s)
    metric = energy_metric(specimen)
    start = start_motion(initial_state)
    size = DISTANCE * min(specimen.gaps_m) * math.sqrt(metric[0, 0])
    apart = np.cos(np.arange(1.0, HALF + 1.0)) / np.sqrt(np.diag(metric))
    apart *= size / math.sqrt(float(apart @ metric @ apart))
    first, second = (new_state(specimen, motion, accuracy) for motion in (start, start + apart))
    growth = np.zeros(count)
    record = new_record(0.0, 2.0 * (settle_s + duration_s), None, max_impact_rate_hz)
    tables = harmonic_tables(specimen, drive)
    workspace = workspace_for(len(tables.flight.rates), record.observations, None)
    code = _part(
        first, second, interval.length_s, tables, accuracy.tolerance, record, metric, size, growth, workspace
    )
    rates = growth / interval.length_s
    if code != Outcome.REACHED_END:
        return TwoTrajectoryExponent(math.nan, math.nan, None, rates, Outcome(code))
    mean = blocked_mean(rates[skipped:])
    return TwoTrajectoryExponent(mean.mean, mean.standard_error, mean, rates, Outcome(code))


@kernel
def _part(
    first: Vector,
    second: Vector,
    interval: float,
    tables: HarmonicTables,
    tolerance: float,
    record: Record,
    metric: Table,
    size: float,
    growth: Vector,
    workspace: Workspace,
) -> int:
    """Advance two motions interval by interval, each time bringing the second back to its distance."""
    here, there, apart = clock_at(0.0), clock_at(0.0), np.zeros(HALF)
    flight, par, power = tables.flight, tables.flight.par, tables.power
    laws = (power, tables.steps, tables.held, tables.collisions)
    for k in range(len(growth)):
        until = (k + 1.0) * interval
        code = advance_by_law(first, here, until, flight, tolerance, record, *laws, None, workspace)
        code = max(
            code,
            advance_by_law(second, there, until, flight, tolerance, record, *laws, None, workspace),
        )
        if code != REACHED_END:
            return code
        for i in range(HALF):
            apart[i] = second[i] - first[i]
        distance = math.sqrt(dot(apart, apart, metric))
        growth[k] = math.log(distance / size)
        for i in range(HALF):
            second[i] = first[i] + apart[i] * size / distance
        # Both begin the interval in the same manner, or the step control's memory would be a difference.
        place_on_its_side(first, par, power, par.restitution, tolerance)
        place_on_its_side(second, par, power, par.restitution, tolerance)
    return REACHED_END
