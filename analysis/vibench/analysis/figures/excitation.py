"""Planned drive voltage, over time and as a spectrum."""

import numpy as np

from vibench.acquisition.plan import Measurement, SignalPreview

from ..signals.arrays import Reals
from ..signals.envelope import envelope
from ..tables import table
from . import style

_HEIGHT_IN = 2.3
_SAMPLES_PER_CYCLE = 8
"""Samples per period of the highest frequency: enough for a figure, few enough for a long sweep."""
_SMALLEST_PART = 0.2
"""Least size of a shown line relative to the largest one (14 dB); sets the frequency range."""
_COLUMNS = 2000


def excitation_figure(measurement: Measurement) -> style.DrawnFigure:
    """Draw the planned voltage in time and as a spectrum."""
    excitation = measurement.excitation
    rate_hz = _SAMPLES_PER_CYCLE * excitation.highest_frequency_hz
    seen = excitation.preview(rate_hz)
    shape = envelope(seen.volts, rate_hz)
    frequency_hz, size = _largest_lines(seen)
    strong = np.flatnonzero(size > _SMALLEST_PART * float(np.max(size)))
    with style.styled():
        figure = style.new_figure(_HEIGHT_IN)
        signal, spectrum = figure.subplots(1, 2)
        factor, unit = style.prefixed(seen.peak_v, "V")
        signal.fill_between(
            shape.time_s, factor * shape.lower, factor * shape.upper, color=style.PREDICTED, linewidth=0.3
        )
        signal.set_xlim(0, float(shape.time_s[-1]))
        signal.set_xlabel("time [s]")
        signal.set_ylabel(f"planned voltage [{unit}]")
        factor, unit = style.prefixed(float(np.max(size)), "V")
        spectrum.plot(frequency_hz, factor * size, color=style.PREDICTED, linewidth=0.8)
        style.frequency_axis(
            spectrum, 0.8 * float(frequency_hz[strong[0]]), 1.25 * float(frequency_hz[strong[-1]])
        )
        spectrum.set_ylim(bottom=0)
        spectrum.set_xlabel("frequency [Hz]")
        spectrum.set_ylabel(f"amplitude of a line [{unit}]")
    name = f"excitation_{measurement.name}"
    return style.DrawnFigure(
        name=name,
        title="Excitation as planned",
        caption=(
            f"{excitation.kind.replace('_', ' ')} at {excitation.amplitude_vpp:g} Vpp: {seen.rms_v:.3g} V "
            f"rms, crest factor {seen.crest_factor:.3g}, {seen.duration_s:.4g} s with its waits."
        ),
        figure=figure,
        tables=(
            table(f"{name}_signal", time_s=shape.time_s, lower_v=shape.lower, upper_v=shape.upper),
            table(f"{name}_spectrum", frequency_hz=frequency_hz, amplitude_v=size),
        ),
    )


def _largest_lines(seen: SignalPreview) -> tuple[Reals, Reals]:
    """Return frequency and amplitude of the largest line in each column, above 0 Hz."""
    frequency_hz, size = seen.frequency_hz[1:], seen.spectrum_v[1:]
    width = -(-size.size // _COLUMNS)
    starts = np.arange(0, size.size, width)
    places = np.array([first + int(np.argmax(size[first : first + width])) for first in starts])
    return frequency_hz[places], size[places]
