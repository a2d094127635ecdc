"""Fig. 7: the cubic and the piece-wise model at four amplitudes, and the frequencies where both agree."""

import numpy as np

from vibench.analysis import report
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, FigureOptions
from .responses import Reals, finish, responses, shade
from .similarity_rates import RESPONSES, compare_model, definition, similarity_study

_MODEL = "power:3"
_STYLES = {
    "hertz": (report.MEASURED, "-", "piece-wise"),
    _MODEL: (report.SIMULATED, "--", "continuous, n = 3"),
}


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study of the cubic and the piece-wise model."""
    return (similarity_study(options, (_MODEL,)),)


def draw(options: FigureOptions, results: StudyResults) -> report.DrawnFigure:
    """Draw both models at four amplitudes; shade frequencies of similar response; titles state the rates."""
    columns: dict[str, Reals] = {"frequency_hz": np.asarray(results.study.frequencies_hz)}
    with report.figure_style():
        figure = report.new_figure(8.6)
        panels = figure.subplots(4, 2, sharex=True, sharey=True)
        for number, (row, amplitude_m) in enumerate(zip(panels, AMPLITUDES_M, strict=True), 1):
            for axes, (what, heading) in zip(row, RESPONSES.items(), strict=True):
                found = compare_model(options, results, _MODEL, amplitude_m, what)
                shade(axes, found.frequency_hz, found.is_similar, "similar")
                for model, (colour, line, label) in _STYLES.items():
                    values = getattr(responses(results, model=model, amplitude=amplitude_m), what)
                    axes.plot(found.frequency_hz, values, color=colour, linestyle=line, label=label)
                finish(axes, found.frequency_hz, "x of m0 / A0")
                axes.label_outer()
                rate = f"{found.rate:.0%} ({found.low:.0%} to {found.high:.0%})"
                axes.set_title(f"Case {number}, {1e6 * amplitude_m:g} µm, {heading}: R = {rate}")
                columns[f"difference_{what}_{1e6 * amplitude_m:g}um"] = found.difference
        report.legend_above(figure, [panels[0, 0]])
    return report.DrawnFigure(
        name="figure_7",
        title="Figure 7: similarity of the cubic and the piece-wise model",
        caption=f"Grey: similar frequencies. {definition(options)} {options.sentence}",
        figure=figure,
        tables=(report.table("figure_7", **columns),),
    )
