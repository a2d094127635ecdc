"""Figures of dwells: time signals and spectra (Fig. 14 of the paper), phase portraits."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import Specimen

from ..chaos.verdict import MotionKind
from ..overlay.overlay import SPECTRUM, DwellOverlay
from ..recordings.facts import specimen_of
from ..signals import Reals
from ..sine.dwell import DwellResponse
from ..sine.dwell_analysis import COLUMN_HZ, DwellAnalysis, spectrum_columns
from ..tables import Table, columns, plus_minus, table
from . import _style as style

_PANEL_IN = 2.9
_COLUMNS = 3
_ORBIT_PERIODS = 60.0
"""Number of drive periods drawn, up to the end of the dwell; more would fill the panel."""
_MOST_POINTS = 2000


def portraits_figure(analyses: Sequence[DwellAnalysis]) -> style.DrawnFigure:
    """Draw m0's velocity over displacement with one point per drive period, one panel for each level."""
    rising = sorted(analyses, key=lambda each: each.excitation.amplitude_vpp)
    rows = -(-len(rising) // _COLUMNS)
    with style.drawing(0.5 + _PANEL_IN * rows) as figure:
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
        title=f"{analysis.excitation.amplitude_vpp:g} Vpp: {analysis.motion.verdict.text}",
    )


def _caption(rising: Sequence[DwellAnalysis]) -> str:
    sentences = []
    for each in rising:
        verdict = each.motion.verdict
        text = f"{each.excitation.amplitude_vpp:g} Vpp: {verdict.text} ({verdict.why})"
        if verdict.least_exponent_per_s is not None:
            text += f", largest exponent at least {verdict.least_exponent_per_s:.3g} per second"
        sentences.append(text)
    return (
        f"Velocity over displacement of {rising[0].facts.mass} (grey), and one point per recorded drive "
        f"period, always at the same phase (colour). {'. '.join(sentences)}."
    )


_ROW_IN = 1.75
_FRAME_IN = 1.1
_ZOOM_PERIODS = 12.0
_RANGE_DECADES = 5.0

Pair = tuple[DwellAnalysis, DwellOverlay | None]


def dwells_figure(pairs: Sequence[Pair]) -> style.DrawnFigure:
    """Draw one row per level, weak to strong: whole dwell, last periods, spectrum of the analysed window."""
    rising = sorted(pairs, key=lambda pair: pair[0].excitation.amplitude_vpp)
    at = specimen_of(rising[0][0].facts.bench)
    with style.drawing(_FRAME_IN + _ROW_IN * len(rising)) as figure:
        panels = figure.subplots(len(rising), 3, squeeze=False, width_ratios=(1.0, 1.0, 1.5))
        for row, (analysis, overlay) in zip(panels, rising, strict=True):
            _whole(row[0], analysis)
            _zoom(row[1], analysis.response, overlay)
            _spectrum(row[2], analysis.response, overlay, at)
        for axes, label in zip(panels[-1], ("time [s]", "time [ms]", "frequency [Hz]"), strict=True):
            axes.set_xlabel(label)
        panels[0, 0].set_title("whole dwell")
        panels[0, 1].set_title(f"last {_ZOOM_PERIODS:g} periods")
        style.label_resonances(panels[0, 2], at, without_contact=False)
        style.legend_above(figure, [panels[0, 1], panels[0, 0], panels[0, 2]], columns=3)
        figure.align_ylabels(panels[:, 0])
    return style.DrawnFigure(
        name="dwells_" + "_".join(analysis.facts.name for analysis, _ in rising),
        title=f"Dwells at {rising[0][0].excitation.frequency_hz:g} Hz",
        caption=dwells_caption(rising),
        figure=figure,
        tables=tuple(each for pair in rising for each in _tables(pair)),
    )


def _whole(axes: Axes, analysis: DwellAnalysis) -> None:
    found, response = analysis.displacement, analysis.response
    factor, unit = style.with_prefix(float(np.max(np.abs(found.upper))), "m")
    motion = response.displacement
    stop_s = (motion.samples.size - motion.edge_samples) / motion.sample_rate_hz
    axes.axvspan(stop_s - response.window_s, stop_s, color=style.COLLIDING, zorder=0, label="window analysed")
    axes.fill_between(found.time_s, factor * found.lower, factor * found.upper, color=style.MEASURED)
    axes.set(
        xlim=(0, motion.samples.size / motion.sample_rate_hz),
        ylabel=f"{analysis.excitation.amplitude_vpp:g} Vpp\nx of {analysis.facts.mass} [{unit}]",
    )


