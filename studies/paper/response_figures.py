"""Figures of Responses I and II over frequency (Figs. 3, 5, 6 and 11)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import InvalidRequest, report
from vibench.analysis.dynamics import BranchMethod, BranchRequest, diagram_of
from vibench.sim.study import Study, StudyResults

from . import drawing
from .options import AMPLITUDES_M, Case
from .responses import Responses, responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LOW_M, _HIGH_M = 5e-6, 7e-6
_MODEL = "power:5"
_PLACES = 60
"""Number of frequencies at which closed-form first-order solutions are used to start branches."""
GAPS_M = (5e-6, 15e-6, 30e-6, 45e-6, 60e-6)
"""Gaps of Fig. 11 [m]; chosen for this figure, because the text of the paper does not give them."""


def _levels_figure(
    number: str,
    subject: str,
    model: str,
    caption: str,
    draw_background: Callable[["Axes", Responses, Case, float], None],
) -> drawing.PaperFigure:
    """Return the figure of Responses I and II of a model, in one panel per amplitude."""

    @drawing.paper_figure(number, subject, 6.6, lambda options: (options.study((model,), AMPLITUDES_M),))
    def figure_of_levels(figure: "Figure", options: Case, results: StudyResults) -> drawing.Drawn:
        tables = {}
        panels = list(figure.subplots(2, 2, sharex=True, sharey=True).ravel())
        for case, (axes, amplitude_m) in enumerate(zip(panels, AMPLITUDES_M, strict=True), 1):
            curve = responses(results, amplitude=amplitude_m)
            draw_background(axes, curve, options, amplitude_m)
            drawing.draw_responses(axes, curve)
            axes.label_outer()
            axes.set_title(f"Case {case}: A0 = {1e6 * amplitude_m:g} µm")
            tables[f"_{1e6 * amplitude_m:g}um"] = curve.columns(*drawing.RESPONSES, "collides")
        report.legend_above(figure, panels)
        return caption, tables

    return figure_of_levels


def _draw_collisions(axes: "Axes", curve: Responses, options: Case, _amplitude_m: float) -> None:
    drawing.shade(axes, curve.frequency_hz, curve.collides, "m1 and m2 collide")
    drawing.draw_linear(axes, curve.frequency_hz, options.specimen())


def _draw_branches(axes: "Axes", curve: Responses, options: Case, amplitude_m: float) -> None:
    found = diagram_of(
        BranchRequest(
            model=_MODEL,
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
        report.draw_line(axes, line, line.frequency_hz, line.response_ii[:, 0])
    folds_hz = [each.frequency_hz for line in found.lines for each in line.events if each.kind == "fold"]
    for at_hz in folds_hz:
        axes.axvline(at_hz, color=report.TERMINAL, linestyle=":", linewidth=0.8, label="fold: a jump")


levels = _levels_figure(
    "3",
    "Responses I and II of the piece-wise model",
    "hertz",
    "Grey: frequencies at which m1 and m2 collided within the window.",
    _draw_collisions,
)
continuous = _levels_figure(
    "6",
    "Responses I and II of the continuous model, n = 5",
    _MODEL,
    "Blue: branches of the paper's first-order balance (dashed: unstable); dotted: their folds.",
    _draw_branches,
)


def _damping_studies(options: Case) -> tuple[Study, ...]:
    """Return the study with and without damping, at 5 and 7 um; raises InvalidRequest if damping is zero."""
    damped_s = options.only_damping_time_s
    if damped_s == 0.0:
        raise InvalidRequest("figure 5 compares with an undamped specimen; give a damping time above 0 s")
    return (options.study(("hertz",), (_LOW_M, _HIGH_M), damping_times_s=(0.0, damped_s)),)


@drawing.paper_figure("5", "influence of damping and of the amplitude", 6.2, _damping_studies)
def damping(figure: "Figure", options: Case, results: StudyResults) -> drawing.Drawn:
    """Draw both comparisons for Responses I and II, with the regions of collisions as bars."""
    damped = responses(results, damping_time=options.damping_time_s, amplitude=_LOW_M)
    undamped = responses(results, damping_time=0.0, amplitude=_LOW_M)
    higher = responses(results, damping_time=options.damping_time_s, amplitude=_HIGH_M)
    rows = ({"with damping": damped, "without damping": undamped}, {"A0 = 5 µm": damped, "A0 = 7 µm": higher})
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, curves in zip(panels, rows, strict=True):
        for axes, what in zip(row, drawing.RESPONSES, strict=True):
            _compare(axes, curves, what)
            axes.label_outer()
        row[0].legend(loc="center left")
    for axes, heading in zip(panels[0], drawing.RESPONSES.values(), strict=True):
        axes.set_title(heading)
    columns = {"frequency_hz": damped.frequency_hz}
    for name, curve in (("damped", damped), ("undamped", undamped), ("damped_7um", higher)):
        for what in (*drawing.RESPONSES, "collides"):
            columns[f"{what}_{name}"] = getattr(curve, what).astype(np.float64)
    shares = [f"{np.mean(each.collides):.0%}" for each in (damped, undamped, higher)]
    caption = (
        "Bars at the bottom: frequencies at which m1 and m2 collide, in the colour of the curve. Without "
        "damping the transient does not decay, and each point is one random sample. "
        f"The masses collide at {shares[0]} of the frequencies with damping at 5 µm, {shares[1]} without "
        f"damping, {shares[2]} at 7 µm."
    )
    return caption, {"": columns}


def _compare(axes: "Axes", curves: dict[str, Responses], what: str) -> None:
    styles = zip(curves.items(), (report.MEASURED, report.LEVELS[2]), ("-", "--"), strict=True)
    for number, ((label, curve), colour, line) in enumerate(styles):
        f = curve.frequency_hz
        axes.plot(f, getattr(curve, what), color=colour, linestyle=line, label=label)
        foot, where = 0.03 * number, curve.collides.tolist()
        bars = axes.get_xaxis_transform()
        axes.fill_between(f, foot, foot + 0.025, where=where, transform=bars, color=colour)
        drawing.finish(axes, f, "response of m0 over A0")


def _clearance_studies(options: Case) -> tuple[Study, ...]:
    """Return one study per gap, with the amplitude equal to the gap."""
    return tuple(options.study(("hertz",), (gap_m,), gaps_m=(gap_m,)) for gap_m in GAPS_M)


@drawing.paper_figure("11", "influence of the gap when A0 equals the gap", 4.6, _clearance_studies)
def clearance(figure: "Figure", options: Case, *results: StudyResults) -> drawing.Drawn:
    """Draw both responses for every gap."""
    curves = {1e6 * gap_m: responses(each) for gap_m, each in zip(GAPS_M, results, strict=True)}
    f = np.asarray(options.frequencies_hz)
    panels = figure.subplots(2, 1, sharex=True)
    for axes, (what, heading) in zip(panels, drawing.RESPONSES.items(), strict=True):
        drawing.draw_terminal(axes, options.specimen())
        axes.set_prop_cycle(color=report.LEVELS, linestyle=report.LEVEL_STYLES)
        for gap_um, curve in curves.items():
            axes.plot(f, getattr(curve, what), linewidth=1.0, label=f"gap = A0 = {gap_um:g} µm")
        drawing.finish(axes, f, f"{heading} of m0")
        axes.label_outer()
    report.legend_above(figure, [panels[0]])
    columns = {"frequency_hz": f}
    for gap_um, curve in curves.items():
        columns |= {f"{what}_{gap_um:g}um": getattr(curve, what) for what in drawing.RESPONSES}
    return "Dotted: resonances with m1 stuck to m2.", {"": columns}
