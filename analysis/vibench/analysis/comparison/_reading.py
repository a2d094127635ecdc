"""Curves read at a few frequencies: what stands beside the markers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ._trace import Trace


@dataclass(frozen=True)
class Reading:
    """One curve at the markers."""

    name: str
    magnitudes: tuple[float, ...]
    """One for each marker; NaN outside of the curve."""
    decibel: float
    """The last over the first; NaN where either is missing."""


def readings(traces: Sequence[Trace], frequencies_hz: Sequence[float]) -> tuple[Reading, ...]:
    """Read every curve at every frequency."""
    return tuple(_reading(each, np.asarray(frequencies_hz, dtype=np.float64)) for each in traces)


def _reading(trace: Trace, frequency_hz: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> Reading:
    values = trace.at(frequency_hz).magnitude
    ratio = float(20 * np.log10(values[-1] / values[0])) if values.size else float("nan")
    return Reading(trace.name, tuple(float(value) for value in values), ratio)