def last_periods(response: DwellResponse) -> tuple[Reals, Reals]:
    """Return the last 12 drive periods of the window: time before the end [s] (negative), and x [m]."""
    rate = response.displacement.sample_rate_hz
    count = round(_ZOOM_PERIODS / response.drive.frequency_hz * rate)
    time_s: Reals = (np.arange(count, dtype=np.float64) - count) / rate
    return time_s, response.displacement.settled[-count:]


def _zoom(axes: Axes, response: DwellResponse, overlay: DwellOverlay | None) -> None:
    time_s, motion = last_periods(response)
    factor, unit = style.with_prefix(float(np.max(np.abs(motion))), "m")
    axes.plot(1e3 * time_s, factor * motion, color=style.MEASURED, linewidth=1.2, label="measured")
    if overlay is not None:
        simulated = factor * last_periods(overlay.response)[1]
        axes.plot(1e3 * time_s, simulated, label=style.simulated_label(overlay.run), **style.SIMULATED_CURVE)
    axes.set(xlim=(1e3 * float(time_s[0]), 0), ylabel=f"x [{unit}]")


def _spectrum(axes: Axes, response: DwellResponse, overlay: DwellOverlay | None, at: Specimen) -> None:
    style.mark_resonances(axes, at, without_contact=False)
    frequency_hz, size = spectrum_columns(response)
    axes.plot(frequency_hz, size, color=style.MEASURED, linewidth=1.0)
    if overlay is not None:
        middle = style.draw_band(axes, frequency_hz, overlay, SPECTRUM)
        curve = spectrum_columns(overlay.response) if middle is None else (frequency_hz, middle)
        axes.plot(*curve, color=style.SIMULATED, linewidth=0.6, zorder=3)
    style.magnitude_axis(axes)
    top = float(np.max(size))
    axes.set(ylim=(top * 10**-_RANGE_DECADES, 3 * top), xlim=(0, float(frequency_hz[-1])), ylabel="|x| / A0")


def dwells_caption(rising: Sequence[Pair]) -> str:
    """Return the caption with responses and terminal-band levels of each dwell."""
    sentences = []
    for analysis, overlay in rising:
        found = analysis.response
        text = (
            f"{analysis.excitation.amplitude_vpp:g} Vpp (A0 = {1e6 * found.drive.amplitude_m:.3g} µm): "
            f"Response I {found.response_i:.3g}, Response II "
            f"{plus_minus(found.response_ii, 2 * found.sd_response_ii)}"
        )
        if overlay is not None:
            text += f". {style.run_text(overlay)}"
        bands = ", ".join(
            f"{each.decibel:.1f} dB around {each.towards_hz:.0f} Hz" for each in analysis.terminal
        )
        sentences.append(f"{text} Measured bands: {bands} relative to the drive line." if bands else text)
    window_s = rising[0][0].response.window_s
    text = (
        f"Displacement of {rising[0][0].facts.mass} and its spectrum over the last {window_s:.3g} s "
        f"(the largest line within each {COLUMN_HZ:g} Hz). {' '.join(sentences)}"
    )
    if all(analysis.motion.verdict.kind is MotionKind.PERIODIC for analysis, _ in rising):
        return text
    return (
        f"{text} Measured and simulated chaotic motions can agree only in their statistics, not in their "
        "time signals; one simulated run is shown."
    )


def _tables(pair: Pair) -> tuple[Table, ...]:
    analysis, overlay = pair
    name = f"dwell_{analysis.facts.name}"
    frequency_hz, size = spectrum_columns(analysis.response)
    time_s, motion = last_periods(analysis.response)
    spectrum = {"frequency_hz": frequency_hz, "amplitude_over_a0": size}
    signal = {"time_s": time_s, "displacement_m": motion}
    if overlay is not None:
        spectrum |= style.band_columns(overlay, SPECTRUM, "amplitude_over_a0")
        spectrum["amplitude_over_a0_simulated"] = spectrum_columns(overlay.response)[1]
        signal["displacement_simulated_m"] = last_periods(overlay.response)[1]
    whole = analysis.displacement
    return (
        table(f"{name}_spectrum", **spectrum),
        table(f"{name}_signal", **signal),
        table(f"{name}_envelope", time_s=whole.time_s, lower_m=whole.lower, upper_m=whole.upper),
    )
