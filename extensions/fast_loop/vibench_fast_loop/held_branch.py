"""A branch held by a fast loop: its points in recorded order, and a figure with the model's branch."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import nan
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibench.acquisition.recording import (
    BranchEndNote,
    BranchPointNote,
    BranchStabilityNote,
    FeedbackNote,
    Stability,
)
from vibench.analysis.recordings.facts import specimen_of
from vibench.analysis.report import (
    MEASURED,
    SIMULATED,
    STEPPED,
    DrawnFigure,
    figure_style,
    legend_above,
    new_figure,
    with_prefix,
)
from vibench.analysis.signals import Reals
from vibench.analysis.sine.stepped_response import SteppedSineAnalysis
from vibench.analysis.tables import Tabular, rows, table
from vibench.sim import Branch, Specimen

from .fast_loop import impact_branch

_LEAST = 3
"""Minimum number of points for finding a turn of the frequency along the branch."""


@dataclass(frozen=True)
class HeldBranch(Tabular):
    """Motions of one branch in recorded order; arrays of shape (points,)."""

    frequency_hz: Reals
    base_m: Reals
    m0_m: Reals
    phase_deg: Reals
    """Phase of m0 relative to the base, both as displacements."""
    residue: Reals
    """Rms of the second and higher harmonics of the base displacement, relative to its fundamental."""
    residue_acceleration: Reals
    stability: tuple[str, ...]
    """Stability without feedback for a sinusoidal base: values of `Stability`; empty if not measured."""
    multiplier: Reals
    """Largest multiplier over a period, estimated from small perturbations; NaN if undetermined."""
    multiplier_u: Reals

    @property
    def folds(self) -> tuple[int, ...]:
        """Indices of points at which the frequency turned; between two turns, the branch runs backwards."""
        if self.frequency_hz.size < _LEAST:
            return ()
        ways = np.sign(np.diff(self.frequency_hz))
        return tuple(int(each) + 1 for each in np.flatnonzero(ways[1:] != ways[:-1]))


def held_branch(notes: Sequence[FeedbackNote]) -> HeldBranch:
    """Return the points in the notes of a fast loop; empty arrays if there are none."""
    points = [each for each in notes if isinstance(each, BranchPointNote)]
    by_point = {each.point: each for each in notes if isinstance(each, BranchStabilityNote)}
    stabilities = [by_point.get(each.point) for each in points]
    sizes = [(nan, nan) if each is None else (each.multiplier, each.multiplier_u) for each in stabilities]
    multiplier, multiplier_u = np.array(sizes, dtype=np.float64).reshape(-1, 2).T
    return HeldBranch(
        **rows(points, "frequency_hz base_m m0_m phase_deg residue residue_acceleration"),
        stability=tuple("" if each is None else each.stability.value for each in stabilities),
        multiplier=multiplier,
        multiplier_u=multiplier_u,
    )


def branch_sentences(notes: Sequence[FeedbackNote]) -> tuple[str, ...]:
    """Return sentences on the extent of a branch, its turning points and its end."""
    found, ends = held_branch(notes), [each for each in notes if isinstance(each, BranchEndNote)]
    if not found.frequency_hz.size:
        return ("No motion of the branch was held.",)
    size_um = 1e6 * found.base_m
    held = (
        f"{found.frequency_hz.size} motions were held. The base moved by {size_um.min():.4g} to "
        f"{size_um.max():.4g} µm; its harmonics were at most {found.residue.max():.2g} of the fundamental "
        f"({found.residue_acceleration.max():.2g} in acceleration)."
    )
    sentences = [held]
    if found.folds:
        turns = ", ".join(f"{found.frequency_hz[each]:.5g}" for each in found.folds)
        sentences.append(f"The branch turned at {turns} Hz.")
    if any(found.stability):
        counts = ", ".join(f"{found.stability.count(each.value)} {each.value}" for each in Stability)
        sentences.append(
            f"Without feedback, the motions are {counts}, measured with small perturbations of the drive."
        )
    sentences.extend(f"The branch ended because {each.end.value}." for each in ends)
    return tuple(sentences)


_HEIGHT_IN = 4.4
_ROOM_HZ = 1.0
"""Frequency margin of the model's branch beyond the held points [Hz]."""


