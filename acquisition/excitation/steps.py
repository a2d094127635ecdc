"""What the generator does, step by step: the language between an excitation and the run that plays it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Tone:
    """A sine at one frequency."""

    frequency_hz: float


@dataclass(frozen=True)
class Waveform:
    """One period of anything, repeated: values from -1 to 1, the largest magnitude being 1."""

    values: NDArray[np.float64]
    repetition_hz: float


@dataclass(frozen=True)
class Segment:
    """A named stretch of the recording that belongs together in the analysis."""

    label: str
    """``"realisation"``, ``"sweep"``, ``"dwell"``, ``"step"``."""
    numbers: dict[str, float] = field(default_factory=dict)
    """What the analysis must know: ``realisation``, ``repetition_hz``, ``frequency_hz``, ``start_hz`` ..."""


@dataclass(frozen=True)
class Step:
    """Play one thing: wait until it has settled, then record.

    Steps that follow each other with an equal segment and no settling are recorded as one segment.
    """

    play: Tone | Waveform
    settle_s: float
    record_s: float
    segment: Segment
