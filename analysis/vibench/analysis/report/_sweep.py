"""Figures of sweeps: envelope, responses, collisions (Fig. 13 d of the paper), orders, hysteresis."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ..overlay.overlay import RESPONSE_I, RESPONSE_II, SweepOverlay
from ..signals import Reals
from ..sine.sweep import SweepResponse
from ..sine.sweep_analysis import Collisions, Jump, SweepAnalysis, hysteresis
from ..tables import Table, columns, plus_minus, table
from ..tones import order_label
from . import _style as style

_HEIGHT_IN = 6.4


def sweep_figure(analysis: SweepAnalysis, overlay: SweepOverlay | None = None) -> style.DrawnFigure:
    """Draw the envelope over time with a frequency axis, and Responses I and II over frequency."""
    with style.drawing(_HEIGHT_IN) as figure:
        envelope, first, second = figure.subplots(3, 1, height_ratios=(1.25, 1.0, 1.0))
        _envelope(envelope, analysis, overlay)
        _responses(first, analysis, overlay, RESPONSE_I)
        _responses(second, analysis, overlay, RESPONSE_II)
        second.set_xlabel("drive frequency [Hz]")
        first.tick_params(labelbottom=False)
        style.legend_above(figure, [envelope, first], columns=3)
        figure.align_ylabels()
    return style.DrawnFigure(
        name=f"sweep_{analysis.facts.name}",
        title=f"Sweep, {analysis.excitation.amplitude_vpp:g} Vpp",
        caption=sweep_caption(analysis, overlay),
        figure=figure,
        tables=_tables(analysis, overlay),
    )


def _envelope(axes: Axes, analysis: SweepAnalysis, overlay: SweepOverlay | None) -> None:
    found = analysis.response
    largest = float(max(np.max(found.upper), -np.min(found.lower)))
    factor, unit = style.with_prefix(largest, "m/s")
    label = "masses collide (measured)"
    for region in analysis.collisions.regions:
        axes.axvspan(region.start.time_s, region.stop.time_s, color=style.COLLIDING, zorder=0, label=label)
    low, high, label = factor * found.lower, factor * found.upper, f"measured {analysis.facts.mass} velocity"
    axes.fill_between(found.time_s, low, high, color=style.MEASURED, alpha=0.85, label=label)
    if overlay is not None:
        label = style.simulated_label(overlay.run)
        for outline in (overlay.response.upper, overlay.response.lower):
            swept_s = overlay.response.time_s
            axes.plot(swept_s, factor * outline, color=style.SIMULATED, linewidth=0.7, label=label)
    axes.set(
        xlim=(float(found.time_s[0]), float(found.time_s[-1])),
        ylabel=f"{analysis.facts.mass} velocity\n[{unit}]",
        xlabel="time of the sweep [s]",
    )
    _frequency_on_top(axes, found)


def _frequency_on_top(axes: Axes, found: SweepResponse) -> None:
    """Add a frequency axis above the time axis; ticks outside the sweep have no time and are not drawn."""
    order = np.argsort(found.frequency_hz)
    known = found.frequency_hz[order], found.time_s[order]

    def to_frequency(time_s: ArrayLike) -> Reals:
        return np.asarray(np.interp(np.asarray(time_s), found.time_s, found.frequency_hz))

    def to_time(frequency_hz: ArrayLike) -> Reals:
        return np.asarray(np.interp(np.asarray(frequency_hz), *known, left=np.nan, right=np.nan))

    top = axes.secondary_xaxis("top", functions=(to_frequency, to_time))
    top.set_xlabel("drive frequency [Hz]")


def _responses(axes: Axes, analysis: SweepAnalysis, overlay: SweepOverlay | None, what: str) -> None:
    measured, attribute = analysis.response, style.ATTRIBUTES[what]
    for region in analysis.collisions.regions:
        axes.axvspan(region.low_hz, region.high_hz, color=style.COLLIDING, zorder=0)
    if overlay is not None:
        sines = overlay.prediction
        style.draw_sines(axes, sines.frequency_hz, sines, what, "predicted steady sines at measured A0")
    response = getattr(measured, attribute)
    axes.plot(measured.frequency_hz, response, color=style.MEASURED, label="measured response")
    if overlay is not None:
        middle = style.draw_band(axes, measured.frequency_hz, overlay, what)
        simulated = getattr(overlay.response, attribute) if middle is None else middle
        axes.plot(overlay.response.frequency_hz, simulated, **style.SIMULATED_CURVE)
    for jump in analysis.jumps:
        axes.axvline(jump.frequency_hz, color=style.TERMINAL, linestyle=":", linewidth=1.0, label="jump")
    axes.set_xlim(*sorted((float(measured.frequency_hz[0]), float(measured.frequency_hz[-1]))))
    style.magnitude_axis(axes)
    axes.set_ylabel(style.RESPONSE_LABELS[what])


def sweep_caption(analysis: SweepAnalysis, overlay: SweepOverlay | None) -> str:
    """Return the caption with the collisions, their bounds, and the agreement of the simulation."""
    found = analysis.response
    amplitudes = 1e6 * found.drive_amplitude_m
    sentences = [
        (
            f"Sweep at {analysis.excitation.amplitude_vpp:g} Vpp from {found.frequency_hz[0]:.0f} to "
            f"{found.frequency_hz[-1]:.0f} Hz; the base moved by A0 = "
            f"{amplitudes[0]:.3g} µm at the beginning and {amplitudes[-1]:.3g} µm at the end."
        ),
        f"The frequency was swept {analysis.rate_text}.",
        f"Grey: {regions_text(analysis.collisions)}.",
        f"Response II has {jumps_text(analysis.jumps)}.",
    ]
    if overlay is not None:
        apart = overlay.difference.where(~analysis.collisions.is_colliding)
        smooth = (
            f" Outside of the measured collisions: median difference {apart.median_abs_db:.2g} dB, "
            f"{100 * apart.share_within_two:.0f} % of the intervals within two standard errors."
            if np.isfinite(apart.median_abs_db)
            else ""
        )
        sentences += [
            style.run_text(overlay),
            f"In the first of these runs, {regions_text(overlay.collisions)}.{smooth}",
            "Blue dots: steady sines started from rest, without the history of the sweep.",
        ]
    return " ".join(sentences)


def regions_text(found: Collisions) -> str:
    """Return the frequency ranges with collisions in a sweep as text."""
    unclear = " and ".join(f"from {first:.1f} to {last:.1f} Hz" for first, last in found.too_fast_hz)
    unclear = f"; {unclear}, the sweep was too fast to distinguish ringing from collisions" if unclear else ""
    if not found.regions:
        return f"no collisions were found{unclear}" if unclear else "the masses did not collide"
    parts = []
    for region in found.regions:
        whole = region.reaches_start and region.reaches_stop
        begin, end = (
            plus_minus(0.5 * (each.lower_hz + each.upper_hz), 0.5 * (each.upper_hz - each.lower_hz))
            for each in (region.start, region.stop)
        )
        begin = "the sweep's beginning" if region.reaches_start else f"{begin} Hz"
        end = "the sweep's end" if region.reaches_stop else f"{end} Hz in this run"
        parts.append("during the whole sweep" if whole else f"from {begin} to {end}")
    return f"the masses collide {' and '.join(parts)}{unclear}"


def _tables(analysis: SweepAnalysis, overlay: SweepOverlay | None) -> tuple[Table, ...]:
    name = f"sweep_{analysis.facts.name}"
    found = analysis.response
    content = columns(
        found,
        "time_s frequency_hz drive_amplitude_m velocity_upper_m_per_s=upper velocity_lower_m_per_s=lower "
        "response_i response_ii sd_response_ii phase_rad",
    )
    content["is_colliding"] = analysis.collisions.is_colliding.astype(np.int64)
    if overlay is None:
        return (table(name, **content),)
    envelope = "velocity_upper_simulated_m_per_s=upper velocity_lower_simulated_m_per_s=lower"
    content |= columns(overlay.response, envelope) | style.simulated_responses(overlay)
    return table(name, **content), style.sines_table(name, overlay.prediction)


_ORDERS_HEIGHT_IN = 6.0
_RANGE_DB = 80.0
_ORDERS_SHOWN = (0.5, 1.0, 1.5, 2.0, 3.0)
"""Orders that are drawn; the table contains all orders."""
_ORDER_STYLES = ("-", "-", "--", "-.", ":")


def sweep_orders_figure(analysis: SweepAnalysis) -> style.DrawnFigure:
    """Draw the velocity's spectrogram, and the displacement at multiples (orders) of the drive frequency."""
    with style.drawing(_ORDERS_HEIGHT_IN) as figure:
        picture, orders = figure.subplots(2, 1, height_ratios=(1.3, 1.0))
        _picture(figure, picture, analysis)
        _orders(orders, analysis)
        style.legend_above(figure, [orders], columns=6)
    name = f"orders_{analysis.facts.name}"
    tracked = analysis.response.harmonics
    columns = {"frequency_hz": analysis.response.harmonics_hz}
    for order, value, sd in zip(tracked.orders, tracked.amplitude, tracked.sd, strict=True):
        label = order_label(order).replace(" ", "_")
        columns[f"{label}_m"], columns[f"sd_{label}_m"] = value, sd
    return style.DrawnFigure(
        name=name,
        title=f"Orders of a sweep, {analysis.excitation.amplitude_vpp:g} Vpp",
        caption=_caption(analysis),
        figure=figure,
        tables=(table(name, **columns),),
    )


