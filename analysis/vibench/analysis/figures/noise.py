"""Figures of noise: distortion on undriven spectral lines, transmission at all levels, planned voltage."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from vibench.acquisition.plan import Measurement, SignalPreview

from ..frequency_response.distortion import Distortion, distortion, is_even_line
from ..frequency_response.noise_response import NoiseAnalysis
from ..frequency_response.periodic import PeriodicFrequencyResponse
from ..frequency_response.request import MagnitudeScale
from ..recordings.facts import specimen_of
from ..signals.arrays import Reals
from ..signals.envelope import envelope
from ..tables import table
from . import style
from .ensemble_band import label_resonances, mark_resonances, model_resonances

_DISTORTION_HEIGHT_IN = 4.6
_DISTORTION_LOW_HEIGHT_IN = 3.0
_EVEN, _ODD = style.LINEAR, style.SIMULATED


def distortion_figure(analysis: NoiseAnalysis, periodic: PeriodicFrequencyResponse) -> style.DrawnFigure:
    """Draw standard deviations due to noise and distortion, and levels at undriven spectral lines."""
    lines = periodic.detection
    has_quiet_lines = lines.order.size > 0
    with style.figure_style():
        figure = style.new_figure(_DISTORTION_HEIGHT_IN if has_quiet_lines else _DISTORTION_LOW_HEIGHT_IN)
        panels: list[Axes] = list(figure.subplots(1 + has_quiet_lines, 1, sharex=True, squeeze=False)[:, 0])
        _shares(panels[0], periodic)
        if has_quiet_lines:
            _detection(panels[1], periodic)
        panels[-1].set_xlabel("frequency [Hz]")
        driven_hz = periodic.frequency_response.frequency_hz
        style.frequency_axis(panels[0], float(driven_hz[0]), float(driven_hz[-1]))
        style.legend_above(figure, panels)
        figure.align_ylabels()
    name = f"distortion_{analysis.facts.name}"
    varied = periodic.distortion_variance
    columns = {
        "frequency_hz": driven_hz,
        "noise_share": _share(periodic.noise_variance, periodic),
        **({} if varied is None else {"distortion_share": _share(varied, periodic)}),
        "detection_frequency_hz": lines.frequency_hz,
        "detection_order": lines.order,
        "detection_m_per_s": lines.response_amplitude,
        "detection_noise_m_per_s": lines.noise_amplitude,
    }
    return style.DrawnFigure(
        name=name,
        title=f"Noise and distortion, {analysis.excitation.amplitude_vpp:g} Vpp noise",
        caption=distortion_caption(periodic),
        figure=figure,
        tables=(table(name, **columns),),
    )


def _share(variance: Reals, periodic: PeriodicFrequencyResponse) -> Reals:
    return np.asarray(np.sqrt(variance) / periodic.frequency_response.magnitude)


def _shares(axes: Axes, periodic: PeriodicFrequencyResponse) -> None:
    frequency_hz = periodic.frequency_response.frequency_hz
    noise = _share(periodic.noise_variance, periodic)
    label = "not repeating (noise or chaos), one realisation"
    axes.plot(frequency_hz, noise, color=style.BOUNDS, linewidth=0.9, label=label)
    varied = periodic.distortion_variance
    if varied is not None:
        # If noise explains the whole scatter, there is no distortion to draw.
        seen = np.where(varied > 0, _share(varied, periodic), np.nan)
        axes.plot(frequency_hz, seen, ".-", color=style.MEASURED, linewidth=0.7, label="nonlinear distortion")
    style.magnitude_axis(axes)
    axes.set_ylabel("sd over |H|")


def _detection(axes: Axes, periodic: PeriodicFrequencyResponse) -> None:
    lines = periodic.detection
    is_even = is_even_line(lines)
    for chosen, colour, marker, label in (
        (is_even, _EVEN, "o", "even lines, not driven"),
        (~is_even, _ODD, "x", "odd lines, not driven"),
    ):
        size = lines.response_amplitude[chosen]
        axes.plot(lines.frequency_hz[chosen], size, marker, color=colour, markersize=2.5, label=label)
    label = "noise or chaos on these lines"
    axes.plot(lines.frequency_hz, lines.noise_amplitude, ":", color=style.BOUNDS, linewidth=0.9, label=label)
    style.magnitude_axis(axes)
    axes.set_ylabel("velocity of the mass [m/s]")


def distortion_caption(periodic: PeriodicFrequencyResponse) -> str:
    """Return the caption with the contributions of noise and distortion to the scatter."""
    found = distortion(periodic)
    parts = [
        (
            f"From {periodic.realisations} realisations: standard deviation of one realisation, relative to "
            f"the transmission (median): {_percent(found.noise_share)} due to channel noise or chaos of "
            "the specimen, which do not repeat each period"
        )
    ]
    if found.distortion_share is None:
        parts.append("; one realisation cannot show distortion.")
    else:
        # Near a narrow mode with a drifting frequency, some of the drift remains and counts as distortion.
        most = "at most " if found.drift and found.drift.frequency_share + found.drift.common_share else ""
        parts.append(f"; {most}{_percent(found.distortion_share)} due to distortion.")
    if periodic.drift is not None:
        parts.append(f" The {periodic.drift.text}; this is not distortion.")
    return "".join(parts) + _quiet_text(found)


def _percent(share: float) -> str:
    """Return a percentage with two digits, not as a power of ten, because it often exceeds 100 % in chaos."""
    return f"{100 * share:.0f} %" if share >= 1 else f"{100 * share:.2g} %"


def _quiet_text(found: Distortion) -> str:
    levels = {"even": found.even_m_per_s, "odd": found.odd_m_per_s}
    shown = [f"{1e6 * level:.3g} µm/s on {name} lines" for name, level in levels.items() if level is not None]
    if not shown or found.detection_noise_m_per_s is None:
        return ""
    return (
        f" Level of the lines that were not driven: {' and '.join(shown)} (rms, without the non-repeating "
        f"{1e6 * found.detection_noise_m_per_s:.2g} µm/s). This is the even and odd distortion of the whole "
        "path from the drive voltage to the mass."
    )


_LEVELS_HEIGHT_IN = 4.0


def transmission_levels_figure(analyses: Sequence[NoiseAnalysis]) -> style.DrawnFigure:
    """Draw the transmissions at one or more noise levels, weak to strong."""
    rising = sorted(analyses, key=lambda each: each.excitation.amplitude_vpp)
    view = rising[0].view
    at = model_resonances(specimen_of(rising[0].facts.bench))
    with style.figure_style():
        figure = style.new_figure(_LEVELS_HEIGHT_IN)
        axes = figure.subplots()
        mark_resonances(axes, at)
        for number, each in enumerate(rising):
            found = view.apply(each.response.frequency_response)
            level = each.response.base_level.rms_acceleration
            label = f"{each.excitation.amplitude_vpp:g} Vpp ({level:.2g} m/s² rms)"
            line = style.LEVEL_STYLES[number % len(style.LEVELS)]
            colour = style.LEVELS[number % len(style.LEVELS)]
            size = view.place(found.magnitude)
            axes.plot(found.frequency_hz, size, line, color=colour, linewidth=1.0, label=label)
        if view.scale is MagnitudeScale.LOG:
            style.magnitude_axis(axes)
        axes.set(ylabel=view.label(rising[0].facts.mass), xlabel="frequency [Hz]")
        lows = [float(each.response.frequency_response.frequency_hz[0]) for each in rising]
        highs = [float(each.response.frequency_response.frequency_hz[-1]) for each in rising]
        style.frequency_axis(axes, min(lows), max(highs))
        label_resonances(axes, at)
        style.legend_above(figure, [axes], columns=2)
    columns = {}
    for each in rising:
        columns[f"frequency_hz_{each.facts.name}"] = each.response.frequency_response.frequency_hz
        columns[f"magnitude_{each.facts.name}"] = view.apply(each.response.frequency_response).magnitude
    return style.DrawnFigure(
        name="transmission_levels",
        title=f"{view.title} at all noise levels",
        caption=transmission_levels_caption(rising),
        figure=figure,
        tables=(table("transmission_levels", **columns),),
    )


def transmission_levels_caption(rising: Sequence[NoiseAnalysis]) -> str:
    """Return the caption with the resonances at each noise level."""
    levels = []
    for each in rising:
        peaks = [f"{found.frequency_hz:.0f}" for found in each.response.resonances]
        plural = "s" * (len(peaks) > 1)
        where = f"resonance{plural} at {', '.join(peaks)} Hz" if peaks else "no clear resonance"
        levels.append(f"{each.excitation.amplitude_vpp:g} Vpp: {where}")
    return (
        f"Measured {rising[0].view.symbol} of {rising[0].facts.response} at {len(rising)} noise levels. "
        f"{'; '.join(levels)}. Dashed: resonances of the model without contact; dotted: with m1 stuck to "
        "m2 (limit of strong collisions)."
    )


_EXCITATION_HEIGHT_IN = 2.3
_SAMPLES_PER_CYCLE = 8
"""Samples per period of the highest frequency: enough for a figure, and few enough for a long sweep."""
_SMALLEST_PART = 0.2
"""The frequency axis contains all spectral lines above this fraction of the largest line (-14 dB)."""
_EXCITATION_COLUMNS = 2000


def excitation_figure(measurement: Measurement) -> style.DrawnFigure:
    """Draw the planned voltage over time, and its spectrum."""
    excitation = measurement.excitation
    rate_hz = _SAMPLES_PER_CYCLE * excitation.highest_frequency_hz
    seen = excitation.preview(rate_hz)
    shape = envelope(seen.volts, rate_hz)
    frequency_hz, size = _largest_lines(seen)
    strong = np.flatnonzero(size > _SMALLEST_PART * float(np.max(size)))
    with style.figure_style():
        figure = style.new_figure(_EXCITATION_HEIGHT_IN)
        signal, spectrum = figure.subplots(1, 2)
        factor, unit = style.with_prefix(seen.peak_v, "V")
        signal.fill_between(
            shape.time_s, factor * shape.lower, factor * shape.upper, color=style.PREDICTED, linewidth=0.3
        )
        signal.set(xlim=(0, float(shape.time_s[-1])), xlabel="time [s]", ylabel=f"planned voltage [{unit}]")
        factor, unit = style.with_prefix(float(np.max(size)), "V")
        spectrum.plot(frequency_hz, factor * size, color=style.PREDICTED, linewidth=0.8)
        style.frequency_axis(
            spectrum, 0.8 * float(frequency_hz[strong[0]]), 1.25 * float(frequency_hz[strong[-1]])
        )
        spectrum.set(ylim=(0, None), xlabel="frequency [Hz]", ylabel=f"amplitude of a line [{unit}]")
    name = f"excitation_{measurement.name}"
    return style.DrawnFigure(
        name=name,
        title="Excitation as planned",
        caption=(
            f"{excitation.kind.replace('_', ' ')} at {excitation.amplitude_vpp:g} Vpp: {seen.rms_v:.3g} V "
            f"rms, crest factor {seen.crest_factor:.3g}, {seen.duration_s:.4g} s including waits."
        ),
        figure=figure,
        tables=(
            table(f"{name}_signal", time_s=shape.time_s, lower_v=shape.lower, upper_v=shape.upper),
            table(f"{name}_spectrum", frequency_hz=frequency_hz, amplitude_v=size),
        ),
    )


def _largest_lines(seen: SignalPreview) -> tuple[Reals, Reals]:
    """Return frequency and amplitude of the largest spectral line in each column, without 0 Hz."""
    frequency_hz, size = seen.frequency_hz[1:], seen.spectrum_v[1:]
    width = -(-size.size // _EXCITATION_COLUMNS)
    starts = np.arange(0, size.size, width)
    places = np.array([first + int(np.argmax(size[first : first + width])) for first in starts])
    return frequency_hz[places], size[places]
