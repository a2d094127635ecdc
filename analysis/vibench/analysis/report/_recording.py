"""Figures of every recording: the planned voltage, and the levels of all channels."""

import numpy as np

from vibench.acquisition.plan import Measurement, SignalPreview

from ..recordings.facts import RecordingFacts
from ..signals import Reals, envelope
from ..tables import table
from . import _style as style

_ROW_IN = 0.85
_FRAME_IN = 0.6
_UNITS = {"m s-1": "m/s", "m s-2": "m/s²"}
"""Readable forms of units that files state in UDUNITS notation."""


def bench_levels_figure(facts: RecordingFacts) -> style.DrawnFigure:
    """Draw the smallest and largest values of every channel over the whole recording."""
    peaks = []
    columns = {"time_s": facts.channels[0].envelope.time_s}
    with style.drawing(_FRAME_IN + _ROW_IN * len(facts.channels)) as figure:
        panels = figure.subplots(len(facts.channels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, level in zip(panels, facts.channels, strict=True):
            factor, unit = style.with_prefix(level.peak, _UNITS.get(level.header.unit, level.header.unit))
            role, shape = level.header.role, level.envelope
            share = f"{100 * level.share_of_range:.2g} % of its range"
            peaks.append(f"{role.replace('_', ' ')} {factor * level.peak:.3g} {unit} ({share})")
            columns |= {f"{role}_lower": shape.lower, f"{role}_upper": shape.upper}
            axes.fill_between(
                shape.time_s, factor * shape.lower, factor * shape.upper, color=style.MEASURED, linewidth=0.3
            )
            title = style.plain_label(role).replace("_", "\n")
            axes.set_ylabel(f"{title}\n[{style.plain_label(unit)}]", fontsize=7.5)
        panels[-1].set(xlabel="time since the first sample [s]", xlim=(0, facts.duration_s))
        figure.align_ylabels()
    return style.DrawnFigure(
        name=f"levels_{facts.name}",
        title="Levels of all channels",
        caption=f"Extremes of every channel, including ramps and waits. Peaks: {', '.join(peaks)}.",
        figure=figure,
        tables=(table(f"levels_{facts.name}", **columns),),
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
    with style.drawing(_EXCITATION_HEIGHT_IN) as figure:
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
            f"rms, crest factor {seen.peak_v / seen.rms_v:.3g}, {seen.duration_s:.4g} s including waits."
        ),
        figure=figure,
        tables=(
            table(f"{name}_signal", time_s=shape.time_s, lower_v=shape.lower, upper_v=shape.upper),
            table(f"{name}_spectrum", frequency_hz=frequency_hz, amplitude_v=size),
        ),
    )


def _largest_lines(seen: SignalPreview) -> tuple[Reals, Reals]:
    """Return frequency and amplitude of the largest spectral line, except at 0 Hz, in each column."""
    frequency_hz, size = seen.frequency_hz[1:], seen.spectrum_v[1:]
    width = -(-size.size // _EXCITATION_COLUMNS)
    starts = np.arange(0, size.size, width)
    places = np.array([first + int(np.argmax(size[first : first + width])) for first in starts])
    return frequency_hz[places], size[places]