def _picture(figure: Figure, axes: Axes, analysis: SweepAnalysis) -> None:
    found = analysis.spectrogram
    top = float(found.amplitude.max())
    decibel = 20 * np.log10(np.maximum(found.amplitude / top, 10 ** (-_RANGE_DB / 20)))
    shown = axes.pcolormesh(found.time_s, found.frequency_hz, decibel, cmap="viridis", rasterized=True)
    shown.set_clim(-_RANGE_DB, 0)
    factor, unit = style.with_prefix(top, "m/s")
    figure.colorbar(shown, ax=axes, label=f"dB re {factor * top:.3g} {unit}")
    axes.set(
        xlabel="time of the sweep [s]", ylabel=f"frequency in the\nvelocity of {analysis.facts.mass} [Hz]"
    )
    axes.grid(visible=False)


def _orders(axes: Axes, analysis: SweepAnalysis) -> None:
    response = analysis.response
    for region in analysis.collisions.regions:
        axes.axvspan(region.low_hz, region.high_hz, color=style.COLLIDING, zorder=0)
    shown = response.harmonics.amplitude
    factor, unit = style.with_prefix(float(shown.max()), "m")
    for order, colour, line in zip(
        _ORDERS_SHOWN, (style.LEVELS[0], style.MEASURED, *style.LEVELS[1:4]), _ORDER_STYLES, strict=True
    ):
        size, label = factor * np.abs(response.harmonics.order(order)), order_label(order)
        axes.plot(response.harmonics_hz, size, line, color=colour, linewidth=1.0, label=label)
    axes.set_xlim(*sorted((float(response.frequency_hz[0]), float(response.frequency_hz[-1]))))
    style.magnitude_axis(axes)
    axes.set(xlabel="drive frequency [Hz]", ylabel=f"displacement of {analysis.facts.mass} [{unit}]")


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
        f"Above: velocity spectrum, lines {found.resolution_hz:.2g} Hz wide at half power. Below: "
        f"displacement of {analysis.facts.mass} at orders of the recorded drive, grey where the masses "
        "collide; there, the orders also contain chaotic motion at nearby frequencies. Strongest after "
        f"order 1: {loudest[1]}, {20 * np.log10(loudest[0]):.0f} dB re order 1 (median)."
    )


