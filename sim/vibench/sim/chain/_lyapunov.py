"""Largest Lyapunov exponent of a chain, from two neighbouring motions. SI units.

Two motions a small distance apart are integrated. After every interval, their distance in the energy norm is
recorded. The second motion is then moved back to the small distance, along the line between them (Benettin,
Galgani and Strelcyn, Kolmogorov entropy and numerical experiments, Phys. Rev. A 14 (1976) 2338). The small
distance must be far above the integration error and far below the motion's size: use REFERENCE accuracy.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import MAX_IMPACT_RATE_HZ, Accuracy, AccuracyWord, Outcome
from ..exponents.tangent_run import FEWEST_INTERVALS, BlockedMean, block_mean
from ..specimen.drive import Harmonic
from ..specimen.specimen import Floats
from ..specimen.stops import member
from ._chain import MASSES_PER_CELL, Chain
from ._integrate import check_work, integrate_chain
from ._tables import chain_tables, longest_window_s

NEARNESS = 1e-6
"""Distance to which the two motions are repeatedly reset, relative to the size of the first motion."""
MOST_INTERVALS = 1_000_000
"""Largest number of intervals, which takes about half an hour. An interval is a period of the chain's fastest
mode: in longer intervals, the distance may shrink to a rounding error or grow to the size of the motion."""
ALIGNING = 0.25
"""Time before the averaging, relative to the averaging time, in which the line between the two motions turns
to the direction of fastest growth."""


@dataclass(frozen=True, eq=False)
class ChainExponent:
    """Largest Lyapunov exponent of a chain; NaN if the run did not finish."""

    drive: Harmonic
    accuracy: Accuracy
    exponent_per_s: float
    """Mean growth rate of the distance [1/s]; negative if neighbouring motions converge."""
    standard_error_per_s: float
    blocks: BlockedMean | None
    """Mean growth rate and error from blocks of intervals [1/s]; None if the run did not finish."""
    interval_s: float
    """Length of an interval between two resets, a period of the chain's fastest mode [s]."""
    local_exponents_per_s: Floats
    """Growth rate of the distance in each interval after settling, shape (n,) [1/s]."""
    impacts: int
    """Number of impacts of all cells in the intervals after settling."""
    final_state: Floats
    """x, y, z, vx, vy, vz of every cell at the end of the run, shape (cells, 6) [m, m/s]."""
    outcome: Outcome


def chain_lyapunov_exponent(
    chain: Chain,
    drive: Harmonic,
    accuracy: Accuracy | AccuracyWord = Accuracy.REFERENCE,
    duration_s: float = 5.0,
    settle_s: float = 2.0,
    initial_state: ArrayLike | None = None,
    *,
    seed: int = 0,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> ChainExponent:
    """Return the largest Lyapunov exponent of a chain.

    Raises ValueError when an argument is not allowed, the run would take hours, or the duration contains too
    few intervals for an error estimate.

    Parameters
    ----------
    chain, drive, accuracy, initial_state, max_impact_rate_hz
        As in `vibench.sim.chain.integrate_chain`.
    duration_s, settle_s
        Averaging time of the exponent [s], and preceding time in which the motion settles [s].
    seed
        Seed of the initial direction from the first to the second motion.
    """
    accuracy = member(Accuracy, accuracy)
    interval_s = 1.0 / float(chain.natural_frequencies_hz[-1])
    intervals = math.floor(duration_s / interval_s * (1.0 + 1e-9)) if math.isfinite(duration_s) else 0
    if not FEWEST_INTERVALS <= intervals <= MOST_INTERVALS:
        raise ValueError(
            f"Duration {duration_s} s is not allowed for an exponent: it must contain {FEWEST_INTERVALS} to "
            f"{MOST_INTERVALS} intervals of {interval_s} s, the period of the fastest mode."
        )
    # The limit applies to the computing work for both motions together.
    window_s = longest_window_s(chain_tables(chain, drive, accuracy), drive)
    check_work(chain, 2.0 * (1.0 + ALIGNING) * duration_s, window_s)
    advance = partial(integrate_chain, chain, drive, accuracy=accuracy, max_impact_rate_hz=max_impact_rate_hz)
    settled = advance(settle_s, initial_state=initial_state)
    first = settled.final_state
    second = _rescale(chain, first, first + np.random.default_rng(seed).normal(size=first.shape), drive)
    growths, impacts, outcome = [], 0, settled.outcome
    aligning = math.ceil(ALIGNING * intervals)
    for index in range(aligning + intervals if outcome is Outcome.REACHED_END else 0):
        start_s = settle_s + index * interval_s
        before = _size(chain, second - first)
        run, other = (
            advance(interval_s, initial_state=state, start_time_s=start_s) for state in (first, second)
        )
        first, second, outcome = run.final_state, other.final_state, max(run.outcome, other.outcome)
        if outcome is not Outcome.REACHED_END:
            break
        if index >= aligning:
            growths.append(math.log(_size(chain, second - first) / before) / interval_s)
            impacts += run.impacts.count
        second = _rescale(chain, first, second, drive)
    local = np.asarray(growths)
    blocks, error = None, math.nan
    if outcome is Outcome.REACHED_END:
        blocks = block_mean(local)
        # Within a vibration period the distance goes up and down, so the mean depends on where it ends.
        error = math.hypot(blocks.standard_error, np.std(np.cumsum(local - blocks.mean)) / intervals)
    return ChainExponent(
        drive=drive,
        accuracy=accuracy,
        exponent_per_s=math.nan if blocks is None else blocks.mean,
        standard_error_per_s=error,
        blocks=blocks,
        interval_s=interval_s,
        local_exponents_per_s=local,
        impacts=impacts,
        final_state=first,
        outcome=outcome,
    )


def _rescale(chain: Chain, first: Floats, second: Floats, drive: Harmonic) -> Floats:
    """Return the second motion, moved toward the first motion until the two motions are close again."""
    apart = second - first
    # The size is zero at rest: use at least the size of a state with all masses at the drive amplitude.
    base = np.zeros_like(first)
    base[:, :MASSES_PER_CELL] = drive.amplitude_m
    size = max(_size(chain, first), _size(chain, base))
    return first + apart * (NEARNESS * size / _size(chain, apart))


def _size(chain: Chain, state: Floats) -> float:
    """Return the energy norm of a state: the square root of twice the energy without contact [J^0.5]."""
    q, v = state[:, :MASSES_PER_CELL].ravel(), state[:, MASSES_PER_CELL:].ravel()
    stiffness: Floats = chain.stiffness_matrix
    return math.sqrt(float(np.sum(chain.masses * v**2) + q @ stiffness @ q))
