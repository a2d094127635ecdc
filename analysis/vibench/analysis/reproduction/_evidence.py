"""What claims are measured on: studies, signals and sweeps, each computed once.

The studies that claims are measured on: each model at the paper's amplitudes, once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from vibench.sim import Observable, Specimen, gong2025
from vibench.sim.study import GivenStart, Start, Study, StudyObservable, StudyResults

from ..paper_figures import AMPLITUDES_M, WITH_EXPONENT, Responses, responses
from ._case import Case

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
WITH_EXPONENTS = (PIECE_WISE, CONTINUOUS)
"""Models whose exponents the paper shows at all four amplitudes (Fig. 10)."""


def specimen_under(case: Case) -> Specimen:
    """Give the paper's specimen at a case's damping and gap."""
    return gong2025(case.options.damping_time_s, case.options.gap_m)


def level(evidence: Evidence, case: Case, amplitude_m: float, model: str = PIECE_WISE) -> Responses:
    """Give the curves of a model at one of the paper's amplitudes."""
    return responses(evidence.study(levels_asked(case, model)), amplitude=amplitude_m)


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
        (model,),
        tuple(amplitudes_m),
        damping_times_s=(options.damping_time_s if damping_time_s is None else damping_time_s,),
        observe=observe,
        starts=(Start.REST if case.draw == 0 else GivenStart(label=f"draw {case.draw}", state=case.start),),
    )
