"""The sine that is playing right now: its frequency from the recorded drive, and amplitudes at it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft

from ..errors import NotEnoughData
from ..signals.arrays import Complexes, Reals
from ..signals.window import Window, taper
from ._envelope import Samples

_LEAST_SHARE = 0.5
"""Part of the power that the strongest line and its neighbours hold when the drive is a sine."""
_NEIGHBOURS = 3
"""Lines on either side that belong to a sine under a Hann window, one whose frequency moves a little too."""
_LEAST_LINE = 4
"""Periods that the stretch must hold, so that the line is clear of the offset's."""


@dataclass(frozen=True)
class DriveTone:
    """A drive that is a sine over a short stretch."""

    frequency_hz: float
    """In the middle of the stretch, when it sweeps."""
    amplitude: float
    """Peak [unit of the channel]."""


@lru_cache(maxsize=32)
def _hann(samples: int) -> Reals:
    """Give the same lengths again and again: making a window costs as much as transforming it."""
    return taper(Window.HANN, samples)


def drive_tone(drive: Samples, sample_rate_hz: float) -> DriveTone | None:
    """Find the sine in a short stretch of the drive, shape (samples,); None when it is no sine.

    Between two lines of a Hann spectrum the ratio of the two largest gives the place exactly
    (Grandke 1983, IEEE Trans. Instrum. Meas. 32, 350-355).
    """
    if drive.size < 2 * _LEAST_LINE:
        return None
    values = _hann(drive.size)
    size = np.abs(fft.rfft((drive - np.mean(drive)) * values))
    line = int(np.argmax(size[:-1]))
    power = float(np.sum(size**2))
    around = size[max(0, line - _NEIGHBOURS) : line + _NEIGHBOURS + 1]
    if line < _LEAST_LINE or not float(np.sum(around**2)) > _LEAST_SHARE * power:
        return None
    side = 1 if size[line + 1] >= size[line - 1] else -1
    ratio = float(size[line + side] / size[line])
    offset = (2 * ratio - 1) / (ratio + 1)
    height = float(size[line]) / float(np.sinc(offset)) * (1 - offset**2)
    return DriveTone(
        frequency_hz=(line + side * offset) * sample_rate_hz / drive.size,
        amplitude=2 * height / float(np.sum(values)),
    )


def amplitudes_at(frequency_hz: float, signals: Reals, sample_rate_hz: float) -> Complexes:
    """Complex peak amplitudes of signals, shape (channels, samples), at one frequency."""
    values = _hann(signals.shape[-1])
    turns = np.exp(-2j * np.pi * frequency_hz / sample_rate_hz * np.arange(signals.shape[-1]))
    found: Complexes = np.asarray(signals @ (values * turns), dtype=np.complex128)
    return found * (2 / float(np.sum(values)))


def drive_turns(drive: Reals, sample_rate_hz: float, frequency_hz: float) -> Reals:
    """Give the moments at which the drive, a cosine, begins a period, in samples; a slow sweep too.

    The drive is turned back by its frequency and kept within half of it: what is left is a slow phase,
    known from few samples. A tenth of the stretch at either end, where the filter lacks its past or
    future, gives no moment.
    """
    half = max(2, int(0.5 * frequency_hz * drive.size / sample_rate_hz))
    if half < _LEAST_LINE:
        raise NotEnoughData(
            f"{drive.size / sample_rate_hz:.3g} s hold too few periods of {frequency_hz:.3g} Hz; look at more"
        )
    spectrum = fft.rfft((drive - np.mean(drive)) * _hann(drive.size))
    middle = round(frequency_hz * drive.size / sample_rate_hz)
    slow = np.zeros(fft.next_fast_len(4 * half), dtype=np.complex128)
    kept = spectrum[middle - half : middle + half + 1]
    slow[np.arange(-half, -half + kept.size)] = kept
    phase = np.unwrap(np.angle(fft.ifft(slow)))
    place = np.arange(slow.size) * (drive.size / slow.size)
    inside = slice(slow.size // 10, slow.size - slow.size // 10)
    turns = (phase[inside] + 2 * np.pi * middle * place[inside] / drive.size) / (2 * np.pi)
    whole = np.arange(np.ceil(turns[0]), np.floor(turns[-1]) + 1)
    return np.asarray(np.interp(whole, turns, place[inside]))
