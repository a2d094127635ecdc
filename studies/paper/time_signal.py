"""A simulated dwell as the paper shows it: 30 s of motion, and the spectrum of the last 5 s.

Panels of a time signal and of its spectrum, shared by the figures that show dwells.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from vibench.analysis.report import COLLIDING, MEASURED, TERMINAL, magnitude_axis
from vibench.sim import Harmonic, Specimen, integrate

from .options import FigureOptions
from .responses import Reals

_RATE_HZ = 8192.0
_BINS = 600


@dataclass(frozen=True, eq=False)
class Envelope:
    """Smallest and largest values of a signal in equal stretches of time; arrays of shape (stretches,)."""

    time_s: Reals
    lower: Reals
    upper: Reals


def envelope(samples: Reals, sample_rate_hz: float, bins: int) -> Envelope:
    """Reduce a signal, shape (samples,), to at most ``bins`` stretches."""
    length = -(-samples.size // bins)
    starts = np.arange(0, samples.size, length)
    middle_s = np.minimum(starts + 0.5 * length, samples.size) / sample_rate_hz
    return Envelope(middle_s, np.minimum.reduceat(samples, starts), np.maximum.reduceat(samples, starts))


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


_SPECTRUM_HZ = 600.0
_DECADES = 5.0


def draw_outline(axes: Axes, signal: TimeSignal, options: FigureOptions) -> None:
    """Draw the envelope over time, with the window that is observed in grey."""
    found = signal.outline
    axes.axvspan(options.duration_s - options.window_s, options.duration_s, color=COLLIDING, zorder=0)
    axes.fill_between(found.time_s, found.lower, found.upper, color=MEASURED, linewidth=0)
    axes.set_xlim(0, options.duration_s)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("x / A0")


def draw_spectrum(axes: Axes, signal: TimeSignal, specimen: Specimen, drive_hz: float) -> None:
    """Draw the spectrum of the window, with the terminal resonances and the drive marked."""
    for bound_hz in specimen.bound_frequencies_hz:
        axes.axvline(float(bound_hz), color=TERMINAL, linestyle=":", linewidth=1.0)
    axes.axvline(drive_hz, color="#9a9a9a", linestyle="--", linewidth=0.8)
    shown = signal.frequency_hz <= _SPECTRUM_HZ
    axes.plot(signal.frequency_hz[shown], signal.amplitude[shown], color=MEASURED, linewidth=0.8)
    magnitude_axis(axes)
    top = float(np.max(signal.amplitude[shown]))
    axes.set_ylim(top * 10**-_DECADES, 3 * top)
    axes.set_xlim(0, _SPECTRUM_HZ)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("|x| / A0")
