"""Result of an analysis, and the functions that a kind of excitation needs for it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

from ..comparison.curve import Curve, CurveOrigin
from ..frequency_response.noise_response import NoiseAnalysis
from ..frequency_response.request import FrequencyResponseRequest
from ..overlay.draws import Draw, DrawSet
from ..overlay.ensemble import Quantity
from ..overlay.overlay import AbstractOverlay, DwellOverlay, NoiseOverlay, SteppedSineOverlay, SweepOverlay
from ..overlay.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels
from ..recordings.checks import AbstractAnalysis
from ..recordings.facts import RecordingFacts
from ..sine.dwell_analysis import DwellAnalysis
from ..sine.stepped_response import SteppedSineAnalysis
from ..sine.sweep_analysis import SweepAnalysis
from ..tables import Tabular
from ..uncertainty.budget import Budget

Json = dict[str, Any]
P = TypeVar("P")
A = TypeVar("A", bound=AbstractAnalysis[Any, Any])
L = TypeVar("L", bound=AbstractOverlay[Any])


@dataclass(frozen=True, eq=False)
class Result(Tabular, Generic[A, L]):
    """Analysis of a measurement and its comparison with the simulation."""

    analysis: A
    overlay: L | None

    @property
    def kind(self) -> str:
        """Kind of the excitation."""
        return self.analysis.facts.measurement.excitation.kind


AnyResult: TypeAlias = Result[Any, Any]
NoiseResult: TypeAlias = Result[NoiseAnalysis, NoiseOverlay]
SweepResult: TypeAlias = Result[SweepAnalysis, SweepOverlay]
DwellResult: TypeAlias = Result[DwellAnalysis, DwellOverlay]
SteppedSineResult: TypeAlias = Result[SteppedSineAnalysis, SteppedSineOverlay]


@dataclass(frozen=True)
class AnalysisKind(Generic[P, A, L]):
    """Functions that analyse recordings of one kind of excitation."""

    family: str
    """Name of the results in JSON; kinds with the same type of result share this name."""
    analyse: Callable[[RecordingFacts, Channels, P, FrequencyResponseRequest], A]
    draws: Callable[[A], Callable[[SimulatedChannels], Draw[Any]]]
    """Return the function that estimates the measured quantities from simulated channels."""
    compared: Callable[[A], tuple[Quantity, ...]]
    """Return the measured quantities that are compared with the simulated records (draws)."""
    lay: Callable[[A, DrawSet[Any]], L]
    """Return the overlay: the comparison of the analysis with all draws."""
    curves: Callable[[str, CurveOrigin, Any], Iterator[Curve]]
    """Yield curves of the measured or simulated response of the recording with this name."""
    budgets: Callable[[A, L | None], tuple[Budget, ...]]
    """Return uncertainty budgets of the main results."""
    place: Callable[[P], tuple[float, ...]] = lambda _: ()
    """Return the key by which results of a family are sorted from weak to strong; unsorted by default."""
