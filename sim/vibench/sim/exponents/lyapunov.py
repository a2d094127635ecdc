"""Largest Lyapunov exponent of a specimen under a harmonic drive, with its error. SI units.

A tangent vector is propagated exactly with and without contact; its mean growth rate is the exponent. The
final motion decides the method: decay of the modes if no impact will follow, Floquet multipliers if the
motion has become periodic, otherwise the mean growth. The standard error allows for correlation of successive
intervals. Chaos that ends during the run is reported separately.
"""

import math
import sys
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import DIRECTIONS, MAX_IMPACT_RATE_HZ, Accuracy, AccuracyWord, Outcome
from ..periodic.newton import newton_iterates
from ..periodic.shooting import FLOW_ERROR, flow_derivative
from ..specimen.drive import Harmonic
from ..specimen.modes import modal_form
from ..specimen.specimen import Floats, Specimen, state_scales
from ..specimen.stops import member
from .tangent_run import (
    ALIGNING,
    ALMOST,
    FEWEST_INTERVALS,
    SURE,
    BlockedMean,
    FinalMotion,
    Interval,
    Settling,
    TangentCourse,
    TangentRun,
    block_mean,
    interval_for,
    settling,
)

FARTHEST = 2.0
"""Largest ratio of standard error to allowed error that is used to predict the length of a run."""
NEWTON_STEPS = 3
"""Number of Newton steps from the end of a run to its periodic motion."""
RESOLVED_PER_S = 1e-2
"""Largest error of an exponent from Floquet multipliers [1/s]; a larger error is not reliable."""


class ExponentVerdict(StrEnum):
    """Statement about the sign of an exponent, given its standard error."""

    CHAOTIC = "chaotic: neighbouring motions part"
    REGULAR = "regular: neighbouring motions come together"
    NEUTRAL = "zero within its error: quasi-periodic, or too short a run to tell"
    UNKNOWN = "unknown: the run was lost, or its blocks are shorter than its memory"


class Source(StrEnum):
    """Method by which a Lyapunov exponent was determined."""

    AVERAGE = "mean growth over the run"
    MULTIPLIERS = "multipliers of the periodic motion at the end"
    MODES = "decay of the free modes: no impact will follow"


@dataclass(frozen=True)
class ChaoticTransient:
    """Transient chaos, which ended before the final motion of a run."""

    exponent_per_s: float
    """Largest Lyapunov exponent during the transient [1/s]."""
    standard_error_per_s: float
    until_s: float
    impacts: int


@dataclass(frozen=True)
class Precision:
    """Required precision of an exponent; the less strict of the two limits applies."""

    absolute_per_s: float
    """Largest allowed standard error of the exponent [1/s]."""
    relative: float = 0.0
    """Largest allowed standard error of the exponent, relative to the exponent."""

    def __post_init__(self) -> None:
        if not (self.absolute_per_s >= 0.0 and self.relative >= 0.0):
            raise ValueError(f"Precision {self} is not allowed: give zero or positive numbers.")

    def count_for(self, exponents: Floats) -> float:
        """Return about how many local exponents the mean needs; at most n for n that suffice, shape (n,)."""
        count = len(exponents)
        if count < FEWEST_INTERVALS:
            return FEWEST_INTERVALS
        found = block_mean(exponents)
        allowed = max(self.absolute_per_s, self.relative * abs(found.mean), sys.float_info.min)
        ratio = min(found.standard_error / allowed, FARTHEST) if found.is_long_enough else FARTHEST
        return count * ratio**2


