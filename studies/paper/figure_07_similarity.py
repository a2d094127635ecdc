"""Figs. 7 to 9: how similar the continuous models are to the piece-wise one."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from vibench.analysis import Similarity, SimilarityCurve, similarity
from vibench.analysis.report import (
    LEVEL_STYLES,
    LEVELS,
    MEASURED,
    SIMULATED,
    DrawnFigure,
    legend_above,
    new_figure,
    styled,
    table,
)
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, CASES, FigureOptions
from .responses import Reals, finish, responses, shade

_PIECE_WISE = "hertz"
ORDERS = ("power:3", "power:5", "power:7", "power:3+5+7")
EXTREME_ORDERS = ("power:29", "power:35", "power:47")
_RESPONSES = ("response_i", "response_ii")
_TITLES = ("Response I", "Response II")


def cubic_study(options: FigureOptions) -> Study:
    """Fig. 7: n = 3 against the stops."""
    return _study(options, ("power:3",))


def orders_study(options: FigureOptions) -> Study:
    """Fig. 8: n = 3, 5, 7 and their sum."""
    return _study(options, ORDERS)


def extreme_study(options: FigureOptions) -> Study:
    """Fig. 9: n = 29, 35 and 47."""
    return _study(options, EXTREME_ORDERS)


def _study(options: FigureOptions, models: tuple[str, ...]) -> Study:
    return options.study(
        (_PIECE_WISE, *models), AMPLITUDES_M, frequencies_hz=options.similarity_frequencies_hz
    )


def compared(
    options: FigureOptions, results: StudyResults, model: str, amplitude_m: float, what: str
) -> Similarity:
    """Compare one continuous model with the piece-wise one at one amplitude."""
    curves = [
        SimilarityCurve(
            np.asarray(results.study.frequencies_hz), _values(results, each, amplitude_m, what), amplitude_m
        )
        for each in (_PIECE_WISE, model)
    ]
    return similarity(curves[0], curves[1], options.logarithm_of, options.threshold)


def _values(results: StudyResults, model: str, amplitude_m: float, what: str) -> Reals:
    values: Reals = getattr(responses(results, model=model, amplitude=amplitude_m), what)
    return values


def cubic_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 7: both models at four amplitudes, similar frequencies shaded, the rates in the titles."""
    columns: dict[str, Reals] = {"frequency_hz": np.asarray(results.study.frequencies_hz)}
    with styled():
        figure = new_figure(8.6)
        panels = figure.subplots(4, 2, sharex=True, sharey=True)
        for row, amplitude_m, case in zip(panels, AMPLITUDES_M, CASES, strict=True):
            for axes, what, title in zip(row, _RESPONSES, _TITLES, strict=True):
                found = compared(options, results, "power:3", amplitude_m, what)
                _pair(axes, results, found, amplitude_m, what)
                axes.set_title(f"{case}, {1e6 * amplitude_m:g} µm, {title}: R = {_rate(found)}")
                columns[f"difference_{what}_{1e6 * amplitude_m:g}um"] = found.difference
        for axes in panels[-1]:
            axes.set_xlabel("drive frequency [Hz]")
        for axes in panels[:, 1]:
            axes.set_ylabel("")
        legend_above(figure, [panels[0, 0]])
    return DrawnFigure(
        name="figure_7",
        title="Figure 7: similarity of the cubic and the piece-wise model",
        caption=f"Grey: similar frequencies. {_definition(options)} {options.sentence}",
        figure=figure,
        tables=(table("figure_7", **columns),),
    )


def _pair(axes: Axes, results: StudyResults, found: Similarity, amplitude_m: float, what: str) -> None:
    shade(axes, found.frequency_hz, found.is_similar, "similar")
    for model, colour, line, label in (
        (_PIECE_WISE, MEASURED, "-", "piece-wise"),
        ("power:3", SIMULATED, "--", "continuous, n = 3"),
    ):
        values = _values(results, model, amplitude_m, what)
        axes.plot(found.frequency_hz, values, color=colour, linestyle=line, label=label)
    finish(axes, found.frequency_hz, "x of m0 / A0")


def orders_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 8: the rates of n = 3, 5, 7 and of their sum."""
    return _rates_figure("figure_8", "Figure 8: similarity of several orders", ORDERS, options, results)


def extreme_figure(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw Fig. 9: the rates of n = 29, 35 and 47."""
    return _rates_figure(
        "figure_9", "Figure 9: similarity of extreme orders", EXTREME_ORDERS, options, results
    )


def _rates_figure(
    name: str, title: str, models: Sequence[str], options: FigureOptions, results: StudyResults
) -> DrawnFigure:
    columns: dict[str, Reals] = {"amplitude_m": np.asarray(AMPLITUDES_M)}
    with styled():
        figure = new_figure(3.3)
        panels = figure.subplots(1, 2, sharey=True)
        for axes, what, heading in zip(panels, _RESPONSES, _TITLES, strict=True):
            for place, (model, colour, line) in enumerate(zip(models, LEVELS, LEVEL_STYLES, strict=False)):
                found = [compared(options, results, model, each, what) for each in AMPLITUDES_M]
                _rates(axes, found, place - 0.5 * (len(models) - 1), colour, line, model)
                short = f"{what}_{model.removeprefix('power:').replace('+', '_')}"
                for part in ("rate", "low", "high"):
                    columns[f"{part}_{short}"] = np.array([getattr(each, part) for each in found])
            axes.set_xticks(range(len(AMPLITUDES_M)), [f"{1e6 * each:g}" for each in AMPLITUDES_M])
            axes.set_xlabel("A0 [µm]")
            axes.set_title(heading)
        panels[0].set_ylim(0, 100)
        panels[0].set_ylabel("similar frequencies R [%]")
        legend_above(figure, [panels[0]], columns=5)
    return DrawnFigure(
        name=name,
        title=title,
        caption=f"Bars: 95 % intervals by block bootstrap. {_definition(options)} {options.sentence}",
        figure=figure,
        tables=(table(name, **columns),),
    )


def _rates(axes: Axes, found: Sequence[Similarity], place: float, colour: str, line: str, model: str) -> None:
    rate = np.array([each.rate for each in found])
    apart = np.array([[each.rate - each.low, each.high - each.rate] for each in found]).T
    axes.errorbar(
        np.arange(len(found)) + 0.06 * place,
        100 * rate,
        100 * np.maximum(apart, 0.0),
        color=colour,
        linestyle=line,
        marker="o",
        markersize=3,
        capsize=2,
        label=f"n = {model.removeprefix('power:')}",
    )


def _rate(found: Similarity) -> str:
    return f"{found.rate:.0%} ({found.low:.0%} to {found.high:.0%})"


def _definition(options: FigureOptions) -> str:
    return (
        f"Similar: log10 of the response [{options.logarithm_of.value}] differs by at most "
        f"{options.threshold:.0%}, {options.similarity_frequencies_hz[0]:g} to "
        f"{options.similarity_frequencies_hz[-1]:g} Hz."
    )
