"""What a report shows of each kind of excitation: figures, sentences and tables; one row a kind."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Generic, TypeVar

from vibench.acquisition.plan import Family, rows_by_kind

from ..figures import (
    STEPPED_FREQUENCIES,
    STEPPED_LEVELS,
    TRACKED_RESONANCE,
    DrawnFigure,
    SteppedLook,
    backbone_figure,
    bench_levels_figure,
    distortion_figure,
    dwells_figure,
    excitation_figure,
    held_branch_figure,
    hysteresis_figure,
    portraits_figure,
    stepped_sine_figure,
    sweep_figure,
    sweep_orders_figure,
    transmission_figure,
    transmission_levels_figure,
)
from ..kinds import AnyResult, DwellResult, NoiseResult, Result, SteppedSineResult, SweepResult
from ..model import AbstractOverlay
from ..recordings import AbstractAnalysis
from ..results import CampaignResults
from ..sine import tracked_resonances
from ._findings import (
    branch_findings,
    dwell_findings,
    level_findings,
    noise_findings,
    stepped_findings,
    sweep_findings,
    tracked_findings,
)
from ._result_tables import (
    ReportTable,
    collision_table,
    dwell_table,
    line_table,
    resonance_table,
    uncertainty_table,
)

A = TypeVar("A", bound=AbstractAnalysis[Any, Any])
L = TypeVar("L", bound=AbstractOverlay[Any])


@dataclass(frozen=True)
class Drawing(Generic[A, L]):
    """How results of one kind are shown; those that follow each other and share a row, together."""

    figures: Callable[[Sequence[Result[A, L]]], Iterator[DrawnFigure]]
    findings: Callable[[Result[A, L]], Iterator[str]]
    tables: tuple[Callable[[Sequence[Result[A, L]]], ReportTable], ...] = ()


def _noise_figures(noise: Sequence[NoiseResult]) -> Iterator[DrawnFigure]:
    """Draw all levels in one, then each with its distortion."""
    if len(noise) > 1:
        yield transmission_levels_figure([each.analysis for each in noise])
    for each in noise:
        yield transmission_figure(each.analysis, each.laid)
        if each.analysis.response.periodic is not None:
            yield distortion_figure(each.analysis, each.analysis.response.periodic)


def _sweep_figures(sweeps: Sequence[SweepResult]) -> Iterator[DrawnFigure]:
    """Draw each sweep, then those that went there and back over each other."""
    for sweep in sweeps:
        yield sweep_figure(sweep.analysis, sweep.laid)
        yield sweep_orders_figure(sweep.analysis)
    for up, down in _there_and_back(sweeps):
        yield hysteresis_figure(up.analysis, down.analysis)


def _dwell_figures(dwells: Sequence[DwellResult]) -> Iterator[DrawnFigure]:
    """Draw the dwells at one frequency together."""
    for _, group in groupby(dwells, key=lambda each: each.analysis.excitation.frequency_hz):
        same = tuple(group)
        yield dwells_figure([(each.analysis, each.laid) for each in same])
        yield portraits_figure([each.analysis for each in same])


def _stepped_figures(
    look: SteppedLook[Any],
) -> Callable[[Sequence[SteppedSineResult]], Iterator[DrawnFigure]]:
    """Draw a figure of each over what was stepped."""
    return lambda stepped: (stepped_sine_figure(each.analysis, each.laid, look) for each in stepped)


def _tracked_figures(tracked: Sequence[SteppedSineResult]) -> Iterator[DrawnFigure]:
    """Draw each resonance over level, where one was found."""
    for each in tracked:
        if tracked_resonances(each.analysis.facts.feedback):
            yield backbone_figure(each.analysis, each.laid)
        else:
            yield stepped_sine_figure(each.analysis, each.laid, TRACKED_RESONANCE)


def _there_and_back(sweeps: Sequence[SweepResult]) -> Iterator[tuple[SweepResult, SweepResult]]:
    """Pair each sweep upwards with the first one downwards of the same level over some of its band."""
    for up in sweeps:
        plan = up.analysis.excitation
        for down in sweeps:
            other = down.analysis.excitation
            is_back = plan.start_hz < plan.stop_hz and other.start_hz > other.stop_hz
            overlaps = other.stop_hz < plan.stop_hz and other.start_hz > plan.start_hz
            if is_back and overlaps and plan.amplitude_vpp == other.amplitude_vpp:
                yield up, down
                break


DRAWINGS: Mapping[str, Drawing[Any, Any]] = rows_by_kind(
    {
        Family.NOISE: Drawing(_noise_figures, noise_findings, (resonance_table,)),
        Family.SWEEP: Drawing(_sweep_figures, sweep_findings, (collision_table,)),
        Family.DWELL: Drawing(_dwell_figures, dwell_findings, (dwell_table, line_table)),
        Family.STEPPED: Drawing(_stepped_figures(STEPPED_FREQUENCIES), stepped_findings),
    },
    {
        "stepped_level": Drawing(_stepped_figures(STEPPED_LEVELS), level_findings),
        "resonance_tracking": Drawing(_tracked_figures, tracked_findings),
        "branch_continuation": Drawing(
            lambda branches: (held_branch_figure(each.analysis) for each in branches), branch_findings
        ),
    },
)
"""By the word in a plan."""


def _groups(results: CampaignResults) -> Iterator[tuple[Drawing[Any, Any], tuple[AnyResult, ...]]]:
    for drawing, group in groupby(results.in_order, key=lambda each: DRAWINGS[each.kind]):
        yield drawing, tuple(group)


def result_figures(results: CampaignResults) -> Iterator[DrawnFigure]:
    """Draw what was found: transmissions, sweeps, dwells, stepped sines."""
    for drawing, group in _groups(results):
        yield from drawing.figures(group)


def result_tables(results: CampaignResults) -> tuple[ReportTable, ...]:
    """Build every table for which there are results."""
    found = tuple(build(group) for drawing, group in _groups(results) for build in drawing.tables)
    budgets = uncertainty_table(results.in_order)
    return (*found, budgets) if budgets.rows else found


def findings(results: CampaignResults) -> Iterator[str]:
    """Say what each measurement found, weak to strong, and how far the simulation lies from it.

    Parameters
    ----------
    results
        As `vibench.analysis.analyse_files` gives them.

    Returns
    -------
    Sentences: of a fit to all of them first, then of each recording, after its name.

    """
    yield from results.model_said
    for each in results.in_order:
        yield from (f"{each.analysis.facts.name}: {said}" for said in DRAWINGS[each.kind].findings(each))


def recording_figures(result: AnyResult) -> tuple[DrawnFigure, ...]:
    """Draw what was planned and what every channel recorded."""
    facts = result.analysis.facts
    return excitation_figure(facts.measurement), bench_levels_figure(facts)
