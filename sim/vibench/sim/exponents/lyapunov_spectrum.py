"""All six Lyapunov exponents of a specimen under a harmonic drive, and Kaplan-Yorke dimension. SI units.

Six tangent vectors span all directions of the state. These vectors are propagated together and orthogonalised
repeatedly; their growth rates are the exponents in descending order (Benettin et al., Meccanica 15 (1980) 9).
The sum of the exponents is the mean rate of change of the logarithm of a volume in state space. For every
elastic law and any motion this rate must be -tr(M^-1 C), which the tests check.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..engine.run import DIRECTIONS, MAX_IMPACT_RATE_HZ, Accuracy, AccuracyWord, Outcome
from ..specimen.drive import Harmonic
from ..specimen.modes import state_matrix
from ..specimen.specimen import Floats, Specimen, state_scales
from ..specimen.stops import member
from .lyapunov import (
    RESOLVED_PER_S,
    ExponentVerdict,
    Source,
    exponents_of_cycle,
    intervals_to_skip,
    verdict_of,
)
from .tangent_run import (
    BlockedMean,
    FinalMotion,
    TangentCourse,
    TangentRun,
    block_mean,
    interval_for,
    settling,
)


@dataclass(frozen=True, eq=False)
class LyapunovSpectrum:
    """Lyapunov exponents of a run's final motion; NaN if the run did not reach its end."""

    drive: Harmonic
    accuracy: Accuracy
    exponents_per_s: Floats
    """Exponents, largest first, shape (6,) [1/s]; -inf for directions lost while m1 sticks to a stop."""
    standard_errors_per_s: Floats
    """Standard errors of the exponents, shape (6,) [1/s]; numerical errors for Floquet multipliers, zero for
    modal decay rates."""
    blocks: NDArray[np.int64]
    """Number of independent blocks from which each standard error is estimated, shape (6,)."""
    verdict: ExponentVerdict
    """Verdict on the sign of the largest exponent."""
    source: Source
    motion: FinalMotion
    since_s: float
    impacts: int
    """Number of impacts of m1 since time zero."""
    impact_rate_hz: float
    """Mean impact rate of m1 in the final motion [1/s]."""
    dimension_standard_error: float
    """Standard error of `dimension`, from the correlated errors of the exponents; 0 if it is an integer."""
    final_state: Floats
    end_time_s: float
    outcome: Outcome

    @property
    def sum_per_s(self) -> float:
        """Sum of the exponents [1/s]: mean rate of change of the logarithm of a volume."""
        return float(np.sum(self.exponents_per_s))

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension of the attractor in the stroboscopic section, 1 lower than in the flow."""
        return kaplan_yorke(self.exponents_per_s)

    def intervals_per_s(self, confidence: float = 0.95) -> Floats:
        """Return Student's confidence limits of the exponents for blocks - 1 degrees of freedom, (6, 2)."""
        reach = self._reach(confidence) * self.standard_errors_per_s
        return np.column_stack([self.exponents_per_s - reach, self.exponents_per_s + reach])

    def dimension_interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return confidence limits of the dimension (0 to 6), by Student's t for the fewest blocks."""
        reach = float(self._reach(confidence).max()) * self.dimension_standard_error
        return max(0.0, self.dimension - reach), min(float(DIRECTIONS), self.dimension + reach)

    def _reach(self, confidence: float) -> Floats:
        if not 0.0 < confidence < 1.0:
            raise ValueError(f"A confidence of {confidence} is not allowed: it must lie between 0 and 1.")
        return np.asarray(scipy.special.stdtrit(np.maximum(self.blocks - 1, 1), 0.5 + 0.5 * confidence))


