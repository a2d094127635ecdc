"""Figures of maps, basins of attraction and bifurcation diagrams: kinds of motion and one quantity."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibench.sim.maps import MapMotion, MapResults, Quantity, Spacing

from ..dynamics import (
    MOTION_CLASSES,
    BranchDiagram,
    RecordedLevel,
    map_caption,
    motion_classes,
    motion_words,
)
from ..figure_choices import SHOWN
from ..signals.arrays import Reals
from ..tables import Table, rows, table
from . import style
from .branches import draw_line

_PANEL_IN = 3.6
_STRIP_IN = 2.6
MICRO = 1e6
_LINEAR = ("lyapunov", "motions", "duration")
_COLOURS = (*style.LEVELS, "#f0e442", "#1b1b1b")
_UP_AND_DOWN = {"up": ("#0072b2", "up"), "down": ("#d55e00", "down")}


def map_figure(
    results: MapResults,
    shown: str | None = None,
    diagram: BranchDiagram | None = None,
    levels: Sequence[RecordedLevel] = (),
) -> style.DrawnFigure:
    """Draw a map over two quantities, or a bifurcation diagram along one quantity.

    Parameters
    ----------
    results
        Results of a map, which may still be incomplete.
    shown
        Quantity of `SHOWN` to draw below the kinds of motion. The default is Response I; for a basin map, the
        simulated time from each initial state.
    diagram
        Branches to draw into a diagram along one quantity.
    levels
        Levels of recordings, drawn as lines into a map of frequency and amplitude.
    """
    with style.figure_style():
        if len(results.plan.varying) == 1:
            figure, title = _diagram(results, diagram), "Motions along one parameter"
        else:
            usual = "duration" if results.plan.is_basin else "response_i"
            figure, title = _map(results, shown or usual, levels), "Map of motions"
        differences = [each.difference(results.plan.scene((0, 0, 0)).specimen) for each in levels]
    return style.DrawnFigure(
        name="map",
        title=f"{title}: {', '.join(each.long_name for each in results.plan.varying)}",
        caption=" ".join(filter(None, (map_caption(results), *differences))),
        figure=figure,
        tables=(motion_table(results.motions),),
    )


def _map(
    results: MapResults,
    shown: str,
    levels: Sequence[RecordedLevel],
) -> Figure:
    has_several = len(results.plan.start_labels) > 1 and shown != "motions"
    quantities = [shown, "motions"] if has_several else [shown]
    figure = style.new_figure(_PANEL_IN * (1 + len(quantities)))
    panels = figure.subplots(1 + len(quantities), 1, sharex=True)
    if results.plan.is_basin:
        _draw_basins(panels[0], results)
    else:
        _draw_classes(panels[0], results)
    for axes, name in zip(panels[1:], quantities, strict=True):
        mesh = _draw(axes, results, results.map_values(name), norm=_scale(name, results.map_values(name)))
        figure.colorbar(mesh, ax=axes, label=SHOWN[name])
        for level in levels:
            frequency_hz, amplitude_m = np.array(level.pairs).T
            label = style.plain_label(level.name)
            axes.plot(frequency_hz, MICRO * amplitude_m, color=style.MEASURED, linewidth=4.0, label=label)
            for curve in level.measured:
                place = np.interp(curve.frequency_hz, frequency_hz, MICRO * amplitude_m)
                axes.scatter(curve.frequency_hz, place, c=mesh.to_rgba(curve.magnitude), s=5.0, zorder=3)
    for axes in panels:
        _place(axes, results)
    return figure


def _draw(axes: Axes, results: MapResults, values: Reals, **look: Any) -> QuadMesh:
    first, second = results.plan.varying
    (across, _), (up, _) = _axis_edges(results, first), _axis_edges(results, second)
    return axes.pcolormesh(across, up, values, rasterized=True, shading="flat", **look)


def _axis_edges(results: MapResults, quantity: Quantity) -> tuple[Reals, str]:
    """Return the cell edges along one axis in a readable unit, and the axis label."""
    chosen = results.plan.range_of(quantity)
    edges = np.array(chosen.edges)
    factor, unit = (
        (1.0, quantity.units)
        if quantity.units == "Hz"
        else style.with_prefix(max(map(abs, edges)), quantity.units)
    )
    return factor * edges, f"{quantity.long_name} [{unit.replace('u', 'µ')}]"


def _place(axes: Axes, results: MapResults) -> None:
    first, second = results.plan.varying
    for quantity, label, scale in (
        (first, axes.set_xlabel, partial(axes.set_xscale, "log")),
        (second, axes.set_ylabel, partial(style.magnitude_axis, axes)),
    ):
        label(_axis_edges(results, quantity)[1])
        if results.plan.range_of(quantity).spacing is Spacing.LOGARITHMIC:
            scale()
    axes.grid(visible=False)
    axes.label_outer()


def _draw_classes(axes: Axes, results: MapResults) -> None:
    classes = motion_classes(results)
    colours = ListedColormap([colour for _, colour in MOTION_CLASSES])
    _draw(
        axes,
        results,
        classes,
        cmap=colours,
        norm=BoundaryNorm(np.arange(len(MOTION_CLASSES) + 1) - 0.5, colours.N),
    )
    known = [MOTION_CLASSES[k] for k in range(len(MOTION_CLASSES)) if np.any(classes == k)]
    handles = [Patch(facecolor=fill, edgecolor="#9a9a9a", linewidth=1.0, label=name) for name, fill in known]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=5)


def _draw_basins(axes: Axes, results: MapResults) -> None:
    numbers = results.motion_numbers[:, 0].astype(np.float64)
    numbers[numbers < 0] = np.nan
    shown = results.motions[: len(_COLOURS)]
    count = max(1, len(shown))
    colours = ListedColormap(list(_COLOURS[:count]))
    norm = BoundaryNorm(np.arange(count + 1) - 0.5, colours.N)
    _draw(axes, results, np.minimum(numbers, count - 1), cmap=colours, norm=norm)
    labels = [motion_words(results, each) for each in shown]
    handles = [Patch(facecolor=_COLOURS[k], label=label) for k, label in enumerate(labels)]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=1)


def _scale(name: str, values: Reals) -> Normalize:
    known = values[np.isfinite(values)]
    positive = known[known > 0.0]
    if name in _LINEAR or not positive.size:
        return Normalize(float(known.min(initial=0.0)), float(known.max(initial=1.0)))
    low, high = np.quantile(positive, [0.002, 0.998])
    return LogNorm(float(low), float(max(high, 1.001 * low)))


def _diagram(results: MapResults, diagram: BranchDiagram | None) -> Figure:
    figure = style.new_figure(2.0 * _STRIP_IN)
    panels = figure.subplots(2, 1, sharex=True)
    quantity = results.plan.varying[0]
    values = np.array(results.plan.axes[-1].values)
    edges, label = _axis_edges(results, quantity)
    factor = edges[0] / results.plan.range_of(quantity).edges[0]
    for index, start in enumerate(results.plan.start_labels):
        colour, text = _UP_AND_DOWN.get(start, (style.LEVELS[index % len(style.LEVELS)], f"from {start}"))
        dots = {"color": colour, "linestyle": "none", "marker": "."}
        panels[0].plot([], [], markersize=5.0, label=text, **dots)
        panels[0].plot(factor * values, results.map_values("response_i", index), markersize=2.0, **dots)
        sections = MICRO * results.map_values("section_p", index)
        places = np.repeat(factor * values[:, None], sections.shape[1], axis=1)
        panels[1].plot(places.reshape(-1), sections.reshape(-1), markersize=0.6, rasterized=True, **dots)
    if diagram is not None:
        for line in diagram.lines:
            place = factor * line.axis_values(diagram.request.along)
            draw_line(panels[0], line, place, line.response_i[:, 0])
            draw_line(panels[1], line, place, MICRO * (line.states[:, 1] - line.states[:, 2]))
    style.magnitude_axis(panels[0])
    panels[0].set_ylabel("Response I of m0 over A0")
    panels[1].set(ylabel="p once per drive period [µm]", xlabel=label)
    if quantity.axis == "frequency":
        style.frequency_axis(panels[1], float(values[0]), float(values[-1]))
    style.legend_above(figure, list(panels), columns=4)
    figure.align_ylabels()
    return figure


def motion_table(motions: Sequence[MapMotion]) -> Table:
    """Return a table of a map's motions, with the responses and the fraction of points of each motion."""
    return table(
        "map_motions",
        motion=[str(each.motion) for each in motions],
        period=[-1 if each.period is None else each.period for each in motions],
        **rows(motions, "response_i response_ii share=share.share share_low=share.low share_high=share.high"),
    )
