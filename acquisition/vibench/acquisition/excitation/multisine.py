"""Multisines in a generator's memory: spectral lines, zero-order hold, phases, crest factor."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigurationError
from ..instruments import Samples

USUAL_POINTS = 8192
"""Default number of points in one period of a waveform."""
FEWEST_POINTS, MOST_POINTS = 64, 65_536
"""Bounds on the number of points in a plan; the generator's memory may set narrower bounds."""
CANDIDATES = 20
"""Number of sets of random phases that are tried; the set with the lowest crest factor is played. 20 sets
lower the crest factor of 1000 lines from about 3.8 to about 3.3; more sets hardly lower it further.
"""
NEAREST_IMAGE_RATIO = 2.0
"""Lowest allowed frequency of a held waveform's first image, divided by the upper edge of the band.
A nearer image could not be removed by an analogue low-pass filter.
"""

Lines = NDArray[np.int64]


def band_lines(start_hz: float, stop_hz: float, repetition_hz: float) -> Lines:
    """Return the harmonics of ``repetition_hz`` from ``start_hz`` to ``stop_hz``, including the edges.

    A harmonic within 1e-9 of an edge belongs to the band, because 200 times 0.1 Hz may not be exactly 20 Hz.
    """
    tolerance = 1e-9
    first = int(np.ceil(start_hz / repetition_hz * (1 - tolerance)))
    last = int(np.floor(stop_hz / repetition_hz * (1 + tolerance)))
    return np.arange(max(first, 1), last + 1, dtype=np.int64)


def hold_droop(lines: NDArray[np.integer], points: int) -> Samples:
    """Return the gain of a hold of N = ``points`` values at harmonics k: sin(pi k/N) / (pi k/N)."""
    return np.sinc(np.asarray(lines, dtype=np.float64) / points)


def held_lines(values: Samples, spans: int) -> NDArray[np.complex128]:
    """Return complex peak amplitudes of the held waveform at harmonics 0 to ``spans`` * N/2 - 1.

    The spectrum of the sampled ``values`` repeats in frequency and is multiplied by that of the hold:
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
    the best of ``CANDIDATES`` sets of phases, by crest factor. All have the same rms value, because a
    nonlinear specimen needs the same level in each. Only the waveform with the highest peak reaches 1.

    Returns
    -------
    tuple of arrays
        ``realisations`` arrays of shape (points,), read-only; equal arguments return the same arrays.
    """
    return _flat_periods(tuple(lines.tolist()), realisations, seed, points)


# Limits, preview and run need the same waveforms one after another, and all levels of a plan share them.
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


def require_far_image(stop_hz: float, repetition_hz: float, points: int) -> None:
    """Refuse a band whose first image lies below `NEAREST_IMAGE_RATIO` times its upper edge ``stop_hz``.

    Raises ConfigurationError, with the lowest allowed ``repetition_hz``.
    """
    image_hz = points * repetition_hz - stop_hz
    if image_hz < NEAREST_IMAGE_RATIO * stop_hz:
        lowest_hz = (1 + NEAREST_IMAGE_RATIO) * stop_hz / points
        raise ConfigurationError(
            f"repetition_hz = {repetition_hz:g} puts the first image of {stop_hz:g} Hz at {image_hz:g} Hz, "
            f"too near the band; repetition_hz must be at least {lowest_hz:.4g} with {points} points"
        )


def require_lines(lines: Lines, stop_hz: float, repetition_hz: float) -> None:
    """Refuse a band without spectral lines; raises ConfigurationError."""
    if len(lines) == 0:
        raise ConfigurationError(
            f"no harmonic of {repetition_hz:g} Hz is in the band up to {stop_hz:g} Hz; "
            "lower repetition_hz or widen the band"
        )
