"""The motions that several starts came to, as an answer gives them: what share of starts comes to each."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from .prediction import Ensemble, FoundMotion, MotionKind
from .quantiles import student_quantile
from .scatter import COVERED
from .several_starts import LASTING_S, ReachedMotion, SeveralStarts, kind_among, motions_among
from .shares import Count, EscapeRate, shares_of, wilson_share

PENDING = (MotionKind.CHAOTIC_SO_FAR, MotionKind.UNDECIDED)
"""Motions that may still come to another."""
FEWEST_DRAWS = 3
"""Draws of one motion that its scatter is told from."""

ErrorOf = Callable[[ReachedMotion], float | None]
"""Gives the relative error of the responses of a motion."""


def ensemble_of(
    several: SeveralStarts, amplitude_m: float, forgetting_s: float, error_of: ErrorOf
) -> Ensemble:
    """Sort what the starts came to into motions, and count them.

    Parameters
    ----------
    several
        Followed as far as they are to be.
    amplitude_m
        Of the drive.
    forgetting_s
        Time in which the slowest mode without contact fades by e.
    error_of
        Asked once for each motion.

    """
    reached, escape = several.reached, several.escape
    groups = motions_among(reached)
    asked = next(group for group in groups if any(each is reached[0] for each in group))
    groups = sorted(groups, key=len, reverse=True)
    kinds = [lasting(kind_among(group, forgetting_s), escape) for group in groups]
    counts = counts_of(kinds, [len(group) for group in groups])
    shares = shares_of(counts)
    pending = sum(each.trials for each in counts if not each.is_final)
    return Ensemble(
        starts=len(reached),
        motions=tuple(
            FoundMotion(
                motion=kind,
                period=group[0].period,
                **_responses(group, amplitude_m),
                error_estimate=_error(group, error_of),
                starts=len(group),
                share=share,
            )
            for group, kind, share in zip(groups, kinds, shares, strict=True)
        ),
        asked=next(place for place, group in enumerate(groups) if group is asked),
        unseen_share=wilson_share(pending, len(reached)).high,
        escape=escape,
        scatter=_deviation([each.responses_m[0] for each in reached]),
        followed_s=several.followed_s,
    )


def counts_of(kinds: Sequence[MotionKind], starts: Sequence[int]) -> list[Count]:
    """Count the starts of each motion, and say which may still come to another.

    Chaos that does not die out may: one chaotic motion becomes another as suddenly as a periodic one, and
    only what becomes periodic is seen as an escape.
    """
    is_one_chaos = kinds.count(MotionKind.CHAOTIC) == 1
    return [
        Count(count, kind not in PENDING and (kind is not MotionKind.CHAOTIC or is_one_chaos))
        for kind, count in zip(kinds, starts, strict=True)
    ]


def lasting(motion: MotionKind, escape: EscapeRate | None) -> MotionKind:
    """Call chaos so only where none of it died out, and it surely lasts."""
    if motion is not MotionKind.CHAOTIC:
        return motion
    lasts = escape is not None and escape.escapes == 0 and escape.lifetime_above_s > LASTING_S
    return motion if lasts else MotionKind.CHAOTIC_SO_FAR


def _responses(group: Sequence[ReachedMotion], amplitude_m: float) -> dict[str, float]:
    """Give those of the start that shows a motion that repeats best; of others, the mean."""
    shown = group[:1] if group[0].period is not None else group
    means = np.mean([each.responses_m for each in shown], axis=0) / amplitude_m
    return dict(
        zip(("response_i", "response_ii", "relative_i", "relative_ii"), map(float, means), strict=True)
    )


def _error(group: Sequence[ReachedMotion], error_of: ErrorOf) -> float | None:
    """Give what one more draw of a motion may differ by from the mean of these, in 19 cases of 20."""
    if group[0].period is not None:
        return error_of(group[0])
    if len(group) < FEWEST_DRAWS:
        # A calm start of chaos in bursts knows nothing of the bursts.
        known = [each for each in map(error_of, group) if each is not None]
        return max(known, default=None)
    widened = math.sqrt(1.0 + 1.0 / len(group)) * student_quantile(len(group) - 1, COVERED)
    return widened * (_deviation([each.responses_m[0] for each in group]) or 0.0)


def _deviation(values: Sequence[float]) -> float | None:
    """Divide the standard deviation by the mean; None of a single value."""
    return float(np.std(values, ddof=1) / np.mean(values)) if len(values) > 1 else None
