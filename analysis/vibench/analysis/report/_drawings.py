"""What a report shows of each kind of excitation: figures, sentences and tables; one row a kind."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from ..figures import STEPPED_FREQUENCIES, STEPPED_LEVELS, DrawnFigure
from ..kinds import Result
from ..model import AbstractOverlay
from ..recordings import AbstractAnalysis
from ..results import CampaignResults
from ._figure_choice import dwell_figures, noise_figures, stepped_figures, sweep_figures, tracked_figures
from ._findings import (
    dwell_findings,
    level_findings,
    noise_findings,
    stepped_findings,
    sweep_findings,
    tracked_findings,
)
from ._result_tables import ReportTable, collision_table, dwell_table, line_table, resonance_table

A = TypeVar("A", bound=AbstractAnalysis[Any, Any])
L = TypeVar("L", bound=AbstractOverlay[Any])


@dataclass(frozen=True)
class Drawing(Generic[A, L]):
    """How results of one kind are shown; those that follow each other and share a row, together."""

    figures: Callable[[Sequence[Result[A, L]]], Iterator[DrawnFigure]]
    findings: Callable[[Result[A, L]], Iterator[str]]
    tables: tuple[Callable[[Sequence[Result[A, L]]], ReportTable], ...] = ()


_NOISE = Drawing(noise_figures, noise_findings, (resonance_table,))
_SWEEP = Drawing(sweep_figures, sweep_findings, (collision_table,))
_DWELL = Drawing(dwell_figures, dwell_findings, (dwell_table, line_table))
_STEPPED = Drawing(stepped_figures(STEPPED_FREQUENCIES), stepped_findings)
DRAWINGS: Mapping[str, Drawing[Any, Any]] = MappingProxyType(
    {
        "multisine_noise": _NOISE,
        "odd_multisine": _NOISE,
        "streamed_noise": _NOISE,
        "sine_sweep": _SWEEP,
        "held_sweep": _SWEEP,
        "dwell": _DWELL,
        "held_dwell": _DWELL,
        "stepped_sine": _STEPPED,
        "settled_sine": _STEPPED,
        "stepped_level": Drawing(stepped_figures(STEPPED_LEVELS), level_findings),
        "resonance_tracking": Drawing(tracked_figures, tracked_findings),
    }
)
"""By the word in a plan."""


def _groups(results: CampaignResults) -> Iterator[tuple[Drawing[Any, Any], tuple[Result[Any, Any], ...]]]:
    for drawing, group in groupby(results.in_order, key=lambda each: DRAWINGS[each.kind]):
        yield drawing, tuple(group)


def result_figures(results: CampaignResults) -> Iterator[DrawnFigure]:
    """Draw what was found: transmissions, sweeps, dwells, stepped sines."""
    for drawing, group in _groups(results):
        yield from drawing.figures(group)


def result_tables(results: CampaignResults) -> tuple[ReportTable, ...]:
    """Build every table for which there are results."""
    return tuple(build(group) for drawing, group in _groups(results) for build in drawing.tables)


def findings(results: CampaignResults) -> Iterator[str]:
    """Say what each measurement found, weak to strong, and how far the simulation lies from it."""
    yield from results.model_said
    for each in results.in_order:
        yield from DRAWINGS[each.kind].findings(each)
