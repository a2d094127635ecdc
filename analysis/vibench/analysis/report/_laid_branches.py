"""Branches laid over the stepped sines and sweeps of a campaign, and their levels laid over maps."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vibench.sim import Parameter
from vibench.sim.maps import MapResults

from ..comparison.curve import Curve, CurveKind, CurveOrigin
from ..dynamics import BranchDiagram, RecordedLevel
from ..figures.branches import branches_figure
from ..figures.drawn import DrawnFigure
from ..figures.maps import map_figure
from ..kinds.analyses import ANALYSES
from ..kinds.analysis_kind import AnyResult
from ..results.campaign_results import CampaignResults
from ..results.compared_recording import drive_level
from ..sine.tracked_resonance import lost_levels, tracked_resonances


def laid_maps(results: CampaignResults, maps: Sequence[MapResults]) -> Iterator[DrawnFigure]:
    """Draw each map, with the levels and Responses I of everything that was measured under many sines."""
    levels = [
        RecordedLevel(each.analysis.facts.name, level, tuple(_measured(each, CurveKind.RESPONSE_I)))
        for each in results.in_order
        if len(level := drive_level(each)) > 1
    ]
    for number, found in enumerate(maps, start=1):
        drawn = map_figure(found, levels=levels if found.plan.is_over_drive else ())
        yield replace(drawn, name=f"map_{number}")


def _measured(result: AnyResult, *kinds: CurveKind) -> Iterator[Curve]:
    measured = ANALYSES[result.kind].curves(
        result.analysis.facts.name, CurveOrigin.MEASURED, result.analysis.response
    )
    return (curve for curve in measured if not kinds or curve.response in kinds)


def laid_branches(results: CampaignResults, diagrams: Sequence[BranchDiagram]) -> Iterator[DrawnFigure]:
    """Draw each diagram along frequency over everything that was measured under sines of many frequencies."""
    levels = [(each, level) for each in results.in_order if len(level := drive_level(each)) > 1]
    for number, diagram in enumerate(diagrams, start=1):
        if diagram.request.resonance_band_hz is not None:
            yield replace(_laid_backbone(results, diagram), name=f"branches_{number}")
            continue
        if diagram.request.along is not Parameter.FREQUENCY or not levels:
            yield replace(branches_figure(diagram), name=f"branches_{number}")
            continue
        curves = [curve for result, _ in levels for curve in _measured(result)]
        drawn = branches_figure(diagram, curves)
        said = " ".join(_level_sentence(diagram, result, level) for result, level in levels)
        yield replace(drawn, name=f"branches_{number}", caption=f"{drawn.caption} {said}")


def _laid_backbone(results: CampaignResults, diagram: BranchDiagram) -> DrawnFigure:
    """Draw a phase resonance beneath those that were tracked around it."""
    low_hz, high_hz = diagram.request.resonance_band_hz or (0.0, 0.0)
    facts = [each.analysis.facts for each in results.in_order]
    bands = [each.measurement.excitation.band_hz for each in facts]
    near = [
        each.feedback
        for each, band in zip(facts, bands, strict=True)
        if band[0] < high_hz and low_hz < band[1]
    ]
    tracked = [each for notes in near for each in tracked_resonances(notes)]
    drawn = branches_figure(diagram, tracked=tracked)
    said = [_lost_sentence(diagram, level) for notes in near for level in lost_levels(notes)]
    return replace(drawn, caption=" ".join((drawn.caption, *said)))


def _lost_sentence(diagram: BranchDiagram, level_m_per_s2: float) -> str:
    """Say what the model has at a level at which no resonance was found: multipliers, or no motion."""
    sizes: list[float] = []
    for line in diagram.lines:
        above = line.amplitude_m * (2.0 * np.pi * line.frequency_hz) ** 2 > level_m_per_s2
        sizes += line.largest_multiplier[1:][above[1:] != above[:-1]].tolist()
    told = f"At {level_m_per_s2:g} m/s² no periodic motion was locked on;"
    if not sizes:
        return f"{told} none of these branches has one there."
    multipliers = ", ".join(f"{each:.3g}" for each in sizes)
    return f"{told} the largest multiplier of the model's is {multipliers}."


def _level_sentence(diagram: BranchDiagram, result: AnyResult, level: tuple[tuple[float, float], ...]) -> str:
    """Say by what factor a recording's level lies above the branches', where both are."""
    request = diagram.request
    ratios = [
        amplitude / request.path.drive(frequency)[1]
        for frequency, amplitude in level
        if request.start <= frequency <= request.stop
    ]
    name = result.analysis.facts.name
    if not ratios:
        return f"{name} was driven outside of these frequencies."
    low, high = np.min(ratios), np.max(ratios)
    return f"The base of {name} moved {low:.2g} to {high:.2g} times as far as that of the branches."
