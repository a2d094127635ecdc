"""Figures that compare continuous models with the piece-wise one (Figs. 1 and 7 to 9)."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import Similarity, SimilarityCurve, report, similarity
from vibench.sim import gong2025, spring_of
from vibench.sim.study import Study, StudyResults

from . import drawing
from .options import AMPLITUDES_M, Case
from .responses import Responses, responses

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_CUBIC = "power:3"
_ORDERS = (_CUBIC, "power:5", "power:7", "power:3+5+7")
EXTREME_ORDERS = ("power:29", "power:35", "power:47")
_SHOWN_FORCES = (*_ORDERS, EXTREME_ORDERS[-1])
_REACH = 48.0 / 45.0
"""Largest displacement shown, relative to the gap."""
_HIGHEST = 1.5
"""Largest force shown, relative to the largest contact force."""


def _study(options: Case, models: tuple[str, ...]) -> tuple[Study]:
    """Return the study of stops and models at the four amplitudes, on the frequency grid for comparison."""
    frequencies_hz = options.similarity_frequencies_hz
    return (options.study(("hertz", *models), AMPLITUDES_M, frequencies_hz=frequencies_hz),)


def similarity_of(options: Case, curves: Iterable[Responses], amplitude_m: float, what: str) -> Similarity:
    """Return the similarity of two models' curves at one amplitude, up to the highest frequency compared."""
    stops, continuous = (
        SimilarityCurve(curve.frequency_hz[within], getattr(curve, what)[within], amplitude_m)
        for curve in curves
        for within in [curve.frequency_hz <= options.similarity_highest_hz]
    )
    return similarity(stops, continuous, options.logarithm_of, options.threshold)


def _comparison(
    options: Case, results: StudyResults, model: str, amplitude_m: float, what: str
) -> Similarity:
    """Return the similarity of a continuous model and the piece-wise model at one amplitude."""
    curves = (responses(results, model=each, amplitude=amplitude_m) for each in ("hertz", model))
    return similarity_of(options, curves, amplitude_m, what)


def _rates_figure(number: str, subject: str, models: tuple[str, ...]) -> drawing.PaperFigure:
    """Return the figure of the similarity rates of several models over amplitude."""

    @drawing.paper_figure(number, subject, 3.3, lambda options: _study(options, models))
    def figure_of_rates(figure: "Figure", options: Case, results: StudyResults) -> drawing.Drawn:
        columns = {"amplitude_m": np.asarray(AMPLITUDES_M)}
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (what, heading) in zip(panels, drawing.RESPONSES.items(), strict=True):
            styles = zip(models, report.LEVELS, report.LEVEL_STYLES, strict=False)
            for place, (model, colour, line) in enumerate(styles):
                found = [_comparison(options, results, model, each, what) for each in AMPLITUDES_M]
                rate, low, high = np.array([(each.rate, each.low, each.high) for each in found]).T
                at = np.arange(rate.size) + 0.06 * (place - 0.5 * (len(models) - 1))
                reach = 100 * np.maximum([rate - low, high - rate], 0.0)
                label = drawing.model_label(model)
                axes.errorbar(at, 100 * rate, reach, fmt=f"o{line}", capsize=2, color=colour, label=label)
                short = f"{what}_{drawing.model_name(model).removeprefix('power_')}"
                columns |= {f"rate_{short}": rate, f"low_{short}": low, f"high_{short}": high}
            axes.set_xticks(range(len(AMPLITUDES_M)), [f"{1e6 * each:g}" for each in AMPLITUDES_M])
            axes.set(xlabel="A0 [µm]", title=heading)
        panels[0].set(ylim=(0, 100), ylabel="similar frequencies R [%]")
        report.legend_above(figure, [panels[0]], columns=5)
        return f"Bars: 95 % intervals by block bootstrap. {_definition(options)}", {"": columns}

    return figure_of_rates


