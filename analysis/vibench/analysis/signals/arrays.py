"""Array types of results, runs of flags, and the envelope of a long signal."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..tables import Tabular

Reals = NDArray[np.float64]
Samples = NDArray[np.floating]
"""Real numbers in double or single precision."""
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
PER_NEPER_DB = 20 / np.log(10)


def runs_of(flags: Flags) -> Integers:
    """Return the first index and one past the last index of each run of set flags, shape (runs, 2)."""
    changes = np.diff(flags.astype(np.int8), prepend=0, append=0)
    return np.flatnonzero(changes).reshape(-1, 2)


DEFAULT_BINS = 1500
"""Default number of bins, more than the horizontal pixels of a figure."""


@dataclass(frozen=True)
class Envelope(Tabular):
    """Extremes of a signal in equal intervals of time (bins); arrays of shape (bins,)."""

    OWN_UNITS: ClassVar = {"lower": "{unit}", "upper": "{unit}"}

    time_s: Reals
    """Time at the centre of each bin."""
    lower: Reals
    upper: Reals


def envelope(
    samples: Samples, sample_rate_hz: float, *, bins: int = DEFAULT_BINS, start_s: float = 0.0
) -> Envelope:
    """Reduce a signal, shape (samples,), to its extremes in at most ``bins`` equal intervals, without NaN."""
    length = max(1, -(-samples.size // bins))
    starts = np.arange(0, samples.size, length)
    middle = np.minimum(starts + 0.5 * length, samples.size) / sample_rate_hz
    return Envelope(start_s + middle, np.fmin.reduceat(samples, starts), np.fmax.reduceat(samples, starts))