_HYSTERESIS_HEIGHT_IN = 3.4


def hysteresis_figure(up: SweepAnalysis, down: SweepAnalysis) -> style.DrawnFigure:
    """Draw Response II of both sweeps, the jumps, and the bands in which the sweeps differ."""
    found = hysteresis(up.response, down.response, up.jumps, down.jumps)
    with style.drawing(_HYSTERESIS_HEIGHT_IN) as figure:
        axes = figure.subplots()
        axes.fill_between(
            found.frequency_hz,
            0,
            1,
            where=found.differs.tolist(),
            transform=axes.get_xaxis_transform(),
            color=style.COLLIDING,
            label="the sweeps differ",
        )
        for curve, jumps, colour, line, label in (
            (found.up, up.jumps, style.LEVELS[0], "-", "up"),
            (found.down, down.jumps, style.LEVELS[2], "--", "down"),
        ):
            axes.plot(found.frequency_hz, curve, color=colour, linestyle=line, label=f"sweep {label}")
            for jump in jumps:
                axes.axvspan(jump.lower_hz, jump.upper_hz, color=colour, alpha=0.4, linewidth=0.5)
        style.magnitude_axis(axes)
        axes.set(
            xlim=(float(found.frequency_hz[0]), float(found.frequency_hz[-1])),
            xlabel="drive frequency [Hz]",
            ylabel="Response II\n|x at f| / A0",
        )
        style.legend_above(figure, [axes])
    name = f"hysteresis_{up.facts.name}_{down.facts.name}"
    content = columns(found, "frequency_hz response_ii_up=up response_ii_down=down")
    widths = "; ".join(
        f"hysteresis {width:.1f} Hz wide ({low:.1f} to {high:.1f})" for width, low, high in found.widths_hz
    )
    share = float(np.mean(found.differs))
    return style.DrawnFigure(
        name=name,
        title=f"Sweeps up and down, {up.excitation.amplitude_vpp:g} Vpp",
        caption=f"Response II of sweeps up and down at {up.excitation.amplitude_vpp:g} Vpp. "
        f"Up: {jumps_text(up.jumps)}. Down: {jumps_text(down.jumps)}. {widths + '. ' if widths else ''}"
        f"Grey: the sweeps differ by more than 1.5 dB ({100 * share:.0f} % of the band).",
        figure=figure,
        tables=(table(name, **content, differs=found.differs.astype(np.int64)),),
    )


def jumps_text(jumps: tuple[Jump, ...]) -> str:
    """Return jumps of a response, with the bounds of their frequencies, as text."""
    if not jumps:
        return "no jump"
    return " and ".join(
        f"a jump of {each.decibel:+.1f} dB at {each.frequency_hz:.1f} Hz ({each.lower_hz:.1f} to "
        f"{each.upper_hz:.1f})"
        for each in jumps
    )
