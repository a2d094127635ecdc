"""Amplitudes of the motion of m0 over frequency, from samples over whole drive periods. SI units."""

import math
from dataclasses import dataclass

import numpy as np

from ..model.arrays import Floats
from .observed_window import ObservedWindow, samples_between, states_of

LEAST_RATE_HZ = 20_000.0
"""Samples a second, at least: contacts are ten times slower than that, and m0 hardly feels them."""
HIGHEST = 0.25
"""Highest frequency kept, over the sample rate: what is folded back there has passed m0 twice."""


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """Amplitudes of x, unweighted, so that the drive's line and its multiples are exact."""

    frequency_hz: Floats
    """Shape (lines,)."""
    amplitude_m: Floats
    """Shape (lines,)."""


def spectrum_of(window: ObservedWindow) -> LineSpectrum:
    """Follow a window once more, stretch by stretch as before, and take the spectrum of its whole periods.

    Samples change nothing: it is the same motion to the last digit, even in chaos.
    """
    run, periods = window.begins.apart(), window.line_periods
    frequency = run.drive.frequency_hz
    per_period = math.ceil(LEAST_RATE_HZ / frequency)
    rate, count = per_period * frequency, per_period * periods
    followed = [
        run.follow(stretch.end_s, samples=samples_between(rate, stretch.start_s, stretch.end_s))
        for stretch in window.stretches
    ]
    states = states_of(followed)[-count:]
    amplitudes = np.abs(np.fft.rfft(states[:, 0])) * 2.0 / count
    amplitudes[0] *= 0.5
    frequencies = np.arange(len(amplitudes), dtype=np.float64) * (frequency / periods)
    is_kept = frequencies <= HIGHEST * rate
    return LineSpectrum(frequencies[is_kept], amplitudes[is_kept])