def _definition(options: Case) -> str:
    """Return the criterion of similarity in words."""
    low_hz, *_, high_hz = options.similarity_frequencies_hz
    return (
        f"Similar: log10 of the response [{options.logarithm_of.value}] differs by at most "
        f"{options.threshold:.0%}, {low_hz:g} to {high_hz:g} Hz."
    )


@drawing.paper_figure("1 c", "forces of the models", 3.4)
def forces(figure: "Figure", options: Case) -> drawing.Drawn:
    """Draw force over relative displacement for all models."""
    p = np.linspace(0.0, _REACH * options.gap_m, 481)
    force_n = {
        model: spring_of(gong2025(options.damping_time_s, options.gap_m, model)).force(p, np.zeros_like(p))
        for model in ("hertz", *_SHOWN_FORCES)
    }
    axes = figure.subplots()
    axes.plot(1e6 * p, force_n["hertz"], color=report.MEASURED, linewidth=1.8, label="Hertz stops")
    axes.set_prop_cycle(color=report.LEVELS, linestyle=report.LEVEL_STYLES)
    for model in _SHOWN_FORCES:
        axes.plot(1e6 * p, force_n[model], label=drawing.model_label(model))
    axes.axvline(1e6 * options.gap_m, color=drawing.GREY, linewidth=0.8)
    axes.set(
        ylim=(0, _HIGHEST * float(force_n["hertz"].max())),
        xlim=(0, 1e6 * float(p[-1])),
        xlabel="relative displacement p [µm]",
        ylabel="force between m1 and m2 [N]",
    )
    report.legend_above(figure, [axes])
    columns = {f"force_{drawing.model_name(model)}_n": values for model, values in force_n.items()}
    caption = (
        f"Force of the stops (gap {1e6 * options.gap_m:g} µm, grey line) and of the continuous models, "
        "which have the same force 1 µm beyond the gap. The terms of the sum 3+5+7 have equal shares of "
        "this force, because the paper gives no shares."
    )
    return caption, {"": {"relative_displacement_m": p, **columns}}


@drawing.paper_figure(
    "7", "similarity of the cubic and the piece-wise model", 8.6, lambda options: _study(options, (_CUBIC,))
)
def cubic(figure: "Figure", options: Case, results: StudyResults) -> drawing.Drawn:
    """Draw both models at four amplitudes; shade frequencies of similar response; put the rates in titles."""
    styles = {
        "hertz": (report.MEASURED, "-", "piece-wise"),
        _CUBIC: (report.SIMULATED, "--", "continuous, n = 3"),
    }
    columns = {"frequency_hz": np.asarray(results.study.frequencies_hz)}
    panels = figure.subplots(4, 2, sharex=True, sharey=True)
    for number, (row, amplitude_m) in enumerate(zip(panels, AMPLITUDES_M, strict=True), 1):
        for axes, (what, heading) in zip(row, drawing.RESPONSES.items(), strict=True):
            found = _comparison(options, results, _CUBIC, amplitude_m, what)
            drawing.shade(axes, found.frequency_hz, found.is_similar, "similar")
            for model, (colour, line, label) in styles.items():
                values = getattr(responses(results, model=model, amplitude=amplitude_m), what)
                axes.plot(found.frequency_hz, values, color=colour, linestyle=line, label=label)
            drawing.finish(axes, found.frequency_hz, "x of m0 / A0")
            axes.label_outer()
            rate = f"{found.rate:.0%} ({found.low:.0%} to {found.high:.0%})"
            axes.set_title(f"Case {number}, {1e6 * amplitude_m:g} µm, {heading}: R = {rate}")
            columns[f"difference_{what}_{1e6 * amplitude_m:g}um"] = found.difference
    report.legend_above(figure, [panels[0, 0]])
    return f"Grey: similar frequencies. {_definition(options)}", {"": columns}


orders = _rates_figure("8", "similarity of several orders", _ORDERS)
extreme_orders = _rates_figure("9", "similarity of extreme orders", EXTREME_ORDERS)
