"""Figures of branches, maps, basins of attraction and bifurcation diagrams, with results of recordings."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from vibench.sim import Parameter
from vibench.sim.branches import least_growth_time_s
from vibench.sim.maps import MapMotion, MapResults, Quantity, Spacing

from .. import dynamics
from ..comparison import Curve, CurveKind, CurveOrigin
from ..errors import NotEnoughData
from ..hidden_motion import HiddenMotion
from ..kinds import ANALYSES
from ..recordings.facts import known_specimen, specimen_difference
from ..results.campaign_results import CampaignResults
from ..signals import Reals
from ..sine.stepped_response import SteppedResponse, TrackedResonance, lost_levels, tracked_resonances
from ..sine.sweep import SweepResponse
from ..tables import SHOWN, Table, rows, table
from . import _style as style
from ._hidden_motion import hidden_impacts_figure, hidden_motion_figure

_HEIGHT_IN = 5.6
_GROWTH_HEIGHT_IN = 1.8
"""Height [inches] of the third panel, which shows the unstable motions that a bench can hold."""
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
    diagram: dynamics.BranchDiagram, measured: Sequence[Curve] = (), tracked: Sequence[TrackedResonance] = ()
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
        Tracked resonances; for a branch of phase resonance, the first panel shows their frequencies.
    """
    holdable = diagram.holdable
    with style.drawing(_HEIGHT_IN + (0.0 if holdable is None else _GROWTH_HEIGHT_IN)) as figure:
        panels = figure.subplots(2 if holdable is None else 3, 1, sharex=True)
        for axes, (name, kind) in zip(panels[:2], _PANELS, strict=True):
            _draw_measured(axes, diagram, [each for each in measured if each.response is kind])
            for line in diagram.lines:
                draw_line(axes, line, _branch_place(diagram, line), getattr(line, name)[:, 0])
            style.magnitude_axis(axes)
            axes.set_ylabel(f"{kind.value}\nof m0 over A0")
        if diagram.request.resonance_band_hz is not None:
            _backbone(panels, diagram, tracked)
        _events(panels[1], diagram)
        if diagram.request.loop_time_s is not None and holdable is not None:
            _growth(panels[2], diagram, holdable, least_growth_time_s(diagram.request.loop_time_s))
        start, stop = diagram.request.start, diagram.request.stop
        if diagram.request.along is Parameter.FREQUENCY:
            panels[-1].set_xlabel("drive frequency [Hz]")
            style.frequency_axis(panels[-1], start, stop)
        else:
            panels[-1].set(xlabel="base amplitude A0 [µm]", xlim=(1e6 * start, 1e6 * stop))
        style.legend_above(figure, list(panels), columns=4)
        figure.align_ylabels()
    return style.DrawnFigure(
        name="branches",
        title=f"Branches: {diagram.request.title}",
        caption=(
            "Periodic motions; solid: stable, dashed: unstable, dotted: undecided. Motions with a period of "
            f"several drive periods have other colours. {diagram.cost_sentence} {diagram.request.sentence}"
            f"{diagram.holding_sentence and ' '}{diagram.holding_sentence} Chaotic and "
            "quasi-periodic motions are not shown; expect them where there is no solid line."
        ),
        figure=figure,
        tables=branch_tables(diagram),
    )


def draw_line(axes: Axes, line: dynamics.BranchLine, place: Reals, size: Reals) -> None:
    """Draw ``size`` over ``place`` into ``axes``: solid where stable, dashed where unstable, else dotted."""
    colour = (
        style.PREDICTED
        if line.periods == 1
        else style.LEVELS[1 + (line.periods - 2) % (len(style.LEVELS) - 1)]
    )
    period = "" if line.periods == 1 else f", period {line.periods}"
    for stability, piece in line.pieces():
        dashes = {CurveOrigin.STABLE: "-", CurveOrigin.UNSTABLE: (0, (3, 1.5))}.get(stability, ":")
        label = f"{stability.name.lower()}{period}"
        axes.plot(place[piece], size[piece], color=colour, linestyle=dashes, label=label)


def _backbone(
    panels: Sequence[Axes], diagram: dynamics.BranchDiagram, tracked: Sequence[TrackedResonance]
) -> None:
    """Draw the frequency of a phase resonance in place of Response I, and the tracked resonances."""
    panels[0].clear()
    for line in diagram.lines:
        draw_line(panels[0], line, _branch_place(diagram, line), line.frequency_hz)
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
    axes: Axes, diagram: dynamics.BranchDiagram, holdable: Sequence[NDArray[np.bool_]], least_s: float
) -> None:
    """Draw the e-folding times of unstable motions; times below ``least_s`` are too short for the bench."""
    for line, held in zip(diagram.lines, holdable, strict=True):
        place, grows = _branch_place(diagram, line), line.is_unstable
        for label, chosen, colour in (
            ("can be held", grows & held, style.MEASURED),
            ("cannot be held by this bench", grows & ~held, style.SIMULATED),
        ):
            if np.any(chosen):
                axes.plot(place[chosen], line.growth_time_s[chosen], ".", color=colour, label=label)
    axes.axhline(least_s, color=style.MEASURED, linewidth=0.8, linestyle=":", label=f"{least_s:.3g} s")
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.axhspan(min(low, 0.5 * least_s), least_s, color=style.COLLIDING, alpha=0.6)
    axes.set(ylim=(min(low, 0.5 * least_s), max(high, 2.0 * least_s)), ylabel="e-folding\ntime [s]")


