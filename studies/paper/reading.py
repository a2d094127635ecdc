"""Data for the claims: studies, signals and sweeps with the options of a case, each computed once."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from vibench.sim import Harmonic, Observable
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, WITH_EXPONENT, Case, ExponentsBy
from .responses import Reals, Responses, responses
from .textbook_methods import ode45, textbook_exponents

PIECE_WISE, CONTINUOUS = "hertz", "power:5"
WEAK_M, MODERATE_M, HIGHER_M, STRONG_M = AMPLITUDES_M
SECOND_REGION_HZ = (220.0, 320.0)
"""Frequency range around the second linear resonance, between the two terminal resonances [Hz]."""
Computed = TypeVar("Computed")
Values = tuple[float | np.floating[Any], ...]
"""The numbers of a claim: one per requirement; NaN for a missing value."""


@dataclass(frozen=True)
class Evidence:
    """Cache of studies and other results, shared by all claims; it computes results that are missing."""

    solve: Callable[[Study], StudyResults]
    """Function that solves a study or reads the study's file; raises an error if the study is incomplete."""
    _remembered: dict[object, object] = field(default_factory=dict)

    def study(self, study: Study) -> StudyResults:
        """Return the results of a study; equal studies are solved once."""
        return self.compute_once(study, lambda: self.solve(study))

    @property
    def studies(self) -> tuple[StudyResults, ...]:
        """All studies solved so far."""
        return tuple(each for each in self._remembered.values() if isinstance(each, StudyResults))

    def compute_once(self, key: object, compute: Callable[[], Computed]) -> Computed:
        """Return a result, computed at the first call; ``key`` must contain all inputs of the computation."""
        if key not in self._remembered:
            self._remembered[key] = compute()
        return self._remembered[key]  # type: ignore[return-value]


@dataclass(frozen=True)
class Reading:
    """Results of simulations with the options of one case."""

    evidence: Evidence
    case: Case

    def curve(self, amplitude_m: float, model: str = PIECE_WISE, **replaced: Any) -> Responses:
        """Return the response curve at any amplitude; fields of its study may be replaced."""
        return responses(self.evidence.study(self.case.study((model,), (amplitude_m,), **replaced)))

    def level(self, amplitude_m: float, model: str = PIECE_WISE) -> Responses:
        """Return the response curve at one of the paper's amplitudes."""
        curve = responses(self.evidence.study(self.levels(model)), amplitude=amplitude_m)
        return replace(curve, exponent_per_s=self.exponents_of(curve, amplitude_m, model))

    def levels(self, model: str = PIECE_WISE) -> Study:
        """Return the study at the paper's amplitudes, with exponents for the models of Fig. 10."""
        shown = model in (PIECE_WISE, CONTINUOUS)
        return self.case.study(
            (model,), AMPLITUDES_M, observe=WITH_EXPONENT if shown else (Observable.RESPONSE,)
        )

    def exponents(self, amplitude_m: float, model: str = PIECE_WISE) -> Reals:
        """Return the largest exponent over frequency [1/s]."""
        if model in (PIECE_WISE, CONTINUOUS):
            return self.level(amplitude_m, model).exponent_per_s
        return self.exponents_of(self.curve(amplitude_m, model, observe=WITH_EXPONENT), amplitude_m, model)

    def exponents_of(self, curve: Responses, amplitude_m: float, model: str = PIECE_WISE) -> Reals:
        """Return the exponents by the case's method, or the exact ones for motions without collisions."""
        if self.case.exponents_by is ExponentsBy.EXACT or np.isnan(curve.exponent_per_s).all():
            return curve.exponent_per_s
        specimen, settle_s = self.case.specimen(model), self.case.window_s
        kept_s = self.case.duration_s - settle_s

        def follow() -> Reals:
            is_followed = curve.collides | (model != PIECE_WISE)
            drives = [Harmonic(f, amplitude_m) for f in curve.frequency_hz[is_followed]]
            found = curve.exponent_per_s.copy()
            found[is_followed] = textbook_exponents(specimen, drives, ode45(), kept_s, settle_s)
            return found

        key = ("ode45", specimen, amplitude_m, self.case.frequencies_hz)
        return self.evidence.compute_once(key, follow)
