"""Irregular motion in numbers that do not depend on instants: what two runs of one specimen share."""

import numpy as np
import scipy.signal
from numpy.lib.stride_tricks import sliding_window_view

from ..signals.arrays import Flags, Integers, Reals

_SEGMENT_S = 0.1
_LOWEST_HZ, _HIGHEST_HZ = 40.0, 12_000.0
_HIGHEST_PART = 0.4
"""Of the sample rate, within the converter's pass band."""
_BANDS = 18
_ABOVE_NOISE = 4.0
_COHERENT_HZ = 1_000.0
_DRIFT_HZ = 10.0
_HARMONICS = 5
_SHARES = (0.5, 0.9, 0.99, 0.999)


def chaos_statistics(motion: Reals, rate_hz: float, drive_hz: float | None) -> Reals:
    """Give what is compared of a stretch of irregular motion, shape (statistics,).

    Logarithms of the power of base acceleration and m0's velocity in bands; how much of the velocity follows
    the base, band by band; the distribution of m0's displacement (its spread, skewness, tails); and under a
    sine the components at the drive frequency and its harmonics, whose even ones tell the sides apart.

    Parameters
    ----------
    motion
        Base acceleration [m/s2] and m0's velocity [m/s], shape (2, samples).
    rate_hz
        Samples a second.
    drive_hz
        Of a sine; None where the drive has no one frequency.

    """
    velocity = motion[1]
    parts = (*_in_bands(motion, rate_hz), _spread(velocity), _spread(_displacement(velocity, rate_hz)))
    lines = () if drive_hz is None else (_harmonics(motion, rate_hz, drive_hz),)
    return np.concatenate([*parts, *lines])


def heard(statistics: Reals, noise_rms: Reals, rate_hz: float) -> Flags:
    """Say which statistics are not those of a channel's own noise, whose spectrum nobody knows; same shape.

    Parameters
    ----------
    statistics
        Of a recording.
    noise_rms
        Of base acceleration and m0's velocity, white, per sample, shape (2,).
    rate_hz
        Samples a second.

    """
    length, first = _bands(rate_hz)
    floor = 2 * np.log(noise_rms) + np.log(np.sum(np.hanning(length) ** 2) * _ABOVE_NOISE)
    limits = (floor[:, None] + np.log(np.diff(first))).ravel()
    found = np.ones(statistics.size, dtype=np.bool_)
    found[: limits.size] = statistics[: limits.size] > limits
    return found


def _bands(rate_hz: float) -> tuple[int, Integers]:
    """Give the samples of a segment, and where the bands begin and end among its lines."""
    length = round(_SEGMENT_S * rate_hz)
    edges = np.geomspace(_LOWEST_HZ, min(_HIGHEST_HZ, _HIGHEST_PART * rate_hz), _BANDS + 1)
    return length, np.asarray(np.ceil(edges * length / rate_hz), dtype=np.int64)


def _in_bands(motion: Reals, rate_hz: float) -> tuple[Reals, ...]:
    length, first = _bands(rate_hz)
    pieces = sliding_window_view(motion, length, axis=1)[:, :: length // 2]
    lines = np.fft.rfft(pieces * np.hanning(length))
    power = np.mean(np.abs(lines) ** 2, axis=1)
    cross = np.abs(np.mean(lines[0] * lines[1].conj(), axis=0))
    bands = np.add.reduceat(power[:, : first[-1]], first[:-1], axis=1)
    slow = first[1:] < _COHERENT_HZ * _SEGMENT_S
    together = np.add.reduceat(cross[: first[-1]], first[:-1])[slow]
    return np.log(bands[0]), np.log(bands[1]), together / np.sqrt(bands[0, slow] * bands[1, slow])


def _displacement(velocity: Reals, rate_hz: float) -> Reals:
    """Integrate, in steps of samples, without what lies below all drives."""
    b, a = scipy.signal.butter(2, _DRIFT_HZ, "highpass", fs=rate_hz)
    return np.asarray(scipy.signal.lfilter(b, a, np.cumsum(velocity - velocity.mean())))


def _spread(values: Reals) -> Reals:
    centred = values - values.mean()
    squared = centred * centred
    rms = float(np.sqrt(squared.mean()))
    tails = np.quantile(np.abs(centred), _SHARES) / rms
    skewness, kurtosis = np.vdot(squared, centred) / rms**3, np.vdot(squared, squared) / rms**4
    return np.array([np.log(rms), skewness / values.size, kurtosis / values.size, *np.log(tails)])


def _harmonics(motion: Reals, rate_hz: float, drive_hz: float) -> Reals:
    """Components of the velocity over its rms, in the phase of the base's fundamental."""
    turn = np.exp(-2j * np.pi * drive_hz / rate_hz * np.arange(motion.shape[1]))
    tapered = motion * np.hanning(motion.shape[1])
    base = np.vdot(turn.conj(), tapered[0]) / motion.shape[1]
    back, phase = turn, base / abs(base)
    found = np.empty(_HARMONICS, dtype=np.complex128)
    for k in range(_HARMONICS):
        found[k] = np.vdot(back.conj(), tapered[1]) / motion.shape[1] / phase ** (k + 1)
        back = back * turn
    found /= motion[1].std()
    return np.array([np.log(abs(base)), np.log(abs(found[0])), *found.real, *found.imag])