def _branch_place(diagram: dynamics.BranchDiagram, line: dynamics.BranchLine) -> Reals:
    scale = 1.0 if diagram.request.along is Parameter.FREQUENCY else 1e6
    return np.asarray(scale * line.axis_values(diagram.request.along))


def _events(axes: Axes, diagram: dynamics.BranchDiagram) -> None:
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


def _draw_measured(axes: Axes, diagram: dynamics.BranchDiagram, curves: Sequence[Curve]) -> None:
    if diagram.request.along is not Parameter.FREQUENCY:
        return
    for curve in curves:
        is_simulated = curve.origin is CurveOrigin.SIMULATED
        colour = style.SIMULATED if is_simulated else style.MEASURED
        label = style.plain_label(f"{curve.source}, {curve.origin.value}")
        axes.plot(curve.frequency_hz, curve.magnitude, ".", color=colour, alpha=0.7, label=label)


def branch_tables(diagram: dynamics.BranchDiagram) -> tuple[Table, ...]:
    """Return one table with all points of the branches, and one table with their special points, if any."""
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


_PANEL_IN = 3.6
_STRIP_IN = 2.6
MICRO = 1e6
_LINEAR = ("lyapunov", "motions", "duration")
_COLOURS = (*style.LEVELS, "#f0e442", "#1b1b1b")
_UP_AND_DOWN = {"up": ("#0072b2", "up"), "down": ("#d55e00", "down")}


def map_figure(
    results: MapResults,
    shown: str | None = None,
    diagram: dynamics.BranchDiagram | None = None,
    levels: Sequence[dynamics.RecordedLevel] = (),
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
        caption=" ".join(filter(None, (dynamics.map_caption(results), *differences))),
        figure=figure,
        tables=(motion_table(results.motions),),
    )


def _map(
    results: MapResults,
    shown: str,
    levels: Sequence[dynamics.RecordedLevel],
) -> Figure:
    has_several = len(results.plan.start_labels) > 1 and shown != "motions"
    quantities = [shown, "motions"] if has_several else [shown]
    figure = style.new_figure(_PANEL_IN * (1 + len(quantities)))
    panels = figure.subplots(1 + len(quantities), 1, sharex=True)
    if results.plan.is_basin:
        _draw_basins(panels[0], results)
    else:
        _draw_kinds(panels[0], results, dynamics.motion_classes(results), dynamics.MOTION_CLASSES, columns=5)
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


def _draw_kinds(
    axes: Axes, results: MapResults, values: Reals, kinds: Sequence[tuple[str, str]], columns: int
) -> None:
    """Draw the index of the kind of motion in each cell; each kind has a name and a colour."""
    colours = ListedColormap([colour for _, colour in kinds])
    _draw(axes, results, values, cmap=colours, norm=BoundaryNorm(np.arange(len(kinds) + 1) - 0.5, colours.N))
    known = [kind for number, kind in enumerate(kinds) if np.any(values == number)]
    handles = [Patch(facecolor=fill, edgecolor="#9a9a9a", linewidth=1.0, label=name) for name, fill in known]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns)


def _draw_basins(axes: Axes, results: MapResults) -> None:
    numbers = results.motion_numbers[:, 0].astype(np.float64)
    numbers[numbers < 0] = np.nan
    shown = zip(results.motions, _COLOURS, strict=False)
    kinds = [(dynamics.motion_words(results, each), colour) for each, colour in shown] or [("", _COLOURS[0])]
    _draw_kinds(axes, results, np.minimum(numbers, len(kinds) - 1), kinds, columns=1)


def _scale(name: str, values: Reals) -> Normalize:
    known = values[np.isfinite(values)]
    positive = known[known > 0.0]
    if name in _LINEAR or not positive.size:
        return Normalize(float(known.min(initial=0.0)), float(known.max(initial=1.0)))
    low, high = np.quantile(positive, [0.002, 0.998])
    return LogNorm(float(low), float(max(high, 1.001 * low)))


def _diagram(results: MapResults, diagram: dynamics.BranchDiagram | None) -> Figure:
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


