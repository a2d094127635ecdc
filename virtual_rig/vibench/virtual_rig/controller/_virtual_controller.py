"""The simulated controller: what its host tells it, what it samples and plays, and when it falls silent."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from pydantic import ValidationError

from vibench.acquisition.instruments import (
    LOOP_PROTOCOL,
    LoopBlock,
    LoopFacts,
    LoopFeedback,
    LoopProgram,
    LoopReport,
    LoopRequest,
    LoopState,
)
from vibench.acquisition.rig import Rig

from ..generator import Reply
from ._answer import ComplexArray, FloatArray, LoopParts, Now

RAMP_S = 0.05
"""How fast it ramps down by itself [s]."""
LONGEST_AT_LIMIT_S = 0.05
"""An output that stays at its limit for so long is a law that does not hold: it ramps down [s]."""
MOST_BLOCKS = 2000
"""Blocks kept for a host that does not ask for them."""


class VirtualController:
    """A real-time controller between two sensors and the amplifier; any thread may call it.

    Parameters
    ----------
    facts
        Who it is, and what it can do.
    clock
        Rig time [s].
    grid_rate_hz
        Steps a second of the world that it samples; a whole number of them from sample to sample.

    """

    def __init__(self, facts: LoopFacts, clock: Callable[[], float], grid_rate_hz: float) -> None:
        self.facts = facts
        self.steps_per_sample = round(grid_rate_hz / facts.rate_hz)
        self.latency_steps = round(facts.latency_s * grid_rate_hz)
        self._clock = clock
        self._turn = threading.RLock()
        self._state = LoopState.SILENT
        self._reason = ""
        self._blocks: list[LoopBlock] = []
        self._now: FloatArray = np.zeros(len(Now))
        self._limit()
        self._program: LoopProgram | None = None
        self._reference: ComplexArray = np.zeros((2, 1), dtype=np.complex128)
        self._law: FloatArray = np.zeros((1, 2))
        self._memory: FloatArray = np.zeros(0)
        self._sums = self._done = np.zeros((3, 1), dtype=np.complex128)

    @property
    def is_on(self) -> bool:
        """Whether anything is played."""
        return self._state is not LoopState.SILENT

    @contextmanager
    def answering(self) -> Iterator[LoopParts]:
        """Hand out what samples are answered with; nothing is changed by its host meanwhile."""
        with self._turn:
            yield LoopParts(self._now, self._reference, self._law, self._memory, self._sums, self._done)

    def attend(self, time_s: float) -> None:
        """See to what `wants_attention` asked for at a rig time: keep a block, end, be silent."""
        with self._turn:
            if self._now[Now.DONE]:
                self._keep_block(time_s)
            self._watch()

    def execute(self, message: bytes) -> Reply:
        """Carry out one line of the protocol, and give the line that answers it."""
        try:
            request = LoopRequest.model_validate_json(message)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            return _line(_refusal(f"{place}: {first['msg']}; what it plays goes on"))
        with self._turn:
            self._now[Now.UNHEARD] = 0.0
            return _line(self._answered(request))

    def _answered(self, request: LoopRequest) -> str:
        match request:
            case LoopRequest(ask="hello"):
                return self.facts.model_dump_json()
            case LoopRequest(ask="play", program=LoopProgram() as program):
                self._play(program)
            case LoopRequest(ask="play"):
                return _refusal("play: no program was given; what it plays goes on")
            case LoopRequest(ask="silence", ramp_s=ramp_s):
                self._end("", ramp_s)
        blocks, self._blocks = tuple(self._blocks), []
        report = LoopReport(state=self._state, reason=self._reason, time_s=self._clock(), blocks=blocks)
        return report.model_dump_json()

    def _play(self, program: LoopProgram) -> None:
        now, before = self._now, self._program
        began = not self.is_on or before is None
        gone_from = np.zeros(0, dtype=np.complex128) if began else self._wanted()
        size = max(len(program.reference_v), len(gone_from))
        self._reference = np.zeros((2, size), dtype=np.complex128)
        self._reference[0, : len(gone_from)] = gone_from
        self._reference[1, : len(program.reference_v)] = [complex(*each) for each in program.reference_v]
        omega = 2 * np.pi * program.frequency_hz / self.facts.rate_hz
        if began:
            now[:] = 0.0
            self._limit()
            now[Now.OMEGA] = omega
        now[Now.OMEGA_FROM], now[Now.OMEGA_TO] = now[Now.OMEGA], omega
        glide_samples = max(program.glide_s * self.facts.rate_hz, 1.0)
        now[Now.GLIDE], now[Now.GLIDE_STEP] = 0.0, 1.0 / glide_samples
        now[Now.FADE], now[Now.FADE_STEP] = 1.0, 0.0
        now[Now.BLOCK] = program.block_periods
        now[[Now.TURNS, Now.WEIGHT, Now.STEADY]] = 0.0
        self._sums = np.zeros((3, program.harmonics + 1), dtype=np.complex128)
        self._done = np.zeros_like(self._sums)
        if began or before is None or program.feedback != before.feedback:
            self._law = _law_of(program.feedback)
            self._memory = np.zeros(2 * (len(self._law) - 1))
        self._program, self._state, self._reason = program, LoopState.PLAYING, ""
        now[Now.ON] = 1.0

    def _limit(self) -> None:
        rate_hz = self.facts.rate_hz
        self._now[Now.LIMIT] = self.facts.limit_v
        self._now[Now.MOST_UNHEARD] = self.facts.watchdog_s * rate_hz
        self._now[Now.MOST_AT_LIMIT] = LONGEST_AT_LIMIT_S * rate_hz

    def _wanted(self) -> ComplexArray:
        share = 0.5 - 0.5 * np.cos(np.pi * self._now[Now.GLIDE])
        return np.asarray(self._reference[0] + share * (self._reference[1] - self._reference[0]))

    def _end(self, reason: str, ramp_s: float) -> None:
        if self.is_on and self._state is not LoopState.ENDING:
            self._state, self._reason = LoopState.ENDING, reason
            self._now[Now.FADE_STEP] = 1.0 / max(ramp_s * self.facts.rate_hz, 1.0)

    def _watch(self) -> None:
        now = self._now
        if now[Now.UNHEARD] > now[Now.MOST_UNHEARD]:
            self._end(f"its host said nothing for {self.facts.watchdog_s:g} s", RAMP_S)
        elif now[Now.AT_LIMIT] > now[Now.MOST_AT_LIMIT]:
            self._end(f"its output stayed at its limit of {self.facts.limit_v:g} V", RAMP_S)
        if self._state is LoopState.ENDING and now[Now.FADE] <= 0.0:
            self._state = LoopState.SILENT
            now[[Now.ON, Now.UNHEARD, Now.AT_LIMIT]] = 0.0

    def _keep_block(self, end_s: float) -> None:
        output, base, m0 = (tuple((float(c.real), float(c.imag)) for c in row) for row in self._done)
        steady = bool(self._now[Now.DONE] > 1.0)
        self._now[Now.DONE] = 0.0
        if len(self._blocks) < MOST_BLOCKS:
            self._blocks.append(LoopBlock(end_s=end_s, steady=steady, output=output, base=base, m0=m0))


def controller_of(rig: Rig, clock: Callable[[], float]) -> VirtualController | None:
    """Give what closes a fast loop on a virtual rig; None where the rig has none."""
    told, virtual = rig.controller, rig.virtual
    if told is None or virtual is None:
        return None
    facts = LoopFacts(
        name="simulated controller",
        serial="virtual",
        rate_hz=told.rate_hz,
        latency_s=told.latency_s,
        limit_v=told.limit_v,
        watchdog_s=told.watchdog_s,
        pd_of=told.pd_of,
    )
    return VirtualController(facts, clock, virtual.grid_rate_hz)


def _law_of(feedback: LoopFeedback | None) -> FloatArray:
    """One table: memory and output below each other, memory and inputs beside each other."""
    if feedback is None:
        return np.zeros((1, 2))
    size = len(feedback.output)
    law = np.zeros((size + 1, size + 2))
    law[:size, :size] = np.reshape(feedback.step, (size, size))
    law[:size, size:] = np.reshape(feedback.inlet, (size, 2))
    law[size] = [*feedback.output, *feedback.direct]
    return law


def _refusal(sentence: str) -> str:
    return json.dumps({"vibench_loop": LOOP_PROTOCOL, "refused": sentence})


def _line(text: str) -> Reply:
    return Reply(text.encode() + b"\n")
