"""Whether a sine's response still changes over a record, and what that adds to its uncertainty."""

import numpy as np

from ..chaos.period import STEADY
from ..signals.arrays import Complexes, Reals

_BLOCKS_OF_WINDOW = 10
_LEAST_CYCLES = 4.0
"""Of the drive in a block: its Hann window then holds no other order of interest."""
_FEWEST_BLOCKS = 4
_SLOW = 0.5
"""Correlation of neighbouring blocks, which ten that scatter at random exceed once in a hundred records."""
_ONCE = 0.5
"""Part of the variance within one turn a record: nothing tells how far such a change goes."""
_BEYOND = 3.0
"""What a decay leaves, over the scatter that it shows, where a tenth of it fades within the record."""


def slow_change(parts: Complexes | Reals) -> float:
    """Return the relative standard uncertainty that slow change adds to a mean or maximum.

    0 where the parts scatter at random: their standard error is enough then. NaN where a change of more than
    0.2 % has not come to an end within the record, so that another record may show any other value.

    Parameters
    ----------
    parts
        Amplitudes of successive equal parts of a record, shape (parts,).

    """
    count, mean = parts.size, np.mean(parts)
    off = parts / mean - 1
    power = float(np.sum(np.abs(off) ** 2))
    if count < _FEWEST_BLOCKS or power == 0.0:
        return 0.0
    # A straight line in few parts correlates less than one in many.
    limit = _SLOW * (1 - 3 / count) / (1 - 3 / _BLOCKS_OF_WINDOW)
    if float(np.sum(np.real(off[1:] * np.conj(off[:-1])))) <= min(limit, _SLOW) * power:
        return 0.0
    sd = float(np.sqrt(power / (count - 1)))
    lines = np.abs(np.fft.fft(off)) ** 2
    if lines[1] + lines[-1] <= _ONCE * np.sum(lines):
        return sd
    return _BEYOND * sd if sd <= STEADY else float("nan")


def demodulated(samples: Reals, cycles_per_sample: float, window_samples: int) -> Complexes:
    """Return the complex amplitude at the drive frequency in blocks of a tenth of the window."""
    block = max(window_samples // _BLOCKS_OF_WINDOW, round(_LEAST_CYCLES / cycles_per_sample))
    taper = np.hanning(block)
    taper *= 2 / np.sum(taper)
    places = np.arange(block)
    turn = taper * np.exp(-2j * np.pi * cycles_per_sample * places)
    starts = np.arange(0, samples.size - block + 1, block)
    return np.array(
        [
            np.sum(turn * samples[first : first + block])
            * np.exp(-2j * np.pi * ((cycles_per_sample * first) % 1.0))
            for first in starts
        ]
    )