@dataclass(frozen=True, eq=False)
class LyapunovEstimate:
    """Largest Lyapunov exponent of a run's final motion; NaN if the run did not reach its end."""

    drive: Harmonic
    accuracy: Accuracy
    exponent_per_s: float
    standard_error_per_s: float
    """Standard error [1/s]: numerical error with multipliers, zero with modes."""
    verdict: ExponentVerdict
    source: Source
    motion: FinalMotion
    """Kind of the final motion of the run."""
    since_s: float
    """Time from which growth is averaged, or at which the final motion begins [s]."""
    blocks: BlockedMean | None
    """Mean growth rate and error from blocks of intervals [1/s]; None unless the exponent is this mean."""
    interval_s: float
    """Length of the interval in which each growth rate is measured [s]."""
    local_time_s: Floats
    """End times of the intervals in which growth is measured, shape (n,) [s]."""
    local_exponents_per_s: Floats
    """Growth rate in each interval, the first of which begins at time zero, shape (n,) [1/s]."""
    transient: ChaoticTransient | None
    impacts: int
    """Number of impacts in the whole run."""
    impact_rate_hz: float
    """Mean impact rate of m1 in the final motion [1/s]."""
    final_state: Floats
    """x, y, z, vx, vy, vz at the end of the run, shape (6,) [m, m/s]."""
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
    """Return the largest Lyapunov exponent, the rate at which neighbouring motions separate.

    During ``settle_s`` the motion approaches its attractor. Growth is averaged over the following
    ``duration_s``, or only over the final motion if the kind of motion changes. The defaults add up to the
    paper's 30 s from rest. Raises ValueError when an argument is not allowed, or for fewer than 32 intervals.

    Parameters
    ----------
    specimen, drive
        Specimen with any contact law, and its drive.
    accuracy
        Accuracy of the motion. The exponent of a chaotic motion agrees at all levels within its error.
    duration_s, settle_s
        Averaging time, and the preceding settling time [s].
    initial_state
        x, y, z, vx, vy, vz, shape (6,); None for rest. The final motion may depend on it.
    interval_s
        Approximate length of an interval [s]; None for 1.73 cycles of the slowest mode.
    precision
        Required precision; the run ends when this precision is reached. None uses the whole duration, which
        also detects chaos that ends late.
    max_impact_rate_hz
        As in `vibench.sim.motion.integrate`.
    """
    exponent = ExponentRun(
        *(specimen, drive, member(Accuracy, accuracy), duration_s, settle_s, initial_state),
        *(interval_s, precision, max_impact_rate_hz),
    )
    exponent.course.follow()
    return exponent.estimate()


class ExponentRun:
    """Run that determines the largest Lyapunov exponent; the arguments are those of `lyapunov_exponent`."""

    def __init__(
        self,
        specimen: Specimen,
        drive: Harmonic,
        accuracy: Accuracy,
        duration_s: float,
        settle_s: float,
        initial_state: ArrayLike | None,
        interval_s: float | None = None,
        precision: Precision | None = None,
        max_impact_rate_hz: float = MAX_IMPACT_RATE_HZ,
    ) -> None:
        self._specimen, self._drive, self._accuracy = specimen, drive, accuracy
        interval = interval_for(specimen, drive, interval_s)
        self._skipped = skipped = intervals_to_skip(interval, duration_s, settle_s)

        def needed(growth: Floats) -> float:
            rates = growth[skipped:, 0] / interval.length_s
            return skipped + (0.0 if precision is None else precision.count_for(rates))

        self.course = TangentCourse(
            *(specimen, drive, 1, settle_s + duration_s, interval, accuracy, initial_state),
            *(max_impact_rate_hz, None if precision is None else needed),
        )
        """The motion with its tangent vector, to be integrated before `estimate`."""

    def estimate(self) -> LyapunovEstimate:
        """Return the exponent of the integrated motion."""
        specimen, drive = self._specimen, self._drive
        run = self.course.result()
        end, taken = Settling(FinalMotion.THROUGHOUT, 0), _LOST
        if run.outcome is Outcome.REACHED_END:
            end = settling(run, state_scales(specimen, drive))
            taken = _exponent(specimen, drive, run, end, self._skipped)
        length = run.interval.length_s
        since = max(taken.since, end.since)
        lasting = (len(run.growth) - since) * length
        return LyapunovEstimate(
            drive=drive,
            accuracy=self._accuracy,
            exponent_per_s=taken.mean,
            standard_error_per_s=taken.error,
            verdict=_verdict(taken, lasting),
            source=taken.source,
            motion=end.motion,
            since_s=since * length,
            blocks=taken.blocks,
            interval_s=length,
            local_time_s=length * np.arange(1.0, len(run.growth) + 1.0),
            local_exponents_per_s=run.rates[:, 0],
            transient=_transient(run, end),
            impacts=run.total_impacts,
            impact_rate_hz=float(run.impacts[since:].sum()) / lasting if lasting > 0.0 else 0.0,
            final_state=run.final_state,
            end_time_s=run.end_time_s,
            outcome=run.outcome,
        )


