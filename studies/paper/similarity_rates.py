"""Similarity of the continuous models and the piece-wise one (eqs. 6 and 7), for Figs. 7 to 9."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import Similarity, SimilarityCurve, report, similarity
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, FigureOptions
from .responses import Reals, responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RESPONSES = {"response_i": "Response I", "response_ii": "Response II"}


def similarity_study(options: FigureOptions, models: tuple[str, ...]) -> Study:
    """Return the study of stops and models at the four amplitudes, on the frequency grid for comparison."""
    return options.study(("hertz", *models), AMPLITUDES_M, frequencies_hz=options.similarity_frequencies_hz)


def compare_model(
    options: FigureOptions, results: StudyResults, model: str, amplitude_m: float, what: str
) -> Similarity:
    """Return the similarity of a continuous model and the piece-wise model at one amplitude."""
    stops, continuous = (
        SimilarityCurve(curve.frequency_hz, getattr(curve, what), amplitude_m)
        for curve in (responses(results, model=each, amplitude=amplitude_m) for each in ("hertz", model))
    )
    return similarity(stops, continuous, options.logarithm_of, options.threshold)


def rates_figure(
    name: str, title: str, models: Sequence[str], options: FigureOptions, results: StudyResults
) -> report.DrawnFigure:
    """Draw the similarity rates of several models over amplitude."""
    columns: dict[str, Reals] = {"amplitude_m": np.asarray(AMPLITUDES_M)}
    with report.figure_style():
        figure = report.new_figure(3.3)
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (what, heading) in zip(panels, RESPONSES.items(), strict=True):
            for place, (model, colour, line) in enumerate(
                zip(models, report.LEVELS, report.LEVEL_STYLES, strict=False)
            ):
                found = [compare_model(options, results, model, each, what) for each in AMPLITUDES_M]
                _draw_rates(axes, found, place - 0.5 * (len(models) - 1), colour, line, model)
                short = f"{what}_{model.removeprefix('power:').replace('+', '_')}"
                for part in ("rate", "low", "high"):
                    columns[f"{part}_{short}"] = np.array([getattr(each, part) for each in found])
            axes.set_xticks(range(len(AMPLITUDES_M)), [f"{1e6 * each:g}" for each in AMPLITUDES_M])
            axes.set(xlabel="A0 [µm]", title=heading)
        panels[0].set(ylim=(0, 100), ylabel="similar frequencies R [%]")
        report.legend_above(figure, [panels[0]], columns=5)
    caption = f"Bars: 95 % intervals by block bootstrap. {definition(options)} {options.sentence}"
    return report.DrawnFigure(name, title, caption, figure, (report.table(name, **columns),))


def _draw_rates(
    axes: "Axes", found: Sequence[Similarity], place: float, colour: str, line: str, model: str
) -> None:
    apart = np.array([[each.rate - each.low, each.high - each.rate] for each in found]).T
    at, rates = np.arange(len(found)) + 0.06 * place, [100 * each.rate for each in found]
    reach, label = 100 * np.maximum(apart, 0.0), f"n = {model.removeprefix('power:')}"
    axes.errorbar(at, rates, reach, fmt=f"o{line}", capsize=2, color=colour, label=label)


def definition(options: FigureOptions) -> str:
    """Return the criterion of similarity in words."""
    low_hz, *_, high_hz = options.similarity_frequencies_hz
    return (
        f"Similar: log10 of the response [{options.logarithm_of.value}] differs by at most "
        f"{options.threshold:.0%}, {low_hz:g} to {high_hz:g} Hz."
    )
