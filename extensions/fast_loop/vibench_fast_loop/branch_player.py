"""Player of controller settings; it measures base and m0 until the standard errors are small."""

from collections.abc import Generator
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition.control.control_action import ControlAction, PhaseSamples
from vibench.acquisition.control.feedback_channels import require_answer
from vibench.acquisition.control.sine_loop import SineLoop
from vibench.acquisition.excitation.steps import Segment
from vibench.acquisition.plan import Phase, RunState

from .branch_continuation import BranchContinuation
from .branch_solver import LoopSetting
from .fast_loop import Coefficients, FastLoop
from .protocol import LoopBlock, LoopProgram, ProgramTone

Vector = NDArray[np.float64]
_BLOCK_PERIODS = 10
_GLIDE_S = 0.1
_HIGHEST = 9
_MOST_LOOKS = 20
_KNOWN, _KNOWN_HARMONIC, _KNOWN_RATIO = 0.1, 0.2, 0.02
"""Largest standard errors at the end of a measurement. Those of the base's fundamental and harmonics are
relative to the tolerance, that of m0 is relative to m0's amplitude."""
_ROUGHLY = 0.15
"""Largest standard error of the base motion far from the level, relative to the distance from the level."""
_DRIFT = 3.0
"""Largest difference between the two halves of the settled blocks, in standard errors."""
_REMEMBERED = 0.8
"""Weight of earlier measurements' scatter, because a few blocks of one measurement may agree by chance."""


@dataclass(frozen=True, eq=False)
class LoopLook:
    """Response of base and m0 to a setting: mean harmonics over blocks, starting with the first harmonic."""

    base_m: Coefficients
    m0_m: Coefficients
    base_u: Vector
    """Standard error of real and imaginary part of each coefficient [m]."""
    m0_u: Vector

    @property
    def ratio(self) -> complex:
        """Ratio of the fundamentals of m0 and base."""
        return complex(self.m0_m[0] / self.base_m[0])

    @property
    def ratio_u(self) -> float:
        """Standard error of the real and of the imaginary part of `ratio`."""
        shares = self.m0_u[0] / abs(self.m0_m[0]), self.base_u[0] / abs(self.base_m[0])
        return float(abs(self.ratio) * np.hypot(*shares))


class BranchPlayer:
    """Player of controller settings, which measures the response of base and m0 to each setting."""

    def __init__(self, loop: SineLoop, plan: BranchContinuation, fast: FastLoop) -> None:
        self.plan = plan
        self.fast = fast
        self.run = loop.run_phase
        self._most_vpp = loop.most_vpp
        self._feedback = fast.feedback
        self._blocks: list[LoopBlock] = []
        """Blocks of coefficients measured at the current setting since the motion settled."""
        self._squares, self._degrees = np.zeros(1), 0.0
        """Sum of squared deviations of blocks in earlier measurements, and the sum's degrees of freedom."""

    def tone(self, setting: LoopSetting, glide_s: float = _GLIDE_S) -> ProgramTone:
        """Return a setting as a program of the controller."""
        program = LoopProgram(
            frequency_hz=setting.frequency_hz,
            reference_v=tuple((float(each.real), float(each.imag)) for each in setting.reference_v),
            feedback=self._feedback,
            glide_s=glide_s,
            block_periods=_BLOCK_PERIODS,
            harmonics=max(_HIGHEST, self.plan.harmonics),
        )
        level = 2 * abs(setting.reference_v[0]) / self._most_vpp
        return ProgramTone(setting.frequency_hz, min(float(level), 1.0), program)

    def measure(
        self, setting: LoopSetting, level_m: float
    ) -> Generator[ControlAction, PhaseSamples, LoopLook]:
        """Play a setting, and average until the standard errors are small enough; return the response."""
        tone, frequency_hz = self.tone(setting), setting.frequency_hz
        look_s = self.plan.look_periods / frequency_hz
        samples = yield from self.run(Phase(RunState.SETTLING, tone, self.plan.settle_s + look_s))
        self._blocks = list(samples.coefficients)[-max(2, self.plan.look_periods // _BLOCK_PERIODS) :]
        look, squares, degrees = self._average(frequency_hz)
        for _ in range(_MOST_LOOKS - 1):
            if _is_known(look, level_m, self.plan):
                break
            samples = yield from self.run(Phase(RunState.SETTLING, tone, look_s))
            self._blocks += samples.coefficients
            look, squares, degrees = self._average(frequency_hz)
        self._squares = _REMEMBERED * (self._squares + squares)
        self._degrees = _REMEMBERED * (self._degrees + degrees)
        acceleration = abs(look.base_m[0]) * (2 * pi * frequency_hz) ** 2
        require_answer(self.fast.rig, frequency_hz, 2 * abs(setting.reference_v[0]) * 0.1, acceleration)
        return look

    def record(
        self, setting: LoopSetting, segment: Segment
    ) -> Generator[ControlAction, PhaseSamples, LoopLook]:
        """Record the current setting; return the average over the recording and the measurement before it."""
        tone = self.tone(setting)
        samples = yield from self.run(Phase(RunState.RECORDING, tone, self.plan.record_s, segment))
        self._blocks += samples.coefficients
        return self._average(setting.frequency_hz)[0]

    def _average(self, frequency_hz: float) -> tuple[LoopLook, Vector, int]:
        base, m0 = self.fast.motions(self._blocks, frequency_hz)
        seen = _settled_part(np.hstack([base, m0]))
        mean, degrees = seen.mean(axis=0), len(seen) - 1
        squares = 0.5 * np.sum(np.abs(seen - mean) ** 2, axis=0)
        known = max(self._degrees + degrees, 1.0)
        error = np.sqrt((self._squares + squares) / known / len(seen))
        orders = base.shape[1]
        look = LoopLook(mean[:orders], mean[orders:], error[:orders], error[orders:])
        return look, squares, degrees


def _settled_part(seen: Coefficients) -> Coefficients:
    """Return the second half of the blocks, halved again while its two halves differ."""
    while len(seen) > 3:
        first, second = seen[: len(seen) // 2], seen[len(seen) // 2 :]
        # Differences of neighbours are used, because a drift hardly changes them.
        scatter = np.sqrt(0.5 * np.mean(np.abs(np.diff(seen, axis=0)) ** 2, axis=0))
        moved = np.abs(first.mean(axis=0) - second.mean(axis=0))
        error = scatter * np.sqrt(1 / len(first) + 1 / len(second))
        fundamentals = [0, seen.shape[1] // 2]
        if np.all((moved <= _DRIFT * error)[fundamentals]):
            break
        seen = second
    return seen


def _is_known(look: LoopLook, level_m: float, plan: BranchContinuation) -> bool:
    """Return whether the standard errors are small enough for the base's present distance from the level."""
    share = look.base_u[: plan.harmonics] / level_m
    wrong = abs(abs(look.base_m[0]) / level_m - 1)
    return bool(
        share[0] <= max(_KNOWN * plan.tolerance, _ROUGHLY * wrong)
        and share[1:].max() <= max(_KNOWN_HARMONIC * plan.tolerance, _ROUGHLY * wrong)
        and look.m0_u[0] <= _KNOWN_RATIO * abs(look.m0_m[0])
    )