def held_branch_figure(analysis: SteppedSineAnalysis) -> DrawnFigure:
    """Draw the amplitude of m0 over frequency at the held points, with the model's branch."""
    found = held_branch(analysis.facts.feedback)
    scale, unit = with_prefix(float(np.max(found.m0_m, initial=1e-9)), "m")
    with figure_style():
        figure = new_figure(_HEIGHT_IN)
        axes: Axes = figure.subplots(1, 1)
        model = model_branch(found, specimen_of(analysis.facts.bench))
        if model is not None:
            _model(axes, model, scale)
        for label, chosen, marks in _groups(found):
            if chosen.any():
                look = {"color": MEASURED, "linestyle": "none", "label": label, **marks}
                axes.plot(found.frequency_hz[chosen], scale * found.m0_m[chosen], **look)
        axes.set(xlabel="drive frequency [Hz]", ylabel=f"amplitude of m0 [{unit}]")
        legend_above(figure, [axes], columns=2)
    name = f"branch_{analysis.facts.name}"
    return DrawnFigure(
        name=name,
        title=f"Branch held by a fast loop, {analysis.excitation.level_text}",
        caption=" ".join(branch_sentences(analysis.facts.feedback)),
        figure=figure,
        tables=(table(name, **{each.name: getattr(found, each.name) for each in fields(found)}),),
    )


def _groups(found: HeldBranch) -> tuple[tuple[str, NDArray[np.bool_], dict[str, Any]], ...]:
    """Return label, points and plot style: by stability if it was measured, else by branch direction."""
    filled: dict[str, Any] = {"marker": "o"}
    empty = filled | {"markerfacecolor": "white"}
    if any(found.stability):
        stability = np.array(found.stability)
        return (
            ("held, stable without feedback", stability == Stability.STABLE.value, filled),
            ("held, unstable without feedback", stability == Stability.UNSTABLE.value, empty),
            ("held, stability not determined", stability == Stability.OPEN.value, {"marker": "x"}),
            ("held", stability == "", {"marker": "."}),
        )
    back = np.zeros(found.frequency_hz.size, dtype=bool)
    for first, last in zip(found.folds[::2], found.folds[1::2], strict=False):
        back[first + 1 : last] = True
    return ("held", ~back, filled), ("held, after a fold", back, empty)


def model_branch(found: HeldBranch, specimen: Specimen) -> Branch | None:
    """Return the model's branch over the range of the held points; None if the model has no motion there."""
    if not found.frequency_hz.size:
        return None
    amplitude_m, first_hz = float(np.median(found.base_m)), float(found.frequency_hz[0])
    range_hz = float(found.frequency_hz.min()) - _ROOM_HZ, float(found.frequency_hz.max()) + _ROOM_HZ
    return impact_branch(specimen, amplitude_m, first_hz, range_hz, "rest")


def _model(axes: Axes, model: Branch, scale: float) -> None:
    m0 = scale * model.response_ii[:, 0] * model.amplitudes_m
    for chosen, style, label in (
        (model.is_stable, "-", "model, stable"),
        (~model.is_stable, "--", "model, not stable"),
    ):
        if chosen.any():
            near = chosen | np.roll(chosen, 1)
            part = np.where(near, m0, np.nan)
            axes.plot(model.frequencies_hz, part, style, color=SIMULATED, linewidth=1.0, label=label)


HELD_BRANCH = replace(
    STEPPED,
    figures=lambda branch: iter((held_branch_figure(branch.analysis),)),
    findings=lambda branch: iter(branch_sentences(branch.analysis.facts.feedback)),
)
