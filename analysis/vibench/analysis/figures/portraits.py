"""Phase portraits of dwells with Poincaré sections, one panel for each level."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ..chaos.verdict import MotionKind, MotionVerdict
from ..sine.dwell_analysis import DwellAnalysis
from ..tables import columns, table
from . import style

_PANEL_IN = 2.9
_COLUMNS = 3
_ORBIT_PERIODS = 60.0
"""Number of drive periods drawn, up to the end of the dwell; more would fill the panel."""
_MOST_POINTS = 2000


def portraits_figure(analyses: Sequence[DwellAnalysis]) -> style.DrawnFigure:
    """Draw m0's velocity over displacement with one point per drive period, one panel for each level."""
    rising = sorted(analyses, key=lambda each: each.excitation.amplitude_vpp)
    rows = -(-len(rising) // _COLUMNS)
    with style.figure_style():
        figure = style.new_figure(0.5 + _PANEL_IN * rows)
        panels = figure.subplots(rows, min(_COLUMNS, len(rising)), squeeze=False).ravel()
        for axes, analysis in zip(panels, rising, strict=False):
            _portrait(axes, analysis)
        for unused in panels[len(rising) :]:
            unused.set_axis_off()
        style.legend_above(figure, [panels[0]], columns=2)
    return style.DrawnFigure(
        name="portraits_" + "_".join(each.facts.name for each in rising),
        title=f"Phase portraits at {rising[0].excitation.frequency_hz:g} Hz",
        caption=_caption(rising),
        figure=figure,
        tables=tuple(
            table(
                f"section_{each.facts.name}",
                **columns(each.motion.section, "time_s displacement_m velocity_m_per_s"),
            )
            for each in rising
        ),
    )


def verdict_text(verdict: MotionVerdict) -> str:
    """Return the kind of a dwell's motion in a few words."""
    match verdict:
        case MotionVerdict(kind=MotionKind.PERIODIC, period=period) if period is not None and period > 1:
            return f"periodic, {period} drive periods"
        case _:
            return verdict.kind.value


def _portrait(axes: Axes, analysis: DwellAnalysis) -> None:
    section = analysis.motion.section
    length, unit = style.with_prefix(float(np.max(np.abs(section.orbit_displacement_m))), "m")
    speed, speed_unit = style.with_prefix(float(np.max(np.abs(section.orbit_velocity_m_per_s))), "m/s")
    rate = analysis.response.displacement.sample_rate_hz
    shown = round(_ORBIT_PERIODS / section.drive_hz * rate)
    orbit = length * section.orbit_displacement_m[-shown:], speed * section.orbit_velocity_m_per_s[-shown:]
    label = f"last {_ORBIT_PERIODS:g} drive periods"
    axes.plot(*orbit, color=style.BOUNDS, linewidth=0.4, label=label)
    points = length * section.displacement_m[-_MOST_POINTS:], speed * section.velocity_m_per_s[-_MOST_POINTS:]
    axes.plot(*points, ".", color=style.SIMULATED, markersize=2.5, label="once per drive period")
    axes.set(
        xlabel=f"x of {analysis.facts.mass} [{unit}]",
        ylabel=f"velocity of {analysis.facts.mass} [{speed_unit}]",
        title=f"{analysis.excitation.amplitude_vpp:g} Vpp: {verdict_text(analysis.motion.verdict)}",
    )


def _caption(rising: Sequence[DwellAnalysis]) -> str:
    sentences = []
    for each in rising:
        verdict = each.motion.verdict
        text = f"{each.excitation.amplitude_vpp:g} Vpp: {verdict_text(verdict)} ({verdict.why})"
        if verdict.least_exponent_per_s is not None:
            text += f", largest exponent at least {verdict.least_exponent_per_s:.3g} per second"
        sentences.append(text)
    return (
        f"Velocity over displacement of {rising[0].facts.mass} (grey) and one point at the same "
        f"phase of every recorded drive period (colour). {'. '.join(sentences)}."
    )
