"""Data exchanged between a run and its controller: actions, and the samples of their phases."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, TypeAlias, TypeVar

import numpy as np

from ..excitation.plan import BaseLevel
from ..instruments import Block, Samples
from ..plan import Phase
from ..recording import FeedbackNote, Hold
from .steadiness import Phasors


@dataclass(frozen=True)
class ControlAction:
    """The next phase to play, and the notes to write at its first sample."""

    phase: Phase | None
    """Phase to play; None if only the notes are written, without sampling."""
    notes: tuple[FeedbackNote, ...] = ()


@dataclass(frozen=True, eq=False)
class PhaseSamples:
    """Samples of a phase of the run; if the phase has gaps, only the samples after the last gap."""

    first_sample: int
    volts: Samples
    """Voltages at the inputs, shape (channels, samples) [V]."""
    coefficients: tuple[Any, ...] = ()
    """Fourier coefficients that a real-time controller measured during the phase."""


Result = TypeVar("Result")
Controller: TypeAlias = Generator[ControlAction, PhaseSamples, Result]
"""Python generator that yields actions, is sent the samples of each phase, and returns a result."""

SILENCE = PhaseSamples(0, np.empty((0, 0)))
"""Empty samples that the controller receives after an action without a phase."""


def phase_samples(blocks: Sequence[Block]) -> PhaseSamples:
    """Return the joined blocks of a phase, from the last gap in the phase on; a paused run has gaps."""
    if not blocks:
        return SILENCE
    joined: list[Block] = []
    for block in blocks:
        if joined and block.first_sample != joined[-1].first_sample + joined[-1].volts.shape[1]:
            joined.clear()
        joined.append(block)
    return PhaseSamples(joined[0].first_sample, np.concatenate([block.volts for block in joined], axis=1))


_DEAD_SHARE = 0.3
"""Dead band relative to the tolerance. Errors in it are not corrected: a correction disturbs the motion."""
_SURE = 2.0
"""Number of standard uncertainties above which a level error counts as significant."""
_GAIN = 0.8
"""Fraction of the base's level error [dB] that a correction removes; below 1, as specimens respond slowly."""
_BATCHES = 8
"""Number of batches for the uncertainty of a mean, because successive chaotic periods are correlated."""


@dataclass(frozen=True)
class MeasuredLevel:
    """Amplitude of the base's fundamental in the unit of the channel, with its standard uncertainty."""

    amplitude: float
    uncertainty: float

    def hold_state(self, target: float, tolerance: float) -> Hold:
        """Return whether the amplitude deviates from ``target`` by at most ``tolerance`` times ``target``."""
        return Hold.WITHIN if abs(self.amplitude / target - 1) <= tolerance else Hold.OUTSIDE

    def correction(self, level: BaseLevel, target: float) -> float:
        """Return the factor for the amplitude setting; 1 if the level error is small or may be random."""
        if self.amplitude <= 0.0:
            return 1.0
        dead = max(_DEAD_SHARE * level.tolerance, _SURE * self.uncertainty / target)
        if abs(self.amplitude / target - 1) <= dead:
            return 1.0
        factor = (target / self.amplitude) ** _GAIN
        return float(min(max(factor, 1 / level.most_change), level.most_change))


def measured_level(base: Phasors) -> MeasuredLevel:
    """Return the mean fundamental of ``base``, shape (periods,), with its uncertainty from batch means."""
    if not len(base):
        return MeasuredLevel(0.0, 0.0)
    mean = complex(np.mean(base))
    amplitude = abs(mean)
    if len(base) < 2 * _BATCHES or amplitude == 0.0:
        return MeasuredLevel(amplitude, amplitude)
    along = (base * mean.conjugate() / amplitude).real
    length = len(base) // _BATCHES
    batches = along[len(base) - length * _BATCHES :].reshape(_BATCHES, length).mean(axis=1)
    return MeasuredLevel(amplitude, float(batches.std(ddof=1)) / sqrt(_BATCHES))