def model_figures(
    results: CampaignResults,
    diagrams: Sequence[dynamics.BranchDiagram],
    maps: Sequence[MapResults],
    hidden: Sequence[HiddenMotion],
) -> Iterator[style.DrawnFigure]:
    """Draw branches, maps and hidden motions; see `write_report`."""
    yield from draw_branches(results, diagrams)
    yield from draw_maps(results, maps)
    yield from (draw(each) for each in hidden for draw in (hidden_motion_figure, hidden_impacts_figure))


def draw_maps(results: CampaignResults, maps: Sequence[MapResults]) -> Iterator[style.DrawnFigure]:
    """Draw each map, overlaid with levels and Response I of stepped sines and sweeps."""
    levels = _recorded_levels(results, CurveKind.RESPONSE_I)
    for number, found in enumerate(maps, start=1):
        drawn = map_figure(found, levels=levels if found.plan.is_over_drive else ())
        yield replace(drawn, name=f"map_{number}")


def _recorded_levels(results: CampaignResults, *kinds: CurveKind) -> list[dynamics.RecordedLevel]:
    """Return level, responses and specimen of each stepped sine and sweep over a range of frequencies."""
    levels = []
    for each in results.in_order:
        facts, found = each.analysis.facts, each.analysis.response
        if isinstance(found, SweepResponse | SteppedResponse):
            with suppress(NotEnoughData):
                level = dynamics.recorded_level(found.frequency_hz, found.drive_amplitude_m)
                measured = ANALYSES[each.kind].curves(facts.name, CurveOrigin.MEASURED, found)
                shown = [curve for curve in measured if not kinds or curve.response in kinds]
                levels.append(dynamics.RecordedLevel(facts.name, level, shown, known_specimen(facts.bench)))
    return levels


def draw_branches(
    results: CampaignResults, diagrams: Sequence[dynamics.BranchDiagram]
) -> Iterator[style.DrawnFigure]:
    """Draw each branch diagram; diagrams over frequency also show results of stepped sines and sweeps."""
    levels = _recorded_levels(results)
    for number, diagram in enumerate(diagrams, start=1):
        if diagram.request.resonance_band_hz is not None:
            drawn = _backbones(results, diagram)
        elif diagram.request.along is not Parameter.FREQUENCY:
            drawn = branches_figure(diagram)
        else:
            drawn = branches_figure(diagram, [curve for level in levels for curve in level.measured])
            sentences = (_level_sentence(diagram, each) for each in levels)
            drawn = replace(drawn, caption=" ".join((drawn.caption, *sentences)))
        yield replace(drawn, name=f"branches_{number}")


def _backbones(results: CampaignResults, diagram: dynamics.BranchDiagram) -> style.DrawnFigure:
    """Draw a computed phase resonance with the tracked resonances near it."""
    low_hz, high_hz = diagram.request.resonance_band_hz or (0.0, 0.0)
    facts = [each.analysis.facts for each in results.in_order]
    bands = [each.measurement.excitation.band_hz for each in facts]
    near = [each for each, band in zip(facts, bands, strict=True) if band[0] < high_hz and low_hz < band[1]]
    drawn = branches_figure(
        diagram, tracked=[track for each in near for track in tracked_resonances(each.feedback)]
    )
    sentences = [_lost_sentence(diagram, level) for each in near for level in lost_levels(each.feedback)]
    for each in near:
        recorded = known_specimen(each.bench)
        sentences.append(specimen_difference(diagram.request.chosen_specimen, recorded, each.name))
    return replace(drawn, caption=" ".join(filter(None, (drawn.caption, *sentences))))


def _lost_sentence(diagram: dynamics.BranchDiagram, level_m_per_s2: float) -> str:
    """State the model's largest Floquet multipliers at a level without resonance, or that there are none."""
    sizes: list[float] = []
    for line in diagram.lines:
        above = line.amplitude_m * (2.0 * np.pi * line.frequency_hz) ** 2 > level_m_per_s2
        sizes += line.largest_multiplier[1:][above[1:] != above[:-1]].tolist()
    text = f"At {level_m_per_s2:g} m/s² the control did not lock onto a periodic motion;"
    if not sizes:
        return f"{text} the branches contain no periodic motion at this level."
    multipliers = ", ".join(f"{each:.3g}" for each in sizes)
    return f"{text} the largest Floquet multiplier of the modelled motion is {multipliers}."


def _level_sentence(diagram: dynamics.BranchDiagram, level: dynamics.RecordedLevel) -> str:
    """State how base amplitude and specimen of a recording differ from those of the branches."""
    request = diagram.request
    ratios = [
        amplitude / request.path.drive(frequency)[1]
        for frequency, amplitude in level.pairs
        if request.start <= frequency <= request.stop
    ]
    name, difference = level.name, level.difference(request.chosen_specimen)
    if not ratios:
        text = f"The drive of {name} was outside the frequency range of the branches."
    else:
        low, high = np.min(ratios), np.max(ratios)
        text = f"The base amplitude of {name} is {low:.2g} to {high:.2g} times the amplitude of the branches."
    return f"{text} {difference}".rstrip()
