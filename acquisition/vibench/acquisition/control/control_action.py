"""What passes between a run and its controller: an action to take, and the samples of it."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np

from ..instruments import Block, LoopBlock, Samples
from ..plan import Phase
from ..recording import FeedbackNote


@dataclass(frozen=True)
class ControlAction:
    """The next phase, and what is noted at its first sample."""

    phase: Phase | None
    """None for the notes alone: nothing is heard then."""
    notes: tuple[FeedbackNote, ...] = ()


@dataclass(frozen=True, eq=False)
class PhaseSamples:
    """The samples of a phase, from its first one, or from the last hole in them, to its end."""

    first_sample: int
    volts: Samples
    """Shape (channels, samples) [V]."""
    coefficients: tuple[LoopBlock, ...] = ()
    """What a real-time controller measured meanwhile."""


Result = TypeVar("Result")
Controller: TypeAlias = Generator[ControlAction, PhaseSamples, Result]
"""Yields actions and is sent the samples of each; returns what it was for."""

SILENCE = PhaseSamples(0, np.empty((0, 0)))
"""What is heard during notes alone."""


def phase_samples(blocks: Sequence[Block]) -> PhaseSamples:
    """Join the blocks of a phase; one before which samples are missing (the run was held) begins anew."""
    if not blocks:
        return SILENCE
    joined: list[Block] = []
    for block in blocks:
        if joined and block.first_sample != joined[-1].first_sample + joined[-1].volts.shape[1]:
            joined.clear()
        joined.append(block)
    return PhaseSamples(joined[0].first_sample, np.concatenate([block.volts for block in joined], axis=1))
