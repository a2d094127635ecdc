"""Branches laid over the stepped sines and sweeps of a campaign, with how far their levels agree."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vibench.sim import Parameter

from ..comparison import CurveOrigin
from ..dynamics import BranchDiagram
from ..figures import DrawnFigure, branches_figure
from ..kinds import ANALYSES, AnyResult
from ..results import CampaignResults, drive_level


def laid_branches(results: CampaignResults, diagrams: Sequence[BranchDiagram]) -> Iterator[DrawnFigure]:
    """Draw each diagram along frequency over everything that was measured under sines of many frequencies."""
    levels = [(each, level) for each in results.in_order if len(level := drive_level(each)) > 1]
    for number, diagram in enumerate(diagrams, start=1):
        if diagram.request.along is not Parameter.FREQUENCY or not levels:
            yield replace(branches_figure(diagram), name=f"branches_{number}")
            continue
        curves = [
            curve
            for result, _ in levels
            for curve in ANALYSES[result.kind].curves(
                result.analysis.facts.name, CurveOrigin.MEASURED, result.analysis.response
            )
        ]
        drawn = branches_figure(diagram, curves)
        said = " ".join(_level_sentence(diagram, result, level) for result, level in levels)
        yield replace(drawn, name=f"branches_{number}", caption=f"{drawn.caption} {said}")


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
