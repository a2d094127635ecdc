"""Fig. 5: influence of damping and amplitude on Responses I and II."""

from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import InvalidRequest, report
from vibench.sim.study import Study, StudyResults

from .options import FigureOptions
from .responses import Responses, finish, responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LOW_M, _HIGH_M = 5e-6, 7e-6
_WHAT = ("response_i", "response_ii")


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study with and without damping, at 5 and 7 um; raises InvalidRequest if damping is zero."""
    damped_s = options.only_damping_time_s
    if damped_s == 0.0:
        raise InvalidRequest("figure 5 compares with an undamped specimen; give a damping time above 0 s")
    return (options.study(("hertz",), (_LOW_M, _HIGH_M), damping_times_s=(0.0, damped_s)),)


def draw(options: FigureOptions, results: StudyResults) -> report.DrawnFigure:
    """Draw both comparisons for both responses, with the colliding regions as bars."""
    damped = responses(results, damping_time=options.damping_time_s, amplitude=_LOW_M)
    undamped = responses(results, damping_time=0.0, amplitude=_LOW_M)
    higher = responses(results, damping_time=options.damping_time_s, amplitude=_HIGH_M)
    rows = ({"with damping": damped, "without damping": undamped}, {"A0 = 5 µm": damped, "A0 = 7 µm": higher})
    with report.figure_style():
        figure = report.new_figure(6.2)
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for row, curves in zip(panels, rows, strict=True):
            for axes, what in zip(row, _WHAT, strict=True):
                _compare(axes, curves, what)
                axes.label_outer()
        panels[0, 0].set_title("Response I")
        panels[0, 1].set_title("Response II")
        for axes in panels[:, 0]:
            axes.legend(loc="center left")
    shares = [f"{np.mean(each.collides):.0%}" for each in (damped, undamped, higher)]
    columns = {
        f"{what}_{name}": getattr(curve, what).astype(np.float64)
        for name, curve in (("damped", damped), ("undamped", undamped), ("damped_7um", higher))
        for what in (*_WHAT, "collides")
    }
    return report.DrawnFigure(
        name="figure_5",
        title="Figure 5: influence of damping and of the amplitude",
        caption=(
            "Bars at the bottom: frequencies at which m1 and m2 collide, in the colour of the curve. Without "
            "damping the transient does not decay, and each point is one random sample. "
            f"Collisions at {shares[0]} of the frequencies with damping and 5 µm, {shares[1]} without "
            f"damping, {shares[2]} at 7 µm. {options.sentence}"
        ),
        figure=figure,
        tables=(report.table("figure_5", frequency_hz=damped.frequency_hz, **columns),),
    )


def _compare(axes: "Axes", curves: dict[str, Responses], what: str) -> None:
    styles = zip(curves.items(), (report.MEASURED, report.LEVELS[2]), ("-", "--"), strict=True)
    for number, ((label, curve), colour, line) in enumerate(styles):
        f = curve.frequency_hz
        axes.plot(f, getattr(curve, what), color=colour, linestyle=line, label=label)
        foot, where = 0.03 * number, curve.collides.tolist()
        bars = axes.get_xaxis_transform()
        axes.fill_between(f, foot, foot + 0.025, where=where, transform=bars, color=colour)
        finish(axes, f, "response of m0 over A0")
