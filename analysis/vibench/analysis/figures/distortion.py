"""Noise and nonlinear distortion of a transmission from periodic noise, and the undriven lines."""

import numpy as np
from matplotlib.axes import Axes

from ..frequency_response.distortion import Distortion, distortion, is_even_line
from ..frequency_response.noise_response import NoiseAnalysis
from ..frequency_response.periodic import PeriodicFrequencyResponse
from ..signals.arrays import Reals
from ..tables import table
from . import style

_HEIGHT_IN = 4.6
_LOW_HEIGHT_IN = 3.0
_EVEN, _ODD = style.LINEAR, style.SIMULATED


def distortion_figure(analysis: NoiseAnalysis, periodic: PeriodicFrequencyResponse) -> style.DrawnFigure:
    """Draw the shares of noise and distortion in the scatter, and the levels at undriven lines."""
    lines = periodic.detection
    has_quiet_lines = lines.order.size > 0
    with style.styled():
        figure = style.new_figure(_HEIGHT_IN if has_quiet_lines else _LOW_HEIGHT_IN)
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
    noise, label = (
        _share(periodic.noise_variance, periodic),
        "not repeating (noise or chaos), one realisation",
    )
    axes.plot(frequency_hz, noise, color=style.BOUNDS, linewidth=0.9, label=label)
    varied = periodic.distortion_variance
    if varied is not None:
        # If noise explains all of the scatter, there is no distortion to draw.
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
    """Return the caption with the shares of noise and distortion in the scatter."""
    found = distortion(periodic)
    parts = [
        (
            f"From {periodic.realisations} realisations: noise of the channels or chaos of the specimen, "
            "which do not repeat from period to period, give one realisation a standard deviation of "
            f"{_percent(found.noise_share)} of the transmission (median)"
        )
    ]
    if found.distortion_share is None:
        parts.append("; one realisation cannot show distortion.")
    else:
        # Near a narrow mode whose frequency drifts, some of the drift remains and counts as distortion.
        most = "at most " if found.drift and found.drift.frequency_share + found.drift.common_share else ""
        parts.append(f", distortion {most}{_percent(found.distortion_share)}.")
    if periodic.drift is not None:
        parts.append(f" The {periodic.drift.text}; this is not distortion.")
    return "".join(parts) + _quiet_text(found)


def _percent(share: float) -> str:
    """Return a percentage with two digits, without powers of ten: in chaos it often exceeds 100 %."""
    return f"{100 * share:.0f} %" if share >= 1 else f"{100 * share:.2g} %"


def _quiet_text(found: Distortion) -> str:
    levels = {"even": found.even_m_per_s, "odd": found.odd_m_per_s}
    shown = [f"{1e6 * level:.3g} µm/s on {name} lines" for name, level in levels.items() if level is not None]
    if not shown or found.detection_noise_m_per_s is None:
        return ""
    return (
        f" Lines that were not driven hold {' and '.join(shown)} (rms, what does not repeat, "
        f"{1e6 * found.detection_noise_m_per_s:.2g} µm/s taken off): even and odd distortion of all from "
        "the drive voltage to the mass."
    )
