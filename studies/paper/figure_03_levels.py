"""Fig. 3: Responses I and II of the piece-wise model at the four amplitudes."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from vibench.analysis import report
from vibench.sim.study import Study, StudyResults

from .options import AMPLITUDES_M, FigureOptions
from .responses import Responses, draw_linear, draw_responses, responses, shade

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study of Hertz stops at the paper's four amplitudes."""
    return (options.study(("hertz",), AMPLITUDES_M),)


def draw(options: FigureOptions, results: StudyResults) -> report.DrawnFigure:
    """Draw the four levels, with colliding frequencies shaded."""
    specimen = options.specimen()

    def background(axes: "Axes", curve: Responses, _amplitude_m: float) -> None:
        shade(axes, curve.frequency_hz, curve.collides, "m1 and m2 collide")
        draw_linear(axes, curve.frequency_hz, specimen)

    return four_levels(
        "figure_3",
        "Figure 3: Responses I and II of the piece-wise model",
        f"Grey: frequencies at which m1 and m2 collided within the window. {options.sentence}",
        results,
        background,
    )


def four_levels(
    name: str,
    title: str,
    caption: str,
    results: StudyResults,
    background: Callable[["Axes", Responses, float], None],
) -> report.DrawnFigure:
    """Draw Responses I and II in one panel per amplitude; ``background`` draws behind the curves."""
    tables: list[report.Table] = []
    with report.figure_style():
        figure = report.new_figure(6.6)
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for number, (axes, amplitude_m) in enumerate(zip(panels.ravel(), AMPLITUDES_M, strict=True), 1):
            curve = responses(results, amplitude=amplitude_m)
            background(axes, curve, amplitude_m)
            draw_responses(axes, curve)
            axes.label_outer()
            axes.set_title(f"Case {number}: A0 = {1e6 * amplitude_m:g} µm")
            columns = curve.columns("response_i", "response_ii", "collides")
            tables.append(report.table(f"{name}_{1e6 * amplitude_m:g}um", **columns))
        report.legend_above(figure, list(panels.ravel()))
    return report.DrawnFigure(name, title, caption, figure, tuple(tables))
