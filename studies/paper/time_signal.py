"""A simulated dwell in the paper's form: 30 s of motion, and the spectrum of the last 5 s."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vibench.analysis import report
from vibench.sim import Harmonic, Specimen, integrate

from .options import FigureOptions
from .responses import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SPECTRUM_HZ = 600.0
_RATE_HZ = 8192.0
_STRETCHES = 600
"""Number of sections of the outline, which shows the smallest and largest value in each section."""
_DECADES = 5.0


@dataclass(frozen=True, eq=False)
class TimeSignal:
    """Motion of m0 under a sine, relative to the drive amplitude."""

    time_s: Reals
    """Middle of each outline section, shape (sections,)."""
    lower: Reals
    upper: Reals
    frequency_hz: Reals
    amplitude: Reals
    """Amplitude of each spectral line of the window, relative to A0; shape (lines,)."""

    def spectrum_table(self, name: str) -> report.Table:
        """Return the spectrum as a table."""
        return report.table(name, frequency_hz=self.frequency_hz, amplitude_over_a0=self.amplitude)


def time_signal(specimen: Specimen, drive: Harmonic, options: FigureOptions) -> TimeSignal:
    """Simulate a dwell from rest; return its outline and the spectrum of its last part."""
    run = integrate(specimen, drive, options.duration_s, options.accuracy, sample_rate_hz=_RATE_HZ)
    motion = run.states[:, 0] / drive.amplitude_m
    count = round(options.window_s * _RATE_HZ)
    taper = np.hanning(count)
    length = -(-motion.size // _STRETCHES)
    starts = np.arange(0, motion.size, length)
    return TimeSignal(
        time_s=np.minimum(starts + 0.5 * length, motion.size) / _RATE_HZ,
        lower=np.minimum.reduceat(motion, starts),
        upper=np.maximum.reduceat(motion, starts),
        frequency_hz=np.arange(count // 2 + 1, dtype=np.float64) * (_RATE_HZ / count),
        amplitude=np.asarray(2 * np.abs(np.fft.rfft(taper * motion[-count:])) / taper.sum()),
    )


def draw_outline(axes: "Axes", signal: TimeSignal, options: FigureOptions) -> None:
    """Draw the outline over time; the evaluated window is grey."""
    axes.axvspan(options.duration_s - options.window_s, options.duration_s, color=report.COLLIDING, zorder=0)
    axes.fill_between(signal.time_s, signal.lower, signal.upper, color=report.MEASURED, linewidth=0)
    axes.set(xlim=(0, options.duration_s), xlabel="time [s]", ylabel="x / A0")


def draw_spectrum(axes: "Axes", signal: TimeSignal, specimen: Specimen, drive_hz: float) -> None:
    """Draw the spectrum of the window, with the terminal resonances and the drive marked."""
    for bound_hz in specimen.bound_frequencies_hz:
        axes.axvline(float(bound_hz), color=report.TERMINAL, linestyle=":", linewidth=1.0)
    axes.axvline(drive_hz, color="#9a9a9a", linestyle="--", linewidth=0.8)
    shown = signal.frequency_hz <= SPECTRUM_HZ
    axes.plot(signal.frequency_hz[shown], signal.amplitude[shown], color=report.MEASURED, linewidth=0.8)
    report.magnitude_axis(axes)
    top = float(np.max(signal.amplitude[shown]))
    axes.set(
        ylim=(top * 10**-_DECADES, 3 * top), xlim=(0, SPECTRUM_HZ), xlabel="frequency [Hz]", ylabel="|x| / A0"
    )