def intervals_to_skip(interval: Interval, duration_s: float, settle_s: float) -> int:
    """Return the number of intervals for settling; raise ValueError if too few are left for the average."""
    if not 0.0 < duration_s < math.inf or not 0.0 <= settle_s < math.inf:
        raise ValueError(
            f"Duration {duration_s} s after {settle_s} s of settling: both must be finite, the duration > 0."
        )
    skipped = max(ALIGNING, math.ceil(settle_s / interval.length_s - ALMOST))
    left = interval.count_in(settle_s + duration_s) - skipped
    if left < FEWEST_INTERVALS:
        raise ValueError(
            f"Duration {duration_s} s contains {max(left, 0)} intervals of {interval.length_s} s: request "
            f"{FEWEST_INTERVALS} intervals or more, by a longer duration or a shorter interval."
        )
    return skipped


@dataclass(frozen=True)
class _Exponent:
    """Lyapunov exponent and error [1/s], with the method that determined both."""

    mean: float
    error: float
    source: Source
    since: int
    """Index of the first interval that the average includes."""
    blocks: BlockedMean | None = None


_LOST = _Exponent(math.nan, math.nan, Source.AVERAGE, 0)


def _exponent(specimen: Specimen, drive: Harmonic, run: TangentRun, end: Settling, skipped: int) -> _Exponent:
    """Return the exponent from modes, Floquet multipliers or mean growth, depending on the final motion."""
    match end.motion:
        case FinalMotion.QUIET:
            slowest = float(np.max(modal_form(specimen).rates.real))
            return _Exponent(slowest, 0.0, Source.MODES, end.since)
        case FinalMotion.PERIODIC:
            length_s = end.cycle * run.interval.length_s
            exact, off = exponents_of_cycle(specimen, drive, run.section[-1], length_s)
            if off[0] < RESOLVED_PER_S:
                return _Exponent(float(exact[0]), float(off[0]), Source.MULTIPLIERS, end.since)
    since = max(skipped, end.since)
    blocks = block_mean(run.rates[since:, 0])
    return _Exponent(blocks.mean, blocks.standard_error, Source.AVERAGE, since, blocks)


_UNKNOWN = np.full(DIRECTIONS, math.nan)


def exponents_of_cycle(
    specimen: Specimen, drive: Harmonic, state: Floats, length_s: float
) -> tuple[Floats, Floats]:
    """Return all exponents of the periodic motion near a state, descending, and their errors [1/s].

    The error is the change in the last Newton step plus the effect of the integration error, which is large
    for multipliers that are close together or small.
    """
    found, error = _UNKNOWN, _UNKNOWN
    image = partial(flow_derivative, specimen, drive, duration_s=length_s)
    iterates = newton_iterates(image, state, state_scales(specimen, drive))
    for _, _, scaled in islice(iterates, NEWTON_STEPS):
        if not bool(np.all(np.isfinite(scaled))):
            return _UNKNOWN, _UNKNOWN
        values, vectors = np.linalg.eig(scaled)
        with np.errstate(divide="ignore", invalid="ignore"):  # a multiplier may be zero
            lengths = np.linalg.norm(np.linalg.pinv(vectors, rcond=0.0), axis=1)
            condition = np.linalg.norm(scaled, 2) * lengths / np.abs(values)
            order = np.argsort(-np.abs(values))
            before, found = found, np.log(np.abs(values[order])) / length_s
            error = np.abs(found - before) + FLOW_ERROR * condition[order] / length_s
    return found, error


def verdict_of(mean: float, error: float, observed_s: float = math.inf) -> ExponentVerdict:
    """Return the verdict on the sign of an exponent, given its standard error [1/s].

    The sign is not known if perturbations change by less than a factor e in the observed time [s]: without
    damping, for example, they neither grow nor decay, and a mean of finite length differs from zero.
    """
    if not (math.isfinite(mean) and math.isfinite(error)):
        return ExponentVerdict.UNKNOWN
    if abs(mean) <= max(SURE * error, 1.0 / observed_s):
        return ExponentVerdict.NEUTRAL
    return ExponentVerdict.CHAOTIC if mean > 0.0 else ExponentVerdict.REGULAR


def _verdict(taken: _Exponent, lasting_s: float) -> ExponentVerdict:
    if taken.blocks is None:
        return verdict_of(taken.mean, taken.error)
    if not taken.blocks.is_long_enough:
        return ExponentVerdict.UNKNOWN
    return verdict_of(taken.mean, taken.error, lasting_s)


def _transient(run: TangentRun, end: Settling) -> ChaoticTransient | None:
    """Return the transient chaos before the final motion; None if there was no chaos."""
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
