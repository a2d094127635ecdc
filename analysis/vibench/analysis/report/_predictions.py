"""Figures of predictions: error over computing time, Lyapunov exponents, and contact forces."""

import re
from collections.abc import Mapping, Sequence
from itertools import zip_longest

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import Parameter, PowerLaw, RigidStops, Specimen, spring_of
from vibench.sim.accuracy_benchmark import CurvePoint

from ..dynamics import ExponentSpectrum
from ..signals import Reals
from ..tables import Table, rows, table
from . import _style as style

_LEAST = 1e-14
"""Smallest error drawn; smaller errors are due to rounding."""


def curve_figure(curves: Mapping[str, Sequence[CurvePoint]]) -> style.DrawnFigure:
    """Draw error over computing time; each scene (specimen and drive) has a panel, each method a line.

    Parameters
    ----------
    curves
        Error of the responses and processor time of each method, from `vibench tradeoff`, keyed by scene.

    """
    methods = list(dict.fromkeys(each.method for points in curves.values() for each in points))
    # If there are more methods than colours, the further methods have other markers.
    looks = {
        method: (
            style.LEVELS[place % len(style.LEVELS)],
            style.LEVEL_STYLES[place % len(style.LEVELS)],
            place // len(style.LEVELS),
        )
        for place, method in enumerate(methods)
    }
    columns = min(2, len(curves))
    with style.drawing(4.6 if len(curves) == 1 else 6.6) as figure:
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
            axes.set(xscale="log", yscale="log")
            if len(curves) > 1:
                axes.set_title(scene)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        for axes in panels[:, 0]:
            axes.set_ylabel("relative error of the responses")
        style.legend_above(figure, [panels[0, 0]])
    every = [each for points in curves.values() for each in points]
    return style.DrawnFigure(
        name="tradeoff_scene" if len(curves) == 1 else "tradeoff",
        title=f"Speed against accuracy: {'; '.join(curves)}",
        caption=(
            f"Largest relative error of the four responses over processor time: {'; '.join(curves)}. "
            "Filled: stated error; crosses: difference from the best result; ring: requested result."
        ),
        figure=figure,
        tables=(
            table(
                "tradeoff_scene" if len(curves) == 1 else "tradeoff",
                scene=[scene for scene, points in curves.items() for _ in points],
                **rows(every, "method time_s error"),
                is_stated=[int(each.is_stated) for each in every],
                is_chosen=[int(each.is_chosen) for each in every],
            ),
        ),
    )


_SPECTRUM_HEIGHT_IN = 5.2


def exponent_spectrum_figure(found: ExponentSpectrum) -> style.DrawnFigure:
    """Draw six Lyapunov exponents with their intervals, and below them the Kaplan-Yorke dimension."""
    request = found.request
    is_frequency = request.along is Parameter.FREQUENCY
    place = found.column("frequency_hz") if is_frequency else 1e6 * found.column("amplitude_m")
    with style.drawing(_SPECTRUM_HEIGHT_IN) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        _exponents(upper, place, found)
        middle, low, high = (found.column(n) for n in ("dimension", "dimension_low", "dimension_high"))
        reach = np.nan_to_num(np.abs(np.stack([middle - low, high - middle])))
        lower.errorbar(place, middle, reach, fmt=".-", color=style.MEASURED, linewidth=0.9)
        lower.set_ylabel("dimension")
        lower.set_xlabel("drive frequency [Hz]" if is_frequency else "base amplitude A0 [µm]")
        style.legend_above(figure, [upper], columns=6)
        figure.align_ylabels()
    return style.DrawnFigure(
        name="spectrum",
        title=f"All exponents: {request.title}",
        caption=(
            f"Lyapunov exponents of the motion reached from rest; bars: {request.confidence:.0%} "
            f"intervals. Below: Kaplan-Yorke dimension. {found.cost_sentence} "
            f"{request.specimen_text}, {request.accuracy.value} accuracy, "
            f"{request.duration_s:g} s after {request.settle_s:g} s of settling."
        ),
        figure=figure,
        tables=(_numbers(found),),
    )


def _exponents(axes: Axes, place: Reals, found: ExponentSpectrum) -> None:
    values, low, high = (found.column(name) for name in ("exponents_per_s", "low_per_s", "high_per_s"))
    for k in range(values.shape[1]):
        known = np.isfinite(values[:, k])
        if not known.any():
            continue
        reach = np.abs(np.stack([values[known, k] - low[known, k], high[known, k] - values[known, k]]))
        colour, label, reach = style.LEVELS[k], f"λ{k + 1}", np.nan_to_num(reach)
        axes.errorbar(
            place[known], values[known, k], reach, fmt=".-", linewidth=0.9, color=colour, label=label
        )
    axes.axhline(0.0, color=style.BOUNDS, linewidth=0.7)
    axes.set_ylabel("exponent [1/s]")


