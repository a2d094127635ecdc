"""What claims are measured on: studies, signals and sweeps, each computed once.

The studies that claims are measured on: each model at the paper's amplitudes, once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from vibench.sim import Observable, Specimen
from vibench.sim.study import GivenStart, Start, Study, StudyObservable, StudyResults

from .case import Case, ExponentsBy
from .options import AMPLITUDES_M, WITH_EXPONENT
from .responses import Reals, Responses, drive_at, responses
from .textbook_methods import ode45, textbook_exponent

Computed = TypeVar("Computed")
Solve = Callable[[Study], StudyResults]
"""Answers a study, from its file where there is one; raises rather than to give half of it."""


@dataclass(frozen=True)
class Evidence:
    """Computes what is asked for, and remembers it for the next claim that asks."""

    solve: Solve
    _remembered: dict[object, object] = field(default_factory=dict)

    def study(self, study: Study) -> StudyResults:
        """Answer a study; equal studies are answered once."""
        return self.remembered(study, lambda: self.solve(study))

    @property
    def studies(self) -> tuple[StudyResults, ...]:
        """All that were answered so far."""
        return tuple(each for each in self._remembered.values() if isinstance(each, StudyResults))

    def remembered(self, key: object, compute: Callable[[], Computed]) -> Computed:
        """Compute something under a key that says everything that it depends on."""
        if key not in self._remembered:
            self._remembered[key] = compute()
        return self._remembered[key]  # type: ignore[return-value]


PIECE_WISE, CONTINUOUS = "hertz", "power:5"
WEAK_M, MODERATE_M, HIGHER_M, STRONG_M = AMPLITUDES_M
SECOND_REGION_HZ = (220.0, 320.0)
"""Around the second linear resonance, between the two terminal ones."""
WITH_EXPONENTS = (PIECE_WISE, CONTINUOUS)
"""Models whose exponents the paper shows at all four amplitudes (Fig. 10)."""


def specimen_under(case: Case, model: str = PIECE_WISE) -> Specimen:
    """Give the paper's specimen as a case has it."""
    return case.options.specimen(case.fitted(model))


def level(evidence: Evidence, case: Case, amplitude_m: float, model: str = PIECE_WISE) -> Responses:
    """Give the curves of a model at one of the paper's amplitudes."""
    curve = responses(evidence.study(levels_asked(case, model)), amplitude=amplitude_m)
    return replace(curve, exponent_per_s=exponents_of(evidence, case, curve, amplitude_m, model))


def exponents_of(
    evidence: Evidence, case: Case, curve: Responses, amplitude_m: float, model: str = PIECE_WISE
) -> Reals:
    """Give the exponents of a curve as the case has them; where nothing collides, the exact ones."""
    if case.exponents_by is ExponentsBy.EXACT or np.isnan(curve.exponent_per_s).all():
        return curve.exponent_per_s
    specimen, options = specimen_under(case, model), case.options
    settle_s = options.window_s

    def follow() -> Reals:
        return np.array(
            [
                textbook_exponent(
                    specimen, drive_at(f, amplitude_m), ode45(), options.duration_s - settle_s, settle_s
                )
                if collides or model != PIECE_WISE
                else exact
                for f, collides, exact in zip(
                    curve.frequency_hz, curve.collides, curve.exponent_per_s, strict=True
                )
            ]
        )

    return evidence.remembered(("ode45", specimen, amplitude_m, options.frequencies_hz), follow)


def levels_asked(case: Case, model: str = PIECE_WISE) -> Study:
    """Give the study of a model at all four amplitudes."""
    return model_study(case, model, AMPLITUDES_M, with_exponents(model))


def with_exponents(model: str) -> tuple[StudyObservable, ...]:
    """Say what is observed of a model at the four amplitudes."""
    return WITH_EXPONENT if model in WITH_EXPONENTS else (Observable.RESPONSE,)


def model_study(
    case: Case,
    model: str,
    amplitudes_m: Sequence[float],
    observe: tuple[StudyObservable, ...],
    damping_time_s: float | None = None,
) -> Study:
    """One model over the case's grid, at the case's damping unless another is given."""
    options = case.options
    return options.study(
        (case.fitted(model),),
        tuple(amplitudes_m),
        observe=observe,
        starts=(Start.REST if case.draw == 0 else GivenStart(label=f"draw {case.draw}", state=case.start),),
        **({} if damping_time_s is None else {"damping_times_s": (damping_time_s,)}),
    )
