"""Minimum and maximum of a long signal in each of a few hundred bins, for plots."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..tables import Tabular
from .arrays import Reals

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
    samples: Reals, sample_rate_hz: float, *, bins: int = DEFAULT_BINS, start_s: float = 0.0
) -> Envelope:
    """Reduce a signal, shape (samples,), to its extremes in at most ``bins`` equal intervals."""
    length = max(1, -(-samples.size // bins))
    starts = np.arange(0, samples.size, length)
    middle = np.minimum(starts + 0.5 * length, samples.size) / sample_rate_hz
    return Envelope(
        start_s + middle, np.minimum.reduceat(samples, starts), np.maximum.reduceat(samples, starts)
    )
