"""What claims are measured on: studies, signals and sweeps, each computed once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from vibench.sim.study import Study, StudyResults

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
