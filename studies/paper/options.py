"""Options for choices that the paper leaves open; the options are stored with each figure."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from vibench.analysis import SIMILARITY_THRESHOLD, InvalidRequest, LogarithmOf
from vibench.sim import Accuracy, Observable, Specimen, SpecimenTable, usual_specimen
from vibench.sim.study import Study, StudyObservable, frequency_range

AMPLITUDES_M = (1e-6, 5e-6, 10e-6, 50e-6)
"""The paper's four amplitudes, from weak to strong (section 3.1; Figs. 3, 6 and 7)."""
LOWEST_HZ = 5.0
_LONGEST_DAMPING_TIME_S = 0.01
"""Largest damping time, more than fifteen times critical damping in the paper's third mode."""
_LEAST_GAP_M, _LARGEST_GAP_M = 1e-9, 0.01
"""Limits of the gap [m]: a thousandth of the smallest drive amplitude, and 200 times the largest one."""
_PAPER = usual_specimen()
WITH_EXPONENT: tuple[StudyObservable, ...] = (Observable.RESPONSE, Observable.LYAPUNOV)


class FrequencyGrid(StrEnum):
    """Spacing of the frequencies; the paper does not give it."""

    COARSE = "coarse"
    """Every 5 Hz, similar to the paper's curves."""
    FINE = "fine"
    """Every 1 Hz, which resolves each jump."""

    @property
    def step_hz(self) -> float:
        """Frequency spacing."""
        return {FrequencyGrid.COARSE: 5.0, FrequencyGrid.FINE: 1.0}[self]


@dataclass(frozen=True)
class FigureOptions:
    """Named options for choices that the paper leaves open."""

    damping_time_s: float = 2e-5
    """c_i = damping time * k_i."""
    damping_ratio: float | None = None
    """c_i = 2 * damping ratio * m_i * w_i of each mass on its own spring; replaces the damping time."""
    gap_m: float = 45e-6
    accuracy: Accuracy = Accuracy.STANDARD
    grid: FrequencyGrid = FrequencyGrid.COARSE
    highest_hz: float = 600.0
    similarity_highest_hz: float = 500.0
    """Upper end of the frequency grid for comparing models; similarity rates depend on this limit."""
    logarithm_of: LogarithmOf = LogarithmOf.MILLIMETRES
    threshold: float = SIMILARITY_THRESHOLD
    duration_s: float = 30.0
    window_s: float = 5.0
    """Observed window as in the paper: the last 5 s of 30 s from rest."""
    budget_s: float = 0.0
    """Time for runs from other initial states: zero, because each point in the paper is from one run."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.damping_time_s <= _LONGEST_DAMPING_TIME_S:
            raise InvalidRequest(
                f"a damping time of {self.damping_time_s:g} s is not allowed; give 0 to "
                f"{_LONGEST_DAMPING_TIME_S:g}"
            )
        if self.damping_ratio is not None and not 0.0 <= self.damping_ratio < math.inf:
            raise InvalidRequest(
                f"a damping ratio of {self.damping_ratio} is not allowed; give zero or a positive ratio"
            )
        if not _LEAST_GAP_M <= self.gap_m <= _LARGEST_GAP_M:
            raise InvalidRequest(
                f"a gap of {self.gap_m:g} m is not allowed; give {_LEAST_GAP_M:g} to {_LARGEST_GAP_M:g}"
            )

    @property
    def frequencies_hz(self) -> tuple[float, ...]:
        """Frequencies of a response curve."""
        return frequency_range(LOWEST_HZ, self.highest_hz, self.grid.step_hz)

    @property
    def similarity_frequencies_hz(self) -> tuple[float, ...]:
        """Frequencies for the comparison of models."""
        return frequency_range(LOWEST_HZ, self.similarity_highest_hz, self.grid.step_hz)

    def study(self, models: tuple[str, ...], amplitudes_m: tuple[float, ...], **replaced: Any) -> Study:
        """Return the study of models at amplitudes with these options; other fields may be replaced."""
        chosen: dict[str, Any] = {
            "gaps_m": (self.gap_m,),
            "specimen": self._specimen_table,
            "damping_times_s": (self.damping_time_s,) if self.damping_ratio is None else None,
            "frequencies_hz": self.frequencies_hz,
            "accuracy": self.accuracy,
            "duration_s": self.duration_s,
            "window_s": self.window_s,
            "budget_s": self.budget_s,
        }
        return Study(models=models, amplitudes_m=amplitudes_m, **(chosen | replaced))

    def specimen(self, contact: str = "hertz") -> Specimen:
        """Return the paper's specimen with these options."""
        damping_time_s = self.damping_time_s if self.damping_ratio is None else None
        return self._specimen_table.specimen(contact, damping_time_s, self.gap_m)

    @property
    def only_damping_time_s(self) -> float:
        """Damping time for a figure without damping ratio; raises InvalidRequest if a ratio is set."""
        if self.damping_ratio is not None:
            raise InvalidRequest("this figure takes no damping ratio; give a damping time")
        return self.damping_time_s

    @property
    def _specimen_table(self) -> SpecimenTable:
        if self.damping_ratio is None:
            return _PAPER
        masses_and_springs = zip(_PAPER.masses_kg, _PAPER.stiffnesses, strict=True)
        dampings = [2.0 * self.damping_ratio * math.sqrt(m * k) for m, k in masses_and_springs]
        return SpecimenTable.model_validate({"dampings_ns_per_m": dampings})

    @property
    def damping(self) -> str:
        """The damping in words."""
        if self.damping_ratio is None:
            return f"c = {self.damping_time_s:.3g} s · k"
        return f"c_i = 2 · {self.damping_ratio:g} · m_i ω_i"

    @property
    def sentence(self) -> str:
        """The options as a sentence under a figure."""
        return (
            f"Options: {self.damping}, gap {1e6 * self.gap_m:g} µm, "
            f"{self.accuracy.value} accuracy, every {self.grid.step_hz:g} Hz, {self.duration_s:g} s from "
            f"rest, the last {self.window_s:g} s observed."
        )
