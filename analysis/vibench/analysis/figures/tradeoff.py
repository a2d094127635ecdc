"""Error over cost for each level of accuracy and each general solver, for several motions."""

from collections.abc import Sequence
from itertools import cycle

import numpy as np

from vibench.sim import Accuracy
from vibench.sim.accuracy_benchmark.curve import CurvePoint
from vibench.sim.accuracy_benchmark.figures import AccuracyBenchmark

from ..tables import table
from .style import BOUNDS, LEVEL_STYLES, LEVELS, DrawnFigure, legend_above, new_figure, styled

_MARKERS = {"DOP853": "x", "LSODA": "+", "Radau": "1"}
_LEAST = 1e-14
"""Errors below this are rounding."""


def curve_figure(points: Sequence[CurvePoint], scene: str) -> DrawnFigure:
    """Draw the error of the responses over time, one line for each method, a ring around the choice.

    Parameters
    ----------
    points
        Error and processor time of each method, as `vibench tradeoff` measured them.
    scene
        Name of the scene, for the title.
    """
    methods = list(dict.fromkeys(each.method for each in points))
    with styled():
        figure = new_figure(4.6)
        axes = figure.subplots()
        for method, colour, line in zip(methods, cycle(LEVELS), cycle(LEVEL_STYLES), strict=False):
            own = [each for each in points if each.method == method]
            axes.plot(
                [each.time_s for each in own],
                [max(each.error, _LEAST) for each in own],
                color=colour,
                linestyle=line,
                marker="o" if own[0].is_stated else "x",
                markersize=4,
                label=method,
            )
        for each in points:
            if each.is_chosen:
                axes.plot(
                    each.time_s,
                    max(each.error, _LEAST),
                    color=BOUNDS,
                    marker="o",
                    markersize=11,
                    fillstyle="none",
                )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("relative error of the responses")
        legend_above(figure, [axes])
    return DrawnFigure(
        name="tradeoff_scene",
        title=f"Speed against accuracy: {scene}",
        caption=(
            f"Largest relative error of the four responses over processor time, {scene}. Dots: as stated by "
            "the method; crosses: difference from the best answer. Ring: the answer to the request."
        ),
        figure=figure,
        tables=(
            table(
                "tradeoff_scene",
                method=np.array([each.method for each in points]),
                time_s=np.array([each.time_s for each in points]),
                error=np.array([each.error for each in points]),
                is_stated=np.array([int(each.is_stated) for each in points]),
                is_chosen=np.array([int(each.is_chosen) for each in points]),
            ),
        ),
    )


def tradeoff_figure(benchmark: AccuracyBenchmark) -> DrawnFigure:
    """Draw the state's error over processor time per simulated second, both logarithmic."""
    shown = [each for each in benchmark.motions if each.levels[0].state_error is not None]
    rows: list[tuple[str, str, float, float]] = []
    with styled():
        figure = new_figure(4.6)
        axes = figure.subplots()
        for each, colour, line in zip(shown, LEVELS, LEVEL_STYLES, strict=False):
            cost = [level.cost for level in each.levels]
            error = [max(level.state_error or 0.0, _LEAST) for level in each.levels]
            axes.plot(
                cost, error, color=colour, linestyle=line, marker="o", markersize=4, label=each.motion.name
            )
            rows += [
                (each.motion.name, level.accuracy.value, level.cost, level.state_error or 0.0)
                for level in each.levels
            ]
            for solver in each.solvers:
                size = max(solver.state_error or 0.0, _LEAST)
                axes.plot(solver.cost, size, color=colour, marker=_MARKERS[solver.name], linestyle="none")
                rows.append((each.motion.name, solver.name, solver.cost, solver.state_error or 0.0))
        for name, marker in _MARKERS.items():
            axes.plot([], [], color=BOUNDS, marker=marker, linestyle="none", label=f"scipy {name}")
        for accuracy in Accuracy:
            axes.axhline(accuracy.promise, color=BOUNDS, linewidth=0.7, linestyle=":")
            axes.annotate(
                f"{accuracy.value} promises {accuracy.promise:.0e}",
                (0.25, accuracy.promise),
                xycoords=("axes fraction", "data"),
                ha="left",
                va="bottom",
                fontsize=7,
            )
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("processor time per simulated time")
        axes.set_ylabel("error of the state\n[100 µm, 0.1 m/s]")
        legend_above(figure, [axes])
    names, solvers, costs, errors = zip(*rows, strict=True)
    return DrawnFigure(
        name="tradeoff",
        title="Speed against accuracy",
        caption=(
            "Error of the state over processor time: three levels of each motion (lines, from quick to "
            f"reference) and scipy's solvers on the plain equations. {benchmark.machine}."
        ),
        figure=figure,
        tables=(
            table(
                "tradeoff",
                motion=np.array(names),
                solver=np.array(solvers),
                time_per_simulated_time=np.array(costs),
                state_error=np.array(errors),
            ),
        ),
    )
