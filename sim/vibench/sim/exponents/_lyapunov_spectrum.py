"""All six Lyapunov exponents of a specimen under a harmonic drive, and the dimension they give. SI units.

Six small changes span every direction of the state; carried along together and made orthogonal as they go,
they give the exponents in descending order (Benettin et al., Meccanica 15 (1980) 9). Their sum is the mean
rate at which volumes shrink: -tr(M^-1 C) for every elastic law and any motion, which tests the whole
calculation.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Floats
from ..model import Accuracy, AccuracyWord, Harmonic, Outcome, Specimen, chosen, state_matrix
from ..motion import MAX_IMPACT_RATE_HZ, state_scales
from ..slots import UNITS
from ._blocking import blocked_mean
from ._lyapunov import ExponentVerdict, Source, intervals_to_skip, verdict_of
from ._settling import FinalMotion, settling
from ._tangent_run import TangentRun, interval_for, run_with_tangent


@dataclass(frozen=True, eq=False)
class LyapunovSpectrum:
    """The exponents of the motion in which a run ended. NaN where the run did not reach its end."""

    drive: Harmonic
    accuracy: Accuracy
    exponents_per_s: Floats
    """Descending, shape (6,); minus infinity for a direction that a stop which holds m1 has taken away."""
    standard_errors_per_s: Floats
    """Shape (6,); zero where the exponents are those of the modes."""
    verdict: ExponentVerdict
    """Of the largest."""
    source: Source
    motion: FinalMotion
    since_s: float
    impacts: int
    """Since time zero."""
    impact_rate_hz: float
    """In the final motion."""
    final_state: Floats
    end_time_s: float
    outcome: Outcome

    @property
    def sum_per_s(self) -> float:
        """Mean rate at which the logarithm of a volume changes."""
        return float(np.sum(self.exponents_per_s))

    @property
    def dimension(self) -> float:
        """Kaplan and Yorke's dimension of the attractor's stroboscopic section; one more in time."""
        return kaplan_yorke(self.exponents_per_s)


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
    """Tell how fast neighbouring motions part or come together, in every direction.

    Arguments as in `vibench.sim.lyapunov_exponent`; the errors need blocks as long as the motion's
    memory too.
    """
    accuracy = chosen(Accuracy, accuracy)
    interval = interval_for(specimen, drive, interval_s)
    skipped = intervals_to_skip(interval, duration_s, settle_s)
    run = run_with_tangent(
        specimen, drive, UNITS, settle_s + duration_s, interval, accuracy, initial_state, max_impact_rate_hz
    )
    length = interval.length_s
    if run.outcome is not Outcome.REACHED_END:
        nothing = np.full(UNITS, math.nan)
        parts = (nothing, nothing, ExponentVerdict.UNKNOWN, Source.AVERAGE, FinalMotion.THROUGHOUT, 0)
    else:
        parts = _taken(specimen, drive, run, skipped)
    exponents, errors, verdict, source, motion, since = parts
    lasting = (len(run.growth) - since) * length
    return LyapunovSpectrum(
        drive=drive,
        accuracy=accuracy,
        exponents_per_s=exponents,
        standard_errors_per_s=errors,
        verdict=verdict,
        source=source,
        motion=motion,
        since_s=since * length,
        impacts=len(run.impact_times_s),
        impact_rate_hz=float(run.impacts[since:].sum()) / lasting if lasting > 0.0 else 0.0,
        final_state=run.final_state,
        end_time_s=run.end_time_s,
        outcome=run.outcome,
    )


def _taken(
    specimen: Specimen, drive: Harmonic, run: TangentRun, skipped: int
) -> tuple[Floats, Floats, ExponentVerdict, Source, FinalMotion, int]:
    end = settling(run, state_scales(specimen, drive))
    if end.motion is FinalMotion.QUIET:
        system, _ = state_matrix(specimen)
        decays = np.sort(np.linalg.eigvals(system).real)[::-1]
        verdict = verdict_of(float(decays[0]), 0.0)
        return decays, np.zeros(UNITS), verdict, Source.MODES, end.motion, end.since
    # A motion that settles late may leave little to average: never less than half of what was asked for.
    since = min(max(skipped, end.since), (len(run.growth) + skipped) // 2)
    means = [_mean(rates) for rates in run.rates[since:].T]
    exponents, errors = np.array([mean for mean, _ in means]), np.array([error for _, error in means])
    order = np.argsort(-exponents, kind="stable")
    verdict = verdict_of(float(exponents[order[0]]), float(errors[order[0]]))
    return exponents[order], errors[order], verdict, Source.AVERAGE, end.motion, since


def _mean(rates: Floats) -> tuple[float, float]:
    """Mean of local exponents with its error; minus infinity where the direction was lost."""
    if not bool(np.all(np.isfinite(rates))):
        return -math.inf, 0.0
    found = blocked_mean(rates)
    return found.mean, found.standard_error


def kaplan_yorke(exponents: Floats) -> float:
    """Dimension that exponents in descending order give an attractor; all of them where none shrinks.

    j + (l_1 + ... + l_j) / |l_(j+1)| with the largest j whose sum is not negative (Kaplan and Yorke, Lecture
    Notes in Mathematics 730 (1979) 204).
    """
    sums = np.cumsum(exponents)
    kept = int(np.count_nonzero(np.cumprod(sums >= 0.0)))
    if kept in (0, len(exponents)):
        return float(kept)
    return kept + float(sums[kept - 1] / abs(exponents[kept]))
