"""Figure of branches of periodic motion: stable solid, unstable dashed, special points marked."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibench.sim import Parameter
from vibench.sim.branches import least_growth_time_s

from ..comparison.curve import Curve, CurveKind, CurveOrigin
from ..dynamics import BranchDiagram, BranchLine
from ..signals.arrays import Reals
from ..sine.stepped_response import TrackedResonance
from ..tables import Table, rows, table
from . import style

_HEIGHT_IN = 5.6
_GROWTH_HEIGHT_IN = 1.8
"""Height [in] of the third panel, which shows the unstable motions that a bench can hold."""
EVENT_MARKS = {
    "fold": ("o", "#d55e00"),
    "period doubling": ("s", "#009e73"),
    "Neimark-Sacker": ("D", "#cc79a7"),
    "symmetry breaking": ("^", "#e69f00"),
    "grazing": ("x", "#1b1b1b"),
}
"""Marker and colour of each kind of special point."""
_PANELS = (("response_i", CurveKind.RESPONSE_I), ("response_ii", CurveKind.RESPONSE_II))


def branches_figure(
    diagram: BranchDiagram, measured: Sequence[Curve] = (), tracked: Sequence[TrackedResonance] = ()
) -> style.DrawnFigure:
    """Draw Responses I and II of m0 along every branch, with recordings behind them.

    If the request names a control loop, a third panel shows which unstable motions the loop can hold.

    Parameters
    ----------
    diagram
        Computed branches.
    measured
        Responses of stepped sines and sweeps; drawn if the branches are over frequency.
    tracked
        Tracked resonances; a branch of phase resonance shows their frequencies in its first panel.
    """
    with style.figure_style():
        holdable = diagram.holdable
        figure = style.new_figure(_HEIGHT_IN + (0.0 if holdable is None else _GROWTH_HEIGHT_IN))
        panels = figure.subplots(2 if holdable is None else 3, 1, sharex=True)
        for axes, (name, kind) in zip(panels[:2], _PANELS, strict=True):
            _draw_measured(axes, diagram, [each for each in measured if each.response is kind])
            for line in diagram.lines:
                draw_line(axes, line, _place(diagram, line), getattr(line, name)[:, 0])
            style.magnitude_axis(axes)
            axes.set_ylabel(f"{kind.value}\nof m0 over A0")
        if diagram.request.resonance_band_hz is not None:
            _backbone(panels, diagram, tracked)
        _events(panels[1], diagram)
        if diagram.request.loop_time_s is not None and holdable is not None:
            _growth(panels[2], diagram, holdable, least_growth_time_s(diagram.request.loop_time_s))
        _label_x_axis(panels[-1], diagram)
        style.legend_above(figure, list(panels), columns=4)
        figure.align_ylabels()
    return style.DrawnFigure(
        name="branches",
        title=f"Branches: {diagram.request.title}",
        caption=(
            "Periodic motions; solid: stable, dashed: unstable. Motions with a period of several drive "
            f"periods have other colours. {diagram.cost_sentence} {diagram.request.sentence}"
            f"{diagram.holding_sentence and ' '}{diagram.holding_sentence} Chaotic and "
            "quasi-periodic motions are not shown; expect them where there is no solid line."
        ),
        figure=figure,
        tables=branch_tables(diagram),
    )


def draw_line(axes: Axes, line: BranchLine, place: Reals, size: Reals) -> None:
    """Draw ``size`` over ``place`` into ``axes``; stable parts are solid, unstable parts dashed."""
    colour = (
        style.PREDICTED
        if line.periods == 1
        else style.LEVELS[1 + (line.periods - 2) % (len(style.LEVELS) - 1)]
    )
    period = "" if line.periods == 1 else f", period {line.periods}"
    for is_stable, piece in line.pieces():
        if is_stable:
            axes.plot(place[piece], size[piece], color=colour, label=f"stable{period}")
        else:
            dashes, label = (0, (3, 1.5)), f"unstable{period}"
            axes.plot(place[piece], size[piece], color=colour, linestyle=dashes, linewidth=0.9, label=label)


def _backbone(panels: Sequence[Axes], diagram: BranchDiagram, tracked: Sequence[TrackedResonance]) -> None:
    """Draw the frequency of a phase resonance in place of Response I, and the tracked resonances."""
    panels[0].clear()
    for line in diagram.lines:
        draw_line(panels[0], line, _place(diagram, line), line.frequency_hz)
    panels[0].set_ylabel("phase\nresonance [Hz]")
    if not tracked:
        return
    frequency_hz = np.array([each.frequency_hz for each in tracked])
    base_m = np.array([each.base_m_per_s2 for each in tracked]) / (2.0 * np.pi * frequency_hz) ** 2
    response = np.array([each.amplitude_m for each in tracked]) / base_m
    error_hz = [2.0 * each.u_frequency_hz for each in tracked]
    label = "tracked, ± two standard uncertainties"
    panels[0].errorbar(
        1e6 * base_m, frequency_hz, error_hz, fmt="o", color=style.MEASURED, capsize=2, label=label
    )
    panels[1].plot(1e6 * base_m, response, "o", color=style.MEASURED)


def _growth(
    axes: Axes, diagram: BranchDiagram, holdable: Sequence[NDArray[np.bool_]], least_s: float
) -> None:
    """Draw the e-folding times of unstable motions; times below ``least_s`` are too short for the bench."""
    for line, held in zip(diagram.lines, holdable, strict=True):
        place, grows = _place(diagram, line), ~line.is_stable
        for label, chosen, colour in (
            ("holdable", grows & held, style.MEASURED),
            ("not holdable by this bench", grows & ~held, style.SIMULATED),
        ):
            if np.any(chosen):
                axes.plot(place[chosen], line.growth_time_s[chosen], ".", color=colour, label=label)
    axes.axhline(least_s, color=style.MEASURED, linewidth=0.8, linestyle=":", label=f"{least_s:.3g} s")
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.axhspan(min(low, 0.5 * least_s), least_s, color=style.COLLIDING, alpha=0.6)
    axes.set(ylim=(min(low, 0.5 * least_s), max(high, 2.0 * least_s)), ylabel="e-folding\ntime [s]")


def _place(diagram: BranchDiagram, line: BranchLine) -> Reals:
    scale = 1.0 if diagram.request.along is Parameter.FREQUENCY else 1e6
    return np.asarray(scale * line.axis_values(diagram.request.along))


def _events(axes: Axes, diagram: BranchDiagram) -> None:
    along = diagram.request.along
    for kind, (mark, colour) in EVENT_MARKS.items():
        found = [each for line in diagram.lines for each in line.events if each.kind == kind]
        if found:
            place = [
                each.frequency_hz if along is Parameter.FREQUENCY else 1e6 * each.amplitude_m
                for each in found
            ]
            size = [each.response_ii for each in found]
            axes.plot(place, size, mark, markerfacecolor="none", color=colour, label=kind)


def _draw_measured(axes: Axes, diagram: BranchDiagram, curves: Sequence[Curve]) -> None:
    if diagram.request.along is not Parameter.FREQUENCY:
        return
    for curve in curves:
        is_simulated = curve.origin is CurveOrigin.SIMULATED
        colour = style.SIMULATED if is_simulated else style.MEASURED
        label = style.plain_label(f"{curve.source}, {curve.origin.value}")
        axes.plot(curve.frequency_hz, curve.magnitude, ".", color=colour, alpha=0.7, label=label)


def _label_x_axis(axes: Axes, diagram: BranchDiagram) -> None:
    request = diagram.request
    if request.along is Parameter.FREQUENCY:
        axes.set_xlabel("drive frequency [Hz]")
        style.frequency_axis(axes, request.start, request.stop)
        return
    axes.set(xlabel="base amplitude A0 [µm]", xlim=(1e6 * request.start, 1e6 * request.stop))


def branch_tables(diagram: BranchDiagram) -> tuple[Table, ...]:
    """Return one table with all points of the branches, and one with their special points if any."""
    lines = diagram.lines
    if not lines:
        return ()
    owner = np.concatenate([np.full(line.points, number) for number, line in enumerate(lines)])
    points = table(
        "branches",
        branch=owner,
        periods=np.concatenate([np.full(line.points, line.periods) for line in lines]),
        **rows(
            lines,
            "frequency_hz amplitude_m response_i=response_i.T.0 response_ii=response_ii.T.0 "
            "largest_multiplier growth_time_s impacts error_estimate",
        ),
    )
    events = [(number, each) for number, line in enumerate(lines) for each in line.events]
    if not events:
        return (points,)
    special = table(
        "branches_special_points",
        branch=[number for number, _ in events],
        **rows([each for _, each in events], "kind frequency_hz amplitude_m"),
    )
    return points, special
