"""Figs. 3 and 6: Responses I and II at the four amplitudes, of the stops and of the model n = 5."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from vibench.analysis.dynamics import BranchMethod, BranchRequest, diagram_of
from vibench.analysis.report import (
    MEASURED,
    SIMULATED,
    TERMINAL,
    DrawnFigure,
    Table,
    draw_line,
    legend_above,
    new_figure,
    styled,
    table,
)
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, CASES, FigureOptions
from .responses import Responses, draw_linear, finish, responses, shade

_CONTINUOUS = "power:5"
_PLACES = 60
"""Frequencies at which every first-order solution is found in closed form: each begins a branch."""


def levels_study(options: FigureOptions, model: str = "hertz") -> Study:
    """One model at the paper's four amplitudes."""
    return options.study((model,), AMPLITUDES_M)


def continuous_study(options: FigureOptions) -> Study:
    """Study the continuous model n = 5 of Fig. 6."""
    return levels_study(options, _CONTINUOUS)


def levels_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 3: the piece-wise model, colliding frequencies shaded."""
    specimen = options.specimen()

    def draw(axes: Axes, curve: Responses, _amplitude_m: float) -> None:
        shade(axes, curve.frequency_hz, curve.collides, "m1 and m2 collide")
        draw_linear(axes, curve.frequency_hz, specimen)

    return _four_panels(
        "figure_3",
        "Figure 3: Responses I and II of the piece-wise model",
        f"Grey: frequencies at which m1 and m2 collided within the window. {options.sentence}",
        results,
        draw,
    )


def continuous_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 6: the continuous model n = 5, first-order harmonic balance over integration."""

    def draw(axes: Axes, curve: Responses, amplitude_m: float) -> None:
        found = diagram_of(
            BranchRequest(
                model=_CONTINUOUS,
                damping_time_s=options.only_damping_time_s,
                gap_m=options.gap_m,
                method=BranchMethod.FIRST_ORDER,
                amplitude_m=amplitude_m,
                start=float(curve.frequency_hz[0]),
                stop=float(curve.frequency_hz[-1]),
                places=_PLACES,
            )
        )
        for line in found.lines:
            draw_line(axes, line, line.frequency_hz, line.response_ii[:, 0])
        for number, at_hz in enumerate(
            each.frequency_hz for line in found.lines for each in line.events if each.kind == "fold"
        ):
            named = "fold: a jump" if number == 0 else None
            axes.axvline(at_hz, color=TERMINAL, linestyle=":", linewidth=0.8, label=named)

    return _four_panels(
        "figure_6",
        "Figure 6: Responses I and II of the continuous model, n = 5",
        "Blue: branches of the paper's first-order balance, unstable ones dashed; dotted: where they fold. "
        + options.sentence,
        results,
        draw,
    )


def _four_panels(
    name: str,
    title: str,
    said: str,
    results: StudyResults,
    draw: Callable[[Axes, Responses, float], None],
) -> DrawnFigure:
    tables: list[Table] = []
    with styled():
        figure = new_figure(6.6)
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, amplitude_m, case in zip(panels.ravel(), AMPLITUDES_M, CASES, strict=True):
            curve = responses(results, amplitude=amplitude_m)
            draw(axes, curve, amplitude_m)
            axes.plot(curve.frequency_hz, curve.response_i, color=MEASURED, label="Response I")
            axes.plot(
                curve.frequency_hz, curve.response_ii, color=SIMULATED, linestyle="-.", label="Response II"
            )
            finish(axes, curve.frequency_hz, "response of m0 over A0")
            axes.set_title(f"{case}: A0 = {1e6 * amplitude_m:g} µm")
            tables.append(_table(name, amplitude_m, curve))
        for axes in panels[1]:
            axes.set_xlabel("drive frequency [Hz]")
        for axes in panels[:, 1]:
            axes.set_ylabel("")
        legend_above(figure, list(panels.ravel()))
    return DrawnFigure(name, title, said, figure, tuple(tables))


def _table(name: str, amplitude_m: float, curve: Responses) -> Table:
    return table(
        f"{name}_{1e6 * amplitude_m:g}um",
        frequency_hz=curve.frequency_hz,
        response_i=curve.response_i,
        response_ii=curve.response_ii,
        collides=curve.collides.astype(np.int64),
    )
