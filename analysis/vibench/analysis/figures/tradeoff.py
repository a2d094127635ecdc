"""Error over processor time, for every method that can compute a scene."""

from collections.abc import Mapping, Sequence

import numpy as np

from vibench.sim.accuracy_benchmark.curve import CurvePoint

from ..tables import table
from . import style

_LEAST = 1e-14
"""Least error drawn; smaller ones are rounding."""


def curve_figure(curves: Mapping[str, Sequence[CurvePoint]]) -> style.DrawnFigure:
    """Draw the error of the responses over time, a panel for each scene and a line for each method.

    Parameters
    ----------
    curves
        Error and processor time of each method, as `vibench tradeoff` measured them, by name of the scene.

    """
    methods = list(dict.fromkeys(each.method for points in curves.values() for each in points))
    # Methods beyond the number of colours differ by their markers.
    looks = {
        method: (
            style.LEVELS[place % len(style.LEVELS)],
            style.LEVEL_STYLES[place % len(style.LEVELS)],
            place // len(style.LEVELS),
        )
        for place, method in enumerate(methods)
    }
    columns = min(2, len(curves))
    with style.styled():
        figure = style.new_figure(4.6 if len(curves) == 1 else 6.6)
        panels = figure.subplots(-(-len(curves) // columns), columns, squeeze=False, sharex=True, sharey=True)
        for axes, (scene, points) in zip(panels.flat, curves.items(), strict=False):
            for method, (colour, line, more) in looks.items():
                own = sorted((each for each in points if each.method == method), key=lambda each: each.time_s)
                marker = ("os^" if all(each.is_stated for each in own) else "x+1")[more % 3]
                time_s, error = [each.time_s for each in own], [max(each.error, _LEAST) for each in own]
                axes.plot(time_s, error, linestyle=line, marker=marker, color=colour, label=method)
            chosen = [(each.time_s, max(each.error, _LEAST)) for each in points if each.is_chosen]
            ring = {"color": style.BOUNDS, "marker": "o", "markersize": 11, "fillstyle": "none"}
            axes.plot(*np.array(chosen).T, linestyle="none", **ring)
            axes.set_xscale("log")
            axes.set_yscale("log")
            if len(curves) > 1:
                axes.set_title(scene)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        for axes in panels[:, 0]:
            axes.set_ylabel("relative error of the responses")
        style.legend_above(figure, [panels[0, 0]])
    rows = [(scene, each) for scene, points in curves.items() for each in points]
    return style.DrawnFigure(
        name="tradeoff_scene" if len(curves) == 1 else "tradeoff",
        title=f"Speed against accuracy: {'; '.join(curves)}",
        caption=(
            f"Largest relative error of the four responses over processor time: {'; '.join(curves)}. "
            "Filled: stated by the method; crosses: difference from the best answer. Ring: the requested one."
        ),
        figure=figure,
        tables=(
            table(
                "tradeoff_scene" if len(curves) == 1 else "tradeoff",
                scene=np.array([scene for scene, _ in rows]),
                method=np.array([each.method for _, each in rows]),
                time_s=np.array([each.time_s for _, each in rows]),
                error=np.array([each.error for _, each in rows]),
                is_stated=np.array([int(each.is_stated) for _, each in rows]),
                is_chosen=np.array([int(each.is_chosen) for _, each in rows]),
            ),
        ),
    )
