"""What passes between a run and its controller: an action to take, and the samples of it."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, TypeAlias, TypeVar

import numpy as np

from ..excitation.feedback import BaseLevel
from ..instruments import Block, Samples
from ..plan import Phase
from ..recording import FeedbackNote, Held
from .steadiness import Phasors


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
    coefficients: tuple[Any, ...] = ()
    """What a real-time controller measured meanwhile."""


Result = TypeVar("Result")
Controller: TypeAlias = Generator[ControlAction, PhaseSamples, Result]
"""Yields actions and is sent the samples of each; returns what it was for."""

SILENCE = PhaseSamples(0, np.empty((0, 0)))
"""What is heard during notes alone."""


def phase_samples(blocks: Sequence[Block]) -> PhaseSamples:
    """Join the blocks of a phase; one before which samples are missing (the run was held) begins again."""
    if not blocks:
        return SILENCE
    joined: list[Block] = []
    for block in blocks:
        if joined and block.first_sample != joined[-1].first_sample + joined[-1].volts.shape[1]:
            joined.clear()
        joined.append(block)
    return PhaseSamples(joined[0].first_sample, np.concatenate([block.volts for block in joined], axis=1))


_DEAD_SHARE = 0.3
"""An error below this share of the tolerance is left alone: every change disturbs the motion."""
_SURE = 2.0
"""Standard uncertainties from which on an error counts as one."""
_GAIN = 0.8
"""Share of the error, in decibels, that is taken out at once: the specimen answers a change slowly."""
_BATCHES = 8
"""Stretches whose scatter gives the uncertainty of a mean: single periods of chaos are not independent."""


@dataclass(frozen=True)
class MeasuredLevel:
    """Amplitude of the base's fundamental [unit of the channel], with its standard uncertainty."""

    amplitude: float
    uncertainty: float

    def held(self, target: float, tolerance: float) -> Held:
        """Return whether it lies within a share of ``target``."""
        return Held.WITHIN if abs(self.amplitude / target - 1) <= tolerance else Held.OUTSIDE


def measured_level(base: Phasors) -> MeasuredLevel:
    """Average the fundamental over drive periods, shape (periods,), with the scatter of batches of them."""
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


@dataclass(frozen=True)
class LevelControl:
    """The law of control: quasi-static, once for every stretch that was measured."""

    level: BaseLevel
    most_vpp: float
    """Largest setting that the plan allows [V]."""
    least_vpp: float
    """Smallest setting that the generator takes [V]."""

    def next_vpp(self, setting_vpp: float, measured: MeasuredLevel, target: float) -> float:
        """Return the next setting; the same one when the level is held, or the error may be chance [V]."""
        if measured.amplitude <= 0.0:
            return setting_vpp
        error = abs(measured.amplitude / target - 1)
        dead = max(_DEAD_SHARE * self.level.tolerance, _SURE * measured.uncertainty / target)
        if error <= dead:
            return setting_vpp
        most = self.level.most_change
        factor = min(max((target / measured.amplitude) ** _GAIN, 1 / most), most)
        return float(min(max(setting_vpp * factor, self.least_vpp), self.most_vpp))
