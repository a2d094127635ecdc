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
from vibench.sim.engine.run import MAX_IMPACT_RATE_HZ, NativeRun, RunRecord, most_impacts, start_motion
from vibench.sim.exponents.lyapunov import intervals_to_skip
from vibench.sim.exponents.tangent_run import BlockedMean, block_mean, interval_for
from vibench.sim.specimen.specimen import energy_metric
from vibench.sim.specimen.state import Floats

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
    record = RunRecord(most_impacts(max_impact_rate_hz, 2.0 * (settle_s + duration_s)))
    first, second = (
        NativeRun(specimen, drive, motion, accuracy.tolerance) for motion in (start, start + apart)
    )
    growth = np.zeros(count)
    for k in range(count):
        for run in (first, second):
            outcome = run.advance((k + 1.0) * interval.length_s, record)
            if outcome is not Outcome.REACHED_END:
                return TwoTrajectoryExponent(math.nan, math.nan, None, growth / interval.length_s, outcome)
        here, apart = first.motion, second.motion - first.motion
        distance = math.sqrt(apart @ metric @ apart)
        growth[k] = math.log(distance / size)
        # Both begin the interval in the same manner, or the step control's memory would be a difference.
        first.place(here)
        second.place(here + apart * size / distance)
    rates = growth / interval.length_s
    mean = block_mean(rates[skipped:])
    return TwoTrajectoryExponent(mean.mean, mean.standard_error, mean, rates, Outcome.REACHED_END)
