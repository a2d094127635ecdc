"""Motion in a sweep at frequencies other than the drive's: spectrogram, and orders 1/3 to 5."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..sine.sweep_analysis import SweepAnalysis
from ..tables import Table, table
from ..tones.order_tracking import order_label
from . import style

_HEIGHT_IN = 6.0
_RANGE_DB = 80.0
_SHOWN = (0.5, 1.0, 1.5, 2.0, 3.0)
"""Orders that are drawn; the table has all."""
_ORDER_STYLES = ("-", "-", "--", "-.", ":")


def sweep_orders_figure(analysis: SweepAnalysis) -> style.DrawnFigure:
    """Draw the spectrogram of the velocity, and the displacement at orders of the drive."""
    with style.styled():
        figure = style.new_figure(_HEIGHT_IN)
        picture, orders = figure.subplots(2, 1, height_ratios=(1.3, 1.0))
        _picture(figure, picture, analysis)
        _orders(orders, analysis)
        style.legend_above(figure, [orders], columns=6)
    name = f"orders_{analysis.facts.name}"
    return style.DrawnFigure(
        name=name,
        title=f"Orders of a sweep, {analysis.excitation.amplitude_vpp:g} Vpp",
        caption=_caption(analysis),
        figure=figure,
        tables=(_table(name, analysis),),
    )


def _picture(figure: Figure, axes: Axes, analysis: SweepAnalysis) -> None:
    found = analysis.spectrogram
    top = float(found.amplitude.max())
    decibel = 20 * np.log10(np.maximum(found.amplitude / top, 10 ** (-_RANGE_DB / 20)))
    shown = axes.pcolormesh(
        found.time_s, found.frequency_hz, decibel, cmap="viridis", vmin=-_RANGE_DB, vmax=0, rasterized=True
    )
    factor, unit = style.prefixed(top, "m/s")
    figure.colorbar(shown, ax=axes, label=f"dB re {factor * top:.3g} {unit}")
    axes.set_xlabel("time of the sweep [s]")
    axes.set_ylabel(f"frequency in the\nvelocity of {analysis.facts.mass} [Hz]")
    axes.grid(visible=False)


def _orders(axes: Axes, analysis: SweepAnalysis) -> None:
    response = analysis.response
    for region in analysis.collisions.regions:
        axes.axvspan(region.low_hz, region.high_hz, color=style.COLLIDING, zorder=0)
    shown = response.harmonics.amplitude
    factor, unit = style.prefixed(float(shown.max()), "m")
    for order, colour, line in zip(
        _SHOWN, (style.LEVELS[0], style.MEASURED, *style.LEVELS[1:4]), _ORDER_STYLES, strict=True
    ):
        size, label = factor * np.abs(response.harmonics.order(order)), order_label(order)
        axes.plot(response.harmonics_hz, size, line, color=colour, linewidth=1.0, label=label)
    ends = sorted((float(response.frequency_hz[0]), float(response.frequency_hz[-1])))
    axes.set_xlim(*ends)
    style.magnitude_axis(axes)
    axes.set_xlabel("drive frequency [Hz]")
    axes.set_ylabel(f"displacement of {analysis.facts.mass} [{unit}]")


def _caption(analysis: SweepAnalysis) -> str:
    found = analysis.spectrogram
    tracked = analysis.response.harmonics
    share = tracked.amplitude / np.abs(tracked.order(1.0))
    loudest = max(
        (float(np.median(row)), order_label(order))
        for row, order in zip(share, tracked.orders, strict=True)
        if order != 1.0
    )
    return (
        f"Above: amplitude in the recorded velocity, {found.resolution_hz:.2g} Hz wide at half power. Below: "
        f"displacement of {analysis.facts.mass} at orders of the recorded drive, grey where the "
        f"masses collide; with collisions each holds what chaos puts near it. Strongest beside order 1 is "
        f"{loudest[1]}, {20 * np.log10(loudest[0]):.0f} dB below it (median)."
    )


def _table(name: str, analysis: SweepAnalysis) -> Table:
    tracked = analysis.response.harmonics
    columns = {"frequency_hz": analysis.response.harmonics_hz}
    for order, value, sd in zip(tracked.orders, tracked.amplitude, tracked.sd, strict=True):
        label = order_label(order).replace(" ", "_")
        columns[f"{label}_m"], columns[f"sd_{label}_m"] = value, sd
    return table(name, **columns)
