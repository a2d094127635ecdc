"""A simulated dwell as the paper shows it: 30 s of motion, and the spectrum of the last 5 s."""

from dataclasses import dataclass

import numpy as np

from vibench.sim import Harmonic, Specimen, integrate

from ..signals import Envelope, Reals, envelope
from ._options import FigureOptions

_RATE_HZ = 8192.0
_BINS = 600


@dataclass(frozen=True, eq=False)
class TimeSignal:
    """The motion of m0 under a sine, over the drive amplitude."""

    outline: Envelope
    frequency_hz: Reals
    amplitude: Reals
    """Amplitude of each line over the window, over A0; shape (lines,)."""


def time_signal(specimen: Specimen, drive: Harmonic, options: FigureOptions) -> TimeSignal:
    """Follow a dwell from rest and take the spectrum of its end."""
    run = integrate(specimen, drive, options.duration_s, options.accuracy, sample_rate_hz=_RATE_HZ)
    motion = run.states[:, 0] / drive.amplitude_m
    count = round(options.window_s * _RATE_HZ)
    taper = np.hanning(count)
    spectrum = 2 * np.abs(np.fft.rfft(taper * motion[-count:])) / taper.sum()
    return TimeSignal(
        outline=envelope(motion, _RATE_HZ, bins=_BINS),
        frequency_hz=np.arange(count // 2 + 1, dtype=np.float64) * (_RATE_HZ / count),
        amplitude=np.asarray(spectrum),
    )
