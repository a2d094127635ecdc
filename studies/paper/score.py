"""How many claims hold at each damping: the paper leaves its unit open, and much turns on it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .case import SCORED_S, Case, damping
from .claim import Claim, found
from .evidence import MODERATE_M, WEAK_M, Evidence, level


@dataclass(frozen=True)
class DampingScore:
    """What holds at one damping."""

    damping_time_s: float
    """c_i / k_i."""
    held: tuple[str, ...]
    """Keys of the claims that hold."""
    failed: tuple[str, ...]
    weak_exponent_per_s: float
    """Largest exponent over frequency at 1 um, which the paper has near zero."""
    moderate_exponent_per_s: float
    """Largest exponent over frequency at 5 um, which the paper has above 100."""


def scores(claims: Sequence[Claim], evidence: Evidence, case: Case) -> tuple[DampingScore, ...]:
    """Measure every scored claim at every damping, all else as in the case."""
    return tuple(
        _score([claim for claim in claims if claim.is_scored], evidence, damping(each).of(case))
        for each in SCORED_S
    )


def _score(claims: Sequence[Claim], evidence: Evidence, case: Case) -> DampingScore:
    is_met = {claim.key: found(replace(claim, draws=1), evidence, case).is_met for claim in claims}
    weak, moderate = (
        float(np.nanmax(level(evidence, case, each).exponent_per_s)) for each in (WEAK_M, MODERATE_M)
    )
    return DampingScore(
        damping_time_s=case.options.damping_time_s,
        held=tuple(key for key, met in is_met.items() if met),
        failed=tuple(key for key, met in is_met.items() if not met),
        weak_exponent_per_s=weak,
        moderate_exponent_per_s=moderate,
    )