def _numbers(found: ExponentSpectrum) -> Table:
    values, low, high = (found.column(name) for name in ("exponents_per_s", "low_per_s", "high_per_s"))
    six = {
        f"{name}_{k + 1}_per_s": columns[:, k]
        for name, columns in (("exponent", values), ("low", low), ("high", high))
        for k in range(values.shape[1])
    }
    return table(
        "spectrum",
        **rows(found.points, "frequency_hz amplitude_m"),
        **six,
        **rows(found.points, "sum_per_s dampers_per_s dimension dimension_low dimension_high"),
    )


_COLUMNS = 3
_BEFORE_M, _BEYOND_M = 2e-6, 1.5e-6
"""Range of p drawn before and beyond a stop [m]; the paper fits its contact laws up to 1 um past it."""
_GREY = "#9a9a9a"
_SPEED_M_PER_S = 0.1
"""Speed at which laws with losses are drawn: the impact speed of the paper's specimen at 5 um, 260 Hz."""
_POINTS = 801


def contact_forces_figure(specimens: Mapping[str, Specimen]) -> style.DrawnFigure:
    """Draw the contact force on m1 over p = y - z, with one panel per specimen, titled by the key.

    The stop with the smaller gap is shown. A law that depends on speed is drawn for loading and unloading at
    0.1 m/s. Rigid stops have no finite force and are drawn as a wall.
    """
    rows = -(-len(specimens) // _COLUMNS)
    tables = []
    with style.drawing(0.6 + 2.1 * rows) as figure:
        panels = figure.subplots(rows, min(_COLUMNS, len(specimens)), squeeze=False).flat
        for axes, named in zip_longest(panels, specimens.items()):
            if named is None:
                axes.set_visible(False)
                continue
            tables += _draw(axes, *named)
    return style.DrawnFigure(
        name="contact_forces",
        title="Forces of the contact laws",
        caption=(
            "Force that pushes m1 back from a stop (grey) over p = y - z; at the opposite stop, the sign of "
            f"the force is reversed. A law with losses is shown at {_SPEED_M_PER_S:g} m/s, while loading "
            "(solid) and unloading (dashed)."
        ),
        figure=figure,
        tables=tuple(tables),
    )


def _draw(axes: Axes, label: str, specimen: Specimen) -> list[Table]:
    below_m, above_m = specimen.gaps_m
    nearer_m = min(below_m, above_m)
    first_m = -nearer_m if isinstance(specimen.contact, PowerLaw) else nearer_m - _BEFORE_M
    # The plotted p extends from free motion into the nearer stop; `side` is the sign of p at this stop.
    side = -1.0 if below_m < above_m else 1.0
    stop_m, p = side * nearer_m, side * np.linspace(first_m, nearer_m + _BEYOND_M, _POINTS)
    axes.axvline(1e6 * stop_m, color=_GREY, linewidth=0.8)
    axes.set_title(label, fontsize="small")
    axes.set(xlabel="p [µm]", ylabel="force [N]")
    if isinstance(specimen.contact, RigidStops):
        axes.plot([1e6 * p[0], 1e6 * stop_m, 1e6 * stop_m], [0.0, 0.0, side], color=style.MEASURED)
        axes.axvspan(1e6 * stop_m, 1e6 * p[-1], color=_GREY, alpha=0.3)
        axes.set(ylim=(min(-0.1 * side, side), max(-0.1 * side, side)), yticks=[0.0])
        return []
    # Adding zero turns "-0" into "0" in tables.
    pressed, let_go = (
        np.asarray(spring_of(specimen).force(p, np.full_like(p, side * speed))) + 0.0
        for speed in (_SPEED_M_PER_S, -_SPEED_M_PER_S)
    )
    axes.plot(1e6 * p, pressed, color=style.MEASURED)
    if not np.array_equal(pressed, let_go):
        axes.plot(1e6 * p, let_go, color=style.SIMULATED, linestyle="--")
    name = re.sub(r"\W+", "_", label).strip("_")
    return [table(f"contact_forces_{name}", p_m=p, pressed_n=pressed, let_go_n=let_go)]