def lyapunov_spectrum(
    specimen: Specimen,
    drive: Harmonic,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    duration_s: float = 25.0,
    settle_s: float = 5.0,
    initial_state: ArrayLike | None = None,
    *,
    interval_s: float | None = None,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> LyapunovSpectrum:
    """Return all Lyapunov exponents, the rates at which neighbouring motions separate or converge.

    The arguments are those of `vibench.sim.lyapunov_exponent`, with ``initial_state`` of shape (6,) [m, m/s].
    The standard errors are valid for blocks longer than the correlation time of the motion.
    """
    accuracy = member(Accuracy, accuracy)
    interval = interval_for(specimen, drive, interval_s)
    skipped = intervals_to_skip(interval, duration_s, settle_s)
    course = TangentCourse(
        specimen,
        drive,
        DIRECTIONS,
        settle_s + duration_s,
        interval,
        accuracy,
        initial_state,
        max_impact_rate_hz,
    )
    course.follow()
    run = course.result()
    length = interval.length_s
    is_whole = run.outcome is Outcome.REACHED_END
    since, found = _exponents_of_run(specimen, drive, run, skipped) if is_whole else (0, _RunExponents())
    lasting = (len(run.growth) - since) * length
    return LyapunovSpectrum(
        drive=drive,
        accuracy=accuracy,
        **found._asdict(),
        since_s=since * length,
        impacts=run.total_impacts,
        impact_rate_hz=float(run.impacts[since:].sum()) / lasting if lasting > 0.0 else 0.0,
        final_state=run.final_state,
        end_time_s=run.end_time_s,
        outcome=run.outcome,
    )


ONE_BLOCK = np.ones(DIRECTIONS, dtype=np.int64)
UNKNOWN = np.full(DIRECTIONS, math.nan)


class _RunExponents(NamedTuple):
    """Fields of `LyapunovSpectrum`; the default values describe a run that did not reach its end."""

    exponents_per_s: Floats = UNKNOWN
    standard_errors_per_s: Floats = UNKNOWN
    blocks: NDArray[np.int64] = ONE_BLOCK
    dimension_standard_error: float = math.nan
    verdict: ExponentVerdict = ExponentVerdict.UNKNOWN
    source: Source = Source.AVERAGE
    motion: FinalMotion = FinalMotion.THROUGHOUT


def _exponents_of_run(
    specimen: Specimen, drive: Harmonic, run: TangentRun, skipped: int
) -> tuple[int, _RunExponents]:
    """Return the number of intervals before the averaging, and the exponents."""
    end = settling(run, state_scales(specimen, drive))
    if end.motion is FinalMotion.QUIET:
        system, _ = state_matrix(specimen)
        rates = np.linalg.eigvals(system)
        decays = np.sort(rates.real)[::-1]
        verdict = verdict_of(float(decays[0]), float(np.finfo(np.float64).eps * np.abs(rates).max()))
        errors = np.zeros(DIRECTIONS)
        return end.since, _RunExponents(decays, errors, ONE_BLOCK, 0.0, verdict, Source.MODES, end.motion)
    # If a motion settles late, little time is left to average: use at least the second half of the run.
    since = min(max(skipped, end.since), (len(run.growth) + skipped) // 2)
    rates = run.rates[since:]
    means = [_mean(each) for each in rates.T]
    order = np.argsort([-each.mean for each in means], kind="stable")
    exponents = np.array([means[k].mean for k in order])
    errors = np.array([means[k].standard_error for k in order])
    blocks = np.array([means[k].blocks for k in order], dtype=np.int64)
    dimension_error = _dimension_error(rates[:, order], exponents)
    source, observed_s = Source.AVERAGE, len(rates) * run.interval.length_s
    if end.motion is FinalMotion.PERIODIC:
        exact, off = exponents_of_cycle(specimen, drive, run.section[-1], end.cycle * run.interval.length_s)
        # A strongly damped direction, or one lost in contact, has only a mean.
        known = off < RESOLVED_PER_S
        exponents, errors = np.where(known, exact, exponents), np.where(known, off, errors)
        blocks = np.where(known, 1, blocks)
        if known[0]:
            source, observed_s = Source.MULTIPLIERS, math.inf
    verdict = verdict_of(float(exponents[0]), float(errors[0]), observed_s)
    return since, _RunExponents(exponents, errors, blocks, dimension_error, verdict, source, end.motion)


def _mean(rates: Floats) -> BlockedMean:
    """Return the mean and standard error of local exponents; -inf for a direction lost in contact."""
    if not bool(np.all(np.isfinite(rates))):
        return BlockedMean(-math.inf, 0.0, 1, len(rates), 1.0, is_long_enough=True)
    return block_mean(rates)


def _dimension_error(rates: Floats, exponents: Floats) -> float:
    """Return the dimension's standard error, to first order in the errors of the exponents.

    D = j - S / l with S = l_1 + ... + l_j and l = l_(j+1) < 0, hence dD = -dS / l + S dl / l^2.
    """
    kept = math.floor(kaplan_yorke(exponents))
    if kept in (0, len(exponents)) or not math.isfinite(exponents[kept]):
        return 0.0
    total, next_one = float(np.sum(exponents[:kept])), float(exponents[kept])
    moved = -rates[:, :kept].sum(axis=1) / next_one + total * rates[:, kept] / next_one**2
    return block_mean(moved).standard_error


def kaplan_yorke(exponents: Floats) -> float:
    """Return the Kaplan-Yorke dimension from exponents in descending order.

    The dimension is j + (l_1 + ... + l_j) / |l_(j+1)| with the largest j whose sum is not negative, or the
    number of exponents if no sum is negative (Kaplan and Yorke, Lecture Notes in Mathematics 730 (1979) 204).
    """
    sums = np.cumsum(exponents)
    kept = int(np.count_nonzero(np.cumprod(sums >= 0.0)))
    if kept in (0, len(exponents)):
        return float(kept)
    return kept + float(sums[kept - 1] / abs(exponents[kept]))
