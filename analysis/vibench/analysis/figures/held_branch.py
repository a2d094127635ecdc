"""A branch that a fast loop held, over the model's: stable motions solid, unstable ones dashed."""

from dataclasses import fields
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibench.acquisition.recording import Stability
from vibench.sim import (
    Branch,
    FrequencyPath,
    Harmonic,
    ShootingEnd,
    Specimen,
    periodic_branch_within,
    periodic_orbit,
)

from ..recordings.facts import specimen_of
from ..sine.held_branch import HeldBranch, branch_sentences, held_branch
from ..sine.stepped_response import SteppedSineAnalysis
from ..tables import named, table
from .style import MEASURED, SIMULATED, DrawnFigure, legend_above, new_figure, prefixed, styled

_HEIGHT_IN = 4.4
_ROOM_HZ = 1.0
"""Of the model's branch beyond the points held."""


def held_branch_figure(analysis: SteppedSineAnalysis) -> DrawnFigure:
    """Draw amplitude and phase of m0 over frequency, in the order held, on the model's branch."""
    found = held_branch(analysis.facts.feedback)
    scale, unit = prefixed(float(np.max(found.m0_m, initial=1e-9)), "m")
    with styled():
        figure = new_figure(_HEIGHT_IN)
        axes: Axes = figure.subplots(1, 1)
        model = model_branch(found, specimen_of(analysis.facts.bench))
        if model is not None:
            _model(axes, model, scale)
        for label, chosen, marks in _groups(found):
            if chosen.any():
                axes.plot(
                    found.frequency_hz[chosen], scale * found.m0_m[chosen], color=MEASURED,
                    markersize=4, linestyle="none", label=label, **marks,
                )  # fmt: skip
        axes.set_xlabel("drive frequency [Hz]")
        axes.set_ylabel(f"amplitude of m0 [{unit}]")
        legend_above(figure, [axes], columns=2)
    name = f"branch_{analysis.facts.name}"
    return DrawnFigure(
        name=name,
        title=f"Branch held by a fast loop, {analysis.excitation.level_text}",
        caption=" ".join(branch_sentences(analysis.facts.feedback)),
        figure=figure,
        tables=(table(name, **named(found, *(each.name for each in fields(found)))),),
    )


def _groups(found: HeldBranch) -> tuple[tuple[str, NDArray[np.bool_], dict[str, Any]], ...]:
    """Sort points, with their marks: by their stability where it was asked for, else by the turns."""
    filled: dict[str, Any] = {"marker": "o"}
    empty = filled | {"markerfacecolor": "white"}
    if any(found.stability):
        told = np.array(found.stability)
        return (
            ("held, stable without feedback", told == Stability.STABLE.value, filled),
            ("held, unstable without feedback", told == Stability.UNSTABLE.value, empty),
            ("held, stability not determined", told == Stability.OPEN.value, {"marker": "x"}),
            ("held", told == "", {"marker": "."}),
        )
    back = np.zeros(found.frequency_hz.size, dtype=bool)
    for first, last in zip(found.folds[::2], found.folds[1::2], strict=False):
        back[first + 1 : last] = True
    return ("held", ~back, filled), ("held, on the way back", back, empty)


def model_branch(found: HeldBranch, specimen: Specimen) -> Branch | None:
    """Follow the model's branch through the range of the points held; None where it has no start there."""
    if not found.frequency_hz.size:
        return None
    amplitude_m = float(np.median(found.base_m))
    first_hz = float(found.frequency_hz[0])
    low, high = float(found.frequency_hz.min()) - _ROOM_HZ, float(found.frequency_hz.max()) + _ROOM_HZ
    orbit = periodic_orbit(specimen, Harmonic(first_hz, amplitude_m))
    if orbit.outcome is not ShootingEnd.CONVERGED:
        return None
    return periodic_branch_within(orbit, FrequencyPath((amplitude_m,)), low, high)


def _model(axes: Axes, model: Branch, scale: float) -> None:
    m0 = scale * model.response_ii[:, 0] * model.amplitudes_m
    for chosen, style, label in (
        (model.is_stable, "-", "model, stable"),
        (~model.is_stable, "--", "model, unstable"),
    ):
        if chosen.any():
            near = chosen | np.roll(chosen, 1)
            axes.plot(
                model.frequencies_hz, np.where(near, m0, np.nan),
                color=SIMULATED, linestyle=style, linewidth=1.0, label=label,
            )  # fmt: skip
