"""Multisines in a generator's memory: spectral lines, zero-order hold, phases, crest factor."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..instruments import Samples

USUAL_POINTS = 8192
"""Default number of points in one period of a waveform."""
FEWEST_POINTS, MOST_POINTS = 64, 65_536
"""Bounds on the number of points in a plan; the generator's memory may set narrower bounds."""
CANDIDATES = 20
"""Number of sets of random phases that are tried; the set with the lowest crest factor is played. 20 sets
lower the crest factor of 1000 lines from about 3.8 to about 3.3; more sets hardly lower it further.
"""

Lines = NDArray[np.int64]


def hold_droop(lines: NDArray[np.integer], points: int) -> Samples:
    """Return the gain of a hold of N = ``points`` values at harmonics k: sin(pi k/N) / (pi k/N)."""
    return np.sinc(np.asarray(lines, dtype=np.float64) / points)


def held_lines(values: Samples, spans: int) -> NDArray[np.complex128]:
    """Return complex peak amplitudes of the held waveform at harmonics 0 to ``spans`` * N/2 - 1.

    The spectrum of the sampled ``values`` repeats in frequency and is multiplied by the spectrum of the hold:
    c_m = X_(m mod N) / N * sinc(m/N) * exp(-i pi m/N); the one-sided amplitudes are 2 c_m; the mean is c_0.
    """
    points = len(values)
    harmonics = np.arange(spans * points // 2)
    sampled = np.fft.fft(values) / points
    held = sampled[harmonics % points] * hold_droop(harmonics, points)
    amplitudes = 2 * held * np.exp(-1j * np.pi * harmonics / points)
    amplitudes[0] /= 2
    return np.asarray(amplitudes)


def flat_periods(
    lines: Lines, realisations: int, seed: int, points: int = USUAL_POINTS
) -> tuple[Samples, ...]:
    """Return one period for every realisation: lines of equal amplitude with random phases.

    Every line is divided by the droop of the hold, so that the played spectrum is flat. Each realisation uses
    the best of ``CANDIDATES`` sets of phases, by crest factor. All have the same rms value, because the level
    matters for a nonlinear specimen. Only the waveform with the highest peak reaches 1.

    Returns
    -------
    tuple of arrays
        ``realisations`` arrays of shape (points,), read-only; equal arguments return the same arrays.
    """
    return _flat_periods(tuple(lines.tolist()), realisations, seed, points)


# Limits, preview and run, one after another, need the same waveforms, as do all levels of a plan.
@lru_cache(maxsize=1)
def _flat_periods(lines: tuple[int, ...], realisations: int, seed: int, points: int) -> tuple[Samples, ...]:
    excited = np.array(lines, dtype=np.int64)
    periods = [_smoothest(excited, realisation, seed, points) for realisation in range(realisations)]
    highest = max(float(np.max(np.abs(period))) for period in periods)
    scaled = tuple(period / highest for period in periods)
    for period in scaled:
        period.flags.writeable = False
    return scaled


def shaped_period(lines: Lines, peaks: Samples, points: int, seed: int, realisation: int) -> Samples:
    """Return one period whose lines, after the hold, have the peak amplitudes ``peaks``. Of several random
    sets of phases, the set with the lowest crest factor is used.

    Returns
    -------
    Samples
        Shape (points,), in the unit of ``peaks``.
    """
    return _smoothest(lines, realisation, seed, points, peaks) * (points / 2)


def _smoothest(
    lines: Lines, realisation: int, seed: int, points: int, peaks: Samples | float = 1.0
) -> Samples:
    candidates = [_period(lines, seed, (realisation, each), points, peaks) for each in range(CANDIDATES)]
    return min(candidates, key=lambda period: float(np.max(np.abs(period))))


def _period(lines: Lines, seed: int, key: tuple[int, ...], points: int, peaks: Samples | float) -> Samples:
    random = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))
    spectrum = np.zeros(points // 2 + 1, dtype=np.complex128)
    spectrum[lines] = peaks * np.exp(2j * np.pi * random.random(len(lines))) / hold_droop(lines, points)
    return np.fft.irfft(spectrum, points)
