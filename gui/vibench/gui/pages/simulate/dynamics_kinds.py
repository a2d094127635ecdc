"""The tabs beside the responses: what each asks, and how it tells its answer."""

from typing import cast

from vibench.analysis import Curve
from vibench.analysis.dynamics import (
    BranchDiagram,
    BranchLine,
    BranchRequest,
    ChainAnswer,
    ChainRequest,
    ChainRun,
    ExponentSpectrum,
    SpectrumPoint,
    SpectrumRequest,
)
from vibench.analysis.simulation.progress import PartialResult

from .dynamics_view import DynamicsKind


def _diagram(request: BranchRequest, parts: tuple[PartialResult, ...], elapsed_s: float) -> BranchDiagram:
    return BranchDiagram(request, cast("tuple[BranchLine, ...]", parts), elapsed_s)


def _spectrum(
    request: SpectrumRequest, parts: tuple[PartialResult, ...], elapsed_s: float
) -> ExponentSpectrum:
    return ExponentSpectrum(request, cast("tuple[SpectrumPoint, ...]", parts), elapsed_s)


def _chain(request: ChainRequest, parts: tuple[PartialResult, ...], elapsed_s: float) -> ChainAnswer:
    return ChainAnswer(request, cast("tuple[ChainRun, ...]", parts), elapsed_s)


def _no_curves(_answer: ExponentSpectrum | ChainAnswer) -> tuple[Curve, ...]:
    """Exponents and chains are no responses of a specimen: nothing to lay over a recording."""
    return ()


BRANCHES = DynamicsKind(
    name="branches",
    request=BranchRequest,
    hidden=frozenset({"resonance_band_hz", "phase_of", "loop_time_s", "recorded_level", "described"}),
    answer=_diagram,
    cost=lambda answer: answer.cost_sentence,
    curves=lambda answer: answer.curves(),
    before=(
        "A search runs every start for 300 drive periods, a branch takes a second to some; the error of each "
        "motion is told with it (docs/branches.md)."
    ),
)
SPECTRUM = DynamicsKind(
    name="exponents",
    request=SpectrumRequest,
    hidden=frozenset({"described"}),
    answer=_spectrum,
    cost=lambda answer: answer.cost_sentence,
    curves=_no_curves,
    before=(
        "Each point follows six small changes for its whole duration; the sum of the exponents, which the "
        "dampers fix, is its check (docs/branches.md)."
    ),
)
CHAIN = DynamicsKind(
    name="chain",
    request=ChainRequest,
    hidden=frozenset({"others", "described"}),
    answer=_chain,
    cost=lambda answer: answer.cost_sentence,
    curves=_no_curves,
    before=(
        "Waves need no run. A simulated second of 8 cells that strike takes some hundredths of a second, of "
        "64 cells a third; contacts err as the accuracy says, energies carry their standard error "
        "(docs/chains.md)."
    ),
)
