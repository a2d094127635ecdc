"""The largest Lyapunov exponent of a specimen under a harmonic drive, with its error. SI units.

One small variation of the motion is propagated exactly through flight and contacts; its mean growth rate
is the exponent. The method depends on the final motion: modes if no impact will follow, multipliers if the
motion has become periodic, else a mean with a standard error that allows for correlation between
neighbouring intervals. Transient chaos is reported separately.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import MAX_IMPACT_RATE_HZ
from ..motion.poincare import flow_derivative
from ..specimen.accuracy import Accuracy, AccuracyWord
from ..specimen.drive import Harmonic
from ..specimen.modes import modal_form
from ..specimen.outcome import Outcome
from ..specimen.specimen import Specimen, state_scales
from ..specimen.state import Floats
from ..specimen.stops import chosen
from .tangent_run import (
    ALIGNING,
    ALMOST,
    SURE,
    BlockedMean,
    FinalMotion,
    Interval,
    Settling,
    TangentRun,
    block_mean,
    interval_for,
    run_with_tangent,
    settling,
)

FEWEST_INTERVALS = 32
"""Fewest intervals in the duration for estimating the error of the mean."""


class ExponentVerdict(StrEnum):
    """Meaning of the exponent within its error."""

    CHAOTIC = "chaotic: neighbouring motions part"
    REGULAR = "regular: neighbouring motions come together"
    NEUTRAL = "zero within its error: quasi-periodic, or too short a run to tell"
    UNKNOWN = "unknown: the run was lost, or its blocks are shorter than its memory"


class Source(StrEnum):
    """How an exponent was found."""

    AVERAGE = "mean growth over the run"
    MULTIPLIERS = "multipliers of the periodic motion at the end"
    MODES = "decay of the free modes: no impact will follow"


@dataclass(frozen=True)
class ChaoticTransient:
    """Transient chaos."""

    exponent_per_s: float
    """Exponent during the transient."""
    standard_error_per_s: float
    until_s: float
    impacts: int


@dataclass(frozen=True)
class Precision:
    """Required error of an exponent."""

    absolute_per_s: float
    """Standard error [1/s]."""
    relative: float = 0.0
    """Standard error over exponent; the larger limit counts."""

    def __post_init__(self) -> None:
        if not (self.absolute_per_s >= 0.0 and self.relative >= 0.0):
            raise ValueError(f"Precision {self} is not allowed: zero or positive numbers.")

    def is_reached_by(self, exponents: Floats) -> bool:
        """Return whether the mean of local exponents, shape (n,), is known to this precision."""
        if len(exponents) < FEWEST_INTERVALS:
            return False
        found = block_mean(exponents)
        allowed = max(self.absolute_per_s, self.relative * abs(found.mean))
        return found.is_long_enough and found.standard_error <= allowed


@dataclass(frozen=True, eq=False)
class LyapunovEstimate:
    """The largest exponent of the motion in which a run ended. NaN where the run did not reach its end."""

    drive: Harmonic
    accuracy: Accuracy
    exponent_per_s: float
    standard_error_per_s: float
    """From blocks for a mean, half the difference of two cycles for multipliers, zero for modes."""
    verdict: ExponentVerdict
    source: Source
    motion: FinalMotion
    """Final motion of the run."""
    since_s: float
    """Start of the average, or of the final motion."""
    blocks: BlockedMean | None
    """Mean and error from blocks [1/s]; None unless the source is the average."""
    interval_s: float
    """Time between readings."""
    local_time_s: Floats
    """Ends of the intervals, shape (n,)."""
    local_exponents_per_s: Floats
    """Growth rate in each interval from time zero, shape (n,)."""
    transient: ChaoticTransient | None
    impacts: int
    """Number of impacts since time zero."""
    impact_rate_hz: float
    """Mean impact rate in the final motion."""
    final_state: Floats
    """x, y, z, vx, vy, vz at the end, shape (6,)."""
    end_time_s: float
    outcome: Outcome


def lyapunov_exponent(
    specimen: Specimen,
    drive: Harmonic,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    duration_s: float = 25.0,
    settle_s: float = 5.0,
    initial_state: ArrayLike | None = None,
    *,
    interval_s: float | None = None,
    precision: Precision | None = None,
    max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
) -> LyapunovEstimate:
    """Return the largest Lyapunov exponent: how fast neighbouring motions separate.

    The first ``settle_s`` only find the attractor; the exponent is that of the following ``duration_s``, or
    of the motion in which they end. Together the defaults are the paper's 30 s from rest. Raises ValueError
    when an argument is not allowed, or the duration holds fewer than 32 intervals.

    Parameters
    ----------
    specimen, drive
        Specimen with any contact law, and its drive.
    accuracy
        Accuracy of the motion. In chaos an exponent is the same at every level, within its error.
    duration_s, settle_s
        [s].
    initial_state
        x, y, z, vx, vy, vz, shape (6,); at rest when None. The state reached may depend on it.
    interval_s
        Approximate time between readings; two cycles of the slowest mode when None.
    precision
        End the run as soon as the error is this small. None uses the whole duration, so that
        chaos that ends late is found.
    max_impact_rate_hz
        As in `vibench.sim.motion.integrate`.
    """
    accuracy = chosen(Accuracy, accuracy)
    interval = interval_for(specimen, drive, interval_s)
    skipped = intervals_to_skip(interval, duration_s, settle_s)

    def enough(growth: Floats) -> bool:
        settled = growth[skipped:, 0] / interval.length_s
        return precision is not None and precision.is_reached_by(settled)

    run = run_with_tangent(
        specimen,
        drive,
        1,
        settle_s + duration_s,
        interval,
        accuracy,
        initial_state,
        max_impact_rate_hz,
        None if precision is None else enough,
    )
    if run.outcome is not Outcome.REACHED_END:
        return _estimate(drive, accuracy, run, Settling(FinalMotion.THROUGHOUT, 0), _LOST)
    end = settling(run, state_scales(specimen, drive))
    return _estimate(drive, accuracy, run, end, _exponent(specimen, drive, run, end, skipped))


def intervals_to_skip(interval: Interval, duration_s: float, settle_s: float) -> int:
    """Return the number of settling intervals; refuse times that leave too few intervals for a mean."""
    if not 0.0 < duration_s < math.inf or not 0.0 <= settle_s < math.inf:
        raise ValueError(
            f"Duration {duration_s} s after settling for {settle_s} s is not allowed: positive, and finite."
        )
    skipped = max(ALIGNING, math.ceil(settle_s / interval.length_s - ALMOST))
    left = interval.count_in(settle_s + duration_s) - skipped
    if left < FEWEST_INTERVALS:
        raise ValueError(
            f"Duration {duration_s} s holds {max(left, 0)} intervals of {interval.length_s} s: "
            f"ask for {FEWEST_INTERVALS} or more, by a longer duration or a shorter interval."
        )
    return skipped


@dataclass(frozen=True)
class _Exponent:
    """An exponent and its source."""

    mean: float
    error: float
    source: Source
    since: int
    """Interval in which the averaged part begins."""
    blocks: BlockedMean | None = None


_LOST = _Exponent(math.nan, math.nan, Source.AVERAGE, 0)


def _exponent(specimen: Specimen, drive: Harmonic, run: TangentRun, end: Settling, skipped: int) -> _Exponent:
    """Find the exponent from modes, multipliers or an average, whichever suits the final motion."""
    match end.motion:
        case FinalMotion.QUIET:
            slowest = float(np.max(modal_form(specimen).rates.real))
            return _Exponent(slowest, 0.0, Source.MODES, end.since)
        case FinalMotion.PERIODIC:
            mean, error = _from_multipliers(specimen, drive, run, end.cycle)
            return _Exponent(mean, error, Source.MULTIPLIERS, end.since)
        case FinalMotion.SETTLED | FinalMotion.THROUGHOUT:
            since = max(skipped, end.since)
            blocks = block_mean(run.rates[since:, 0])
            return _Exponent(blocks.mean, blocks.standard_error, Source.AVERAGE, since, blocks)


def _from_multipliers(
    specimen: Specimen, drive: Harmonic, run: TangentRun, cycle: int
) -> tuple[float, float]:
    """Return the largest exponent of a periodic motion over two cycles, and half their difference [1/s]."""
    from ..periodic.floquet import multipliers  # noqa: PLC0415 - it imports scipy; few scenes ask for an exponent

    length, state, found = cycle * run.interval.length_s, run.section[-1], []
    for _ in range(2):
        state, derivative = flow_derivative(specimen, drive, state, length)
        found.append(math.log(float(np.abs(multipliers(derivative)[0]))) / length)
    return 0.5 * (found[0] + found[1]), 0.5 * abs(found[0] - found[1])


def _estimate(
    drive: Harmonic, accuracy: Accuracy, run: TangentRun, end: Settling, taken: _Exponent
) -> LyapunovEstimate:
    length = run.interval.length_s
    since = max(taken.since, end.since)
    lasting = (len(run.growth) - since) * length
    return LyapunovEstimate(
        drive=drive,
        accuracy=accuracy,
        exponent_per_s=taken.mean,
        standard_error_per_s=taken.error,
        verdict=_verdict(taken),
        source=taken.source,
        motion=end.motion,
        since_s=since * length,
        blocks=taken.blocks,
        interval_s=length,
        local_time_s=length * np.arange(1.0, len(run.growth) + 1.0),
        local_exponents_per_s=run.rates[:, 0],
        transient=_transient(run, end),
        impacts=len(run.impact_times_s),
        impact_rate_hz=float(run.impacts[since:].sum()) / lasting if lasting > 0.0 else 0.0,
        final_state=run.final_state,
        end_time_s=run.end_time_s,
        outcome=run.outcome,
    )


def verdict_of(mean: float, error: float) -> ExponentVerdict:
    """Return the verdict on an exponent with its error."""
    if not (math.isfinite(mean) and math.isfinite(error)):
        return ExponentVerdict.UNKNOWN
    if abs(mean) <= SURE * error:
        return ExponentVerdict.NEUTRAL
    return ExponentVerdict.CHAOTIC if mean > 0.0 else ExponentVerdict.REGULAR


def _verdict(taken: _Exponent) -> ExponentVerdict:
    if taken.blocks is not None and not taken.blocks.is_long_enough:
        return ExponentVerdict.UNKNOWN
    return verdict_of(taken.mean, taken.error)


def _transient(run: TangentRun, end: Settling) -> ChaoticTransient | None:
    """Return the chaotic transient before the final motion; None without one."""
    before = run.rates[ALIGNING : end.since, 0]
    if len(before) < FEWEST_INTERVALS:
        return None
    mean = block_mean(before)
    if not mean.mean > SURE * mean.standard_error:
        return None
    return ChaoticTransient(
        exponent_per_s=mean.mean,
        standard_error_per_s=mean.standard_error,
        until_s=end.since * run.interval.length_s,
        impacts=int(run.impacts[: end.since].sum()),
    )
