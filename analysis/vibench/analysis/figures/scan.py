"""Figure of transmission and phase over the points of a scan, at each resonance."""

import numpy as np
from numpy.typing import ArrayLike

from ..frequency_response.request import MagnitudeScale
from ..frequency_response.scan import Scan
from ..tables import table
from . import style

_HEIGHT_IN = 4.6
_MOST_NAMES = 16
"""Largest number of points that are named at the axis; more points are marked by their node numbers."""


def scan_figure(scan: Scan) -> style.DrawnFigure:
    """Draw the operating deflection shape at each resonance."""
    view, points = scan.analyses[0].request.view, scan.points
    places = np.arange(len(points))
    columns: dict[str, ArrayLike] = {
        "node": np.array(scan.nodes),
        **{f"{axis}_m": np.array([getattr(each, f"{axis}_m") for each in points]) for axis in "xyz"},
    }
    with style.figure_style():
        figure = style.new_figure(_HEIGHT_IN)
        magnitudes, phases = figure.subplots(2, 1, sharex=True)
        for number, shape in enumerate(scan.shapes):
            look = {
                "color": style.LEVELS[number % len(style.LEVELS)],
                "linestyle": style.LEVEL_STYLES[number % len(style.LEVEL_STYLES)],
                "marker": "o",
                "markersize": 3.5,
                "capsize": 2,
                "linewidth": 1.0,
            }
            size = np.abs(shape.values)
            drawn = view.place(size)
            low, high = (view.place(each) for each in shape.magnitude_bounds)
            high = np.where(np.isfinite(high), high, drawn)
            magnitudes.errorbar(
                places, drawn, (drawn - low, high - drawn), label=f"{shape.frequency_hz:.1f} Hz", **look
            )
            phases.errorbar(places, shape.phase_deg, shape.phase_half_width_deg, **look)
            at = f"{shape.frequency_hz:.1f}hz"
            columns |= {f"magnitude_{at}": size, f"phase_deg_{at}": shape.phase_deg}
            columns[f"relative_half_width_{at}"] = shape.half_width
        if view.scale is MagnitudeScale.LOG:
            style.magnitude_axis(magnitudes)
        magnitudes.set_ylabel(view.label("point"))
        phases.set(ylabel="phase [°]", ylim=(-190, 190), yticks=[-180, -90, 0, 90, 180])
        few = len(points) <= _MOST_NAMES
        names = [
            style.plain_label(each.name) if few else str(node)
            for node, each in zip(scan.nodes, points, strict=True)
        ]
        shown = places if few else places[:: -(-len(points) // _MOST_NAMES)]
        phases.set_xticks(shown, [names[place] for place in shown])
        phases.set_xlabel("point" if few else "node")
        style.legend_above(figure, [magnitudes], columns=4)
    return style.DrawnFigure(
        name=f"scan_{scan.analyses[0].facts.name}",
        title=f"Scan {scan.name}: shapes at the resonances",
        caption=scan_caption(scan),
        figure=figure,
        tables=(table(f"scan_{scan.analyses[0].facts.name}", **columns),),
    )


def scan_caption(scan: Scan) -> str:
    """Return the caption with the resonances and the meaning of the bars."""
    where = ", ".join(f"{each.frequency_hz:.1f}" for each in scan.shapes)
    confidence = scan.analyses[0].response.frequency_response.settings.confidence
    return (
        f"Measured transmission from base to {len(scan.points)} points, and its phase, at "
        f"{f'the resonances {where} Hz' if where else 'no resonance, because none is significant'}. "
        f"Values and bars ({100 * confidence:g} % bounds): at the spectral line nearest to each resonance."
    )
