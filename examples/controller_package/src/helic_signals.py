"""Conversions between vibench and a HELIC-DAQ board: Fourier series, laws, measured coefficients.

This module does not communicate with the board.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import InstrumentError
from vibench_fast_loop.protocol import LoopBlock, LoopFeedback, LoopProgram

Volts = NDArray[np.complex128]
READ = ("phase", "cmd_epoch", "out", "base", "m0")
"""Options that name the sources to be read; the default of each is the name of the option."""
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Signal:
    """Signal set on the board: frequency, and coefficient of each harmonic [V]."""

    frequency_hz: float
    volts: Volts

    def blend(self, other: "Signal", share: float) -> "Signal":
        """Return the signal at a ``share`` of the way to ``other``, along a half cosine."""
        share = 0.5 - 0.5 * float(np.cos(np.pi * min(share, 1.0)))
        frequency_hz = self.frequency_hz + share * (other.frequency_hz - self.frequency_hz)
        return Signal(frequency_hz, self.volts + share * (other.volts - self.volts))


@dataclass(frozen=True, eq=False)
class Glide:
    """Gradual change from one signal to another."""

    start: int
    """Number of the first sample."""
    samples: float
    begin: Signal
    end: Signal
    is_last: bool
    """Whether the gate closes at the end of the glide."""


def pd_gains(feedback: LoopFeedback | None, step_s: float) -> tuple[float, float, float]:
    """Return the gains kp and kd and the filter time tau [s] with which the board applies a law of m0.

    ``u = -kp s - kd d``, ``d += a ((s - before) / step - d)``, ``a = step / (tau + step)``: the responses to
    a single sample of 1 V are ``-kp - kd a / step``, and then ``kd a^2 / step (1 - a)^(n - 1)``.

    Raises
    ------
    InstrumentError
        When the law does not have this form.

    """
    if feedback is None:
        return 0.0, 0.0, 0.0
    memory, answers = np.array(feedback.inlet).reshape(-1, 2), [np.array(feedback.direct)]
    for _ in range(2 * len(memory) + 2):
        answers.append(np.array(feedback.output) @ memory)
        memory = np.array(feedback.step).reshape(len(memory), len(memory)) @ memory
    base, m0 = np.transpose(answers)
    kept = m0[2] / m0[1] if m0[1] else 0.0
    share = 1.0 - kept
    expected = m0[1] * kept ** np.arange(len(m0) - 1)
    largest = np.abs(answers).max()
    if np.any(base) or not 0.0 <= kept < 1.0 or np.abs(m0[1:] - expected).max() > _SAME * largest:
        raise InstrumentError(
            f"a law with {len(feedback.output)} state variables was requested, but HELIC-DAQ's PID accepts "
            "only proportional-derivative laws of m0's velocity. Nothing was changed; set "
            'pd_of = "m0_velocity" in [controller], and vibench designs such a law'
        )
    kd = m0[1] * step_s / share**2
    return float(-m0[0] - kd * share / step_s), float(kd), float(step_s * kept / share)


class Coefficients:
    """Fourier coefficients of output, base and m0 over blocks of periods, from samples as they come."""

    def __init__(self, program: LoopProgram, rate_hz: float) -> None:
        self._program = program
        self._rate_hz = rate_hz
        self.begin_anew()

    def begin_anew(self) -> None:
        """Discard the current block, because some of its samples are missing."""
        self._samples = np.empty((len(READ), 0))
        self._is_changed = False

    def take(self, samples: NDArray[np.float64], following: int, is_gliding: bool) -> list[LoopBlock]:  # noqa: FBT001
        """Add samples, shape (sources, samples), up to number ``following``; return the completed blocks."""
        self._samples = np.hstack([self._samples, samples])
        self._is_changed |= is_gliding
        blocks: list[LoopBlock] = []
        while True:
            phase = self._samples[0]
            turns = np.cumsum(np.diff(phase, prepend=phase[:1]) % 1.0)
            end = int(np.searchsorted(turns, self._program.block_periods))
            if end == turns.size:
                return blocks
            blocks.append(self._block(turns[:end], (following - turns.size + end) / self._rate_hz))
            self._samples, self._is_changed = self._samples[:, end:], is_gliding

    def _block(self, turns: NDArray[np.float64], end_s: float) -> LoopBlock:
        phase, epoch, *voltages = self._samples[:, : turns.size]
        weight = 1.0 - np.cos(2 * np.pi * turns / self._program.block_periods)
        orders = np.arange(self._program.harmonics + 1)
        found = (voltages * weight) @ np.exp(-2j * np.pi * np.outer(phase, orders)) / weight.sum()
        found[:, 1:] *= 2.0
        output, base, m0 = (tuple((float(each.real), float(each.imag)) for each in row) for row in found)
        # Every change of what is played advances the board's count of commands.
        steady = not self._is_changed and bool(np.all(epoch == epoch[0]))
        return LoopBlock(end_s=end_s, steady=steady, output=output, base=base, m0=m0)
