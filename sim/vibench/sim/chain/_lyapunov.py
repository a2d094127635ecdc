"""Largest Lyapunov exponent of a chain, from two neighbouring motions. SI units.

Two motions a small distance apart are integrated. After every interval their distance in the energy norm is
recorded. The second motion is then moved back to the small distance, along the line between them (Benettin,
Galgani and Strelcyn, Kolmogorov entropy and numerical experiments, Phys. Rev. A 14 (1976) 2338). The small
distance must be far above the integration error and far below the motion's size: use REFERENCE accuracy.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import MAX_IMPACT_RATE_HZ
from ..exponents.tangent_run import BlockedMean, block_mean
from ..specimen.accuracy import Accuracy, AccuracyWord
from ..specimen.drive import Harmonic
from ..specimen.outcome import Outcome
from ..specimen.state import Floats, Table
from ..specimen.stops import member
from ._chain import MASSES_PER_CELL, Chain
from ._integrate import ChainRun, check_work, integrate_chain, most_chain_impacts
from ._tables import chain_tables, longest_window_s

NEARNESS = 1e-6
"""Distance to which the two motions are repeatedly reset, relative to the size of the first motion."""
SHORTEST_INTERVAL_S = 5e-3
"""Shortest time between two resets [s]; at a growth rate of 100 1/s, distances grow less than twofold."""
FEWEST_INTERVALS = 32
"""Smallest number of intervals from which the error of the mean growth rate is estimated."""


@dataclass(frozen=True, eq=False)
class ChainExponent:
    """Largest Lyapunov exponent of a chain; NaN if the run did not finish."""

    drive: Harmonic
    accuracy: Accuracy
    exponent_per_s: float
    """Mean growth rate of the distance [1/s]; negative if neighbouring motions converge."""
    standard_error_per_s: float
    blocks: BlockedMean | None
    """Mean growth rate and its error from blocks of intervals [1/s]; None if the run did not finish."""
    interval_s: float
    """Length of an interval between two resets, a whole number of drive periods [s]."""
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
    interval_s = math.ceil(SHORTEST_INTERVAL_S * drive.frequency_hz) / drive.frequency_hz
    intervals = math.floor(duration_s / interval_s * (1.0 + 1e-9)) if math.isfinite(duration_s) else 0
    if intervals < FEWEST_INTERVALS:
        raise ValueError(
            f"Duration {duration_s} s is not allowed for an exponent at {drive.frequency_hz} Hz: "
            f"it must be finite and contain {FEWEST_INTERVALS} intervals of {interval_s} s."
        )
    tables = chain_tables(chain, drive, accuracy)
    # The limit of the computing work applies to the sum of both motions.
    check_work(chain, 2.0 * intervals * interval_s, longest_window_s(tables, drive))
    settled = integrate_chain(
        chain, drive, settle_s, accuracy, initial_state, max_impact_rate_hz=max_impact_rate_hz
    )
    most = most_chain_impacts(chain, max_impact_rate_hz, interval_s)

    def advance(state: Floats, start_s: float) -> tuple[Floats, int, Outcome]:
        if chain.size == 1:
            alone = integrate_chain(
                chain,
                drive,
                interval_s,
                accuracy,
                state,
                start_time_s=start_s,
                max_impact_rate_hz=max_impact_rate_hz,
            )
            return alone.final_state, alone.impacts.count, alone.outcome
        run = ChainRun(chain, drive, tables, accuracy, most_impacts=most)
        run.place(state, start_s)
        outcome = run.advance(start_s + interval_s)
        return run.motion, run.impacts, outcome

    first = settled.final_state
    second = _rescale(chain, first, first + np.random.default_rng(seed).normal(size=first.shape), drive)
    growths, impacts, outcome = [], 0, settled.outcome
    for index in range(intervals if outcome is Outcome.REACHED_END else 0):
        start_s = settle_s + index * interval_s
        before = _size(chain, second - first)
        first, struck, outcome = advance(first, start_s)
        second, _, other = advance(second, start_s)
        outcome = max(outcome, other)
        if outcome is not Outcome.REACHED_END:
            break
        growths.append(math.log(_size(chain, second - first) / before) / interval_s)
        second = _rescale(chain, first, second, drive)
        impacts += struck
    local = np.asarray(growths)
    blocks = block_mean(local) if outcome is Outcome.REACHED_END else None
    return ChainExponent(
        drive=drive,
        accuracy=accuracy,
        exponent_per_s=math.nan if blocks is None else blocks.mean,
        standard_error_per_s=math.nan if blocks is None else blocks.standard_error,
        blocks=blocks,
        interval_s=interval_s,
        local_exponents_per_s=local,
        impacts=impacts,
        final_state=first,
        outcome=outcome,
    )


def _rescale(chain: Chain, first: Floats, second: Floats, drive: Harmonic) -> Floats:
    """Return the second motion, moved along the line to the first motion until they are close again."""
    apart = second - first
    # At rest the size is zero: use at least that of a displacement of all masses by the drive amplitude.
    base = np.zeros_like(first)
    base[:, :MASSES_PER_CELL] = drive.amplitude_m
    size = max(_size(chain, first), _size(chain, base))
    return first + apart * (NEARNESS * size / _size(chain, apart))


def _size(chain: Chain, state: Floats) -> float:
    """Return the energy norm of a state: the square root of twice its energy without contact [J^0.5]."""
    q, v = state[:, :MASSES_PER_CELL].ravel(), state[:, MASSES_PER_CELL:].ravel()
    stiffness: Table = chain.stiffness_matrix
    return math.sqrt(float(np.sum(chain.masses * v**2) + q @ stiffness @ q))
