"""How much of a dwell's motion went to the band around a bound mode: chaos makes humps, not lines."""

from dataclasses import dataclass

import numpy as np

from ..spectra.spectra import spectral_density
from .dwell import DwellResponse

_SEGMENT_S = 0.5
"""Segments of the density: 3 Hz wide, some twenty averages in 5 s."""
_REACH = 0.1
"""The band reaches so far to either side, as a fraction of its middle."""


@dataclass(frozen=True)
class TerminalLevel:
    """Displacement within a band around a frequency."""

    towards_hz: float
    low_hz: float
    high_hz: float
    peak_hz: float
    """Where the displacement's density is largest in the band; a rising or falling edge puts it at an end."""
    rms_m: float
    relative_sd: float
    decibel: float
    """Band's rms re the rms of the line at the drive frequency."""


def terminal_levels(response: DwellResponse, towards_hz: tuple[float, ...]) -> tuple[TerminalLevel, ...]:
    """Measure the bands around the given frequencies; one that holds the drive's own line is left out."""
    motion = response.displacement
    window = round(response.window_s * motion.sample_rate_hz)
    segment = min(round(_SEGMENT_S * motion.sample_rate_hz), window // 4)
    density = spectral_density(motion.settled[-window:], motion.sample_rate_hz, segment_samples=segment)
    line_m = float(abs(response.order_displacement[response.orders.index(1.0)])) / np.sqrt(2)
    found = []
    for target in towards_hz:
        low, high = target * (1 - _REACH), target * (1 + _REACH)
        margin = 2 * density.noise_bandwidth_hz
        if low - margin < response.drive.frequency_hz < high + margin:
            continue
        inside = np.flatnonzero((density.frequency_hz >= low) & (density.frequency_hz <= high))
        rms = density.rms(low, high)
        lines = max(1.0, (high - low) / density.noise_bandwidth_hz)
        found.append(
            TerminalLevel(
                towards_hz=target,
                low_hz=low,
                high_hz=high,
                peak_hz=float(density.frequency_hz[inside[np.argmax(density.density[inside])]]),
                rms_m=rms,
                relative_sd=float(0.5 / np.sqrt(density.n_eff * lines)),
                decibel=float(20 * np.log10(max(rms, np.finfo(float).tiny) / line_m)),
            )
        )
    return tuple(found)
