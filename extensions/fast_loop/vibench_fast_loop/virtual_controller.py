"""Simulated real-time controller: it plays a Fourier series and a law, and answers JSON lines.

It implements version 1 of `vibench_fast_loop.protocol`. Its watchdog counts samples, and ramps the output
down if the host sends no request for too long. Samples are means over a control step, and voltages are
delayed.
"""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from vibench.acquisition.rig import ControllerConfig
from vibench.sim.engine.library import Structure
from vibench.sim.engine.run import native_engine
from vibench.sim.shaker.loaded_shaker import LoadedShaker, ShakenMotion
from vibench.virtual_rig.generator.scpi_instrument import Reply
from vibench.virtual_rig.world.conversion import Signal
from vibench.virtual_rig.world.sensors import SensorParts

from .protocol import (
    LOOP_PROTOCOL,
    LoopBlock,
    LoopFacts,
    LoopProgram,
    LoopReport,
    LoopRequest,
    LoopState,
)

FloatArray = NDArray[np.float64]
RAMP_S = 0.05
"""Duration of a ramp that the controller starts by itself [s]."""
LONGEST_AT_LIMIT_S = 0.05
"""Time at the output limit after which the law counts as failed and the controller ramps down [s]."""
MOST_BLOCKS = 2000
"""Maximum number of blocks kept for a host that does not request them."""


class VirtualController:
    """A real-time controller between two sensors and the amplifier; calls are thread-safe.

    Parameters
    ----------
    facts
        Identity and capabilities of the controller.
    clock
        Function that returns the rig time [s].
    grid_rate_hz
        Time steps per second of the simulated world; a sample contains a whole number of them.
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
        self._program: LoopProgram | None = None
        self._now = self._controller()
        self.cables = LoopCables(self)
        """Connection of the controller to the simulated world."""

    @property
    def is_on(self) -> bool:
        """Whether the controller is playing or ramping down."""
        return self._state is not LoopState.SILENT

    @contextmanager
    def hold_state(self) -> Iterator[Structure]:
        """Yield the state with which samples are processed; the host cannot change this state meanwhile.

        The state is a `Controller` of native/structures.hpp.
        """
        with self._turn:
            yield self._now

    def attend(self, time_s: float) -> None:
        """Process the samples up to a rig time [s]: store a finished block, start a ramp or fall silent."""
        with self._turn:
            if self._now["done"]:
                self._keep_block(time_s)
            now = self._now
            if now["unheard"] > now["most_unheard"]:
                self._end(f"its host sent no request for {self.facts.watchdog_s:g} s", RAMP_S)
            elif now["at_limit"] > now["most_at_limit"]:
                self._end(f"its output stayed at its limit of {self.facts.limit_v:g} V", RAMP_S)
            if self._state is LoopState.ENDING and now["fade"] <= 0.0:
                self._state = LoopState.SILENT
                now["is_on"] = now["unheard"] = now["at_limit"] = 0

    def execute(self, message: bytes) -> Reply:
        """Execute one line of the protocol, and return the answer as a line."""
        try:
            request = LoopRequest.model_validate_json(message)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            answer = _refusal(f"{place}: {first['msg']}; the output continues")
        else:
            with self._turn:
                self._now["unheard"] = 0.0
                answer = self._execute_request(request)
        return Reply(answer.encode() + b"\n")

    def _execute_request(self, request: LoopRequest) -> str:
        match request:
            case LoopRequest(ask="hello"):
                return self.facts.model_dump_json()
            case LoopRequest(ask="play", program=LoopProgram() as program):
                self._play(program)
            case LoopRequest(ask="play"):
                return _refusal("play: no program was given; the output continues")
            case LoopRequest(ask="silence", ramp_s=ramp_s):
                self._end("", ramp_s)
        blocks, self._blocks = tuple(self._blocks), []
        report = LoopReport(state=self._state, reason=self._reason, time_s=self._clock(), blocks=blocks)
        return report.model_dump_json()

    def _play(self, program: LoopProgram) -> None:
        before = self._program
        began = not self.is_on or before is None
        omega = 2 * np.pi * program.frequency_hz / self.facts.rate_hz
        if began:
            self._now = self._controller()
            self._now["omega"] = omega
        now = self._now
        before_v, after_v = now["reference"].copy()
        share = 0.5 - 0.5 * np.cos(np.pi * now["glide"])
        now["reference"][0] = 0.0 if began else before_v + share * (after_v - before_v)
        now["reference"][1] = 0.0
        now["reference"][1, : len(program.reference_v)] = [complex(*each) for each in program.reference_v]
        now["harmonics"] = max(now["harmonics"], len(program.reference_v), program.harmonics)
        now["omega_from"], now["omega_to"] = now["omega"], omega
        now["glide"], now["glide_step"] = 0.0, 1.0 / max(program.glide_s * self.facts.rate_hz, 1.0)
        now["fade"], now["fade_step"] = 1.0, 0.0
        now["block"] = program.block_periods
        now["turns"] = now["weight"] = now["is_steady"] = now["sums"] = 0
        if began or before is None or program.feedback != before.feedback:
            now["remembered"] = now["memory"] = now["direct"] = 0
            if program.feedback is not None:
                size = len(program.feedback.output)
                now["remembered"] = size
                now["step"][:size, :size] = np.reshape(program.feedback.step, (size, size))
                now["inlet"][:size] = np.reshape(program.feedback.inlet, (size, 2))
                now["output"][:size], now["direct"] = program.feedback.output, program.feedback.direct
        self._program, self._state, self._reason = program, LoopState.PLAYING, ""
        now["is_on"] = 1

    def _controller(self) -> Structure:
        rate_hz = self.facts.rate_hz
        return native_engine().new(
            "Controller",
            limit=self.facts.limit_v,
            most_unheard=self.facts.watchdog_s * rate_hz,
            most_at_limit=LONGEST_AT_LIMIT_S * rate_hz,
        )

    def _end(self, reason: str, ramp_s: float) -> None:
        if self.is_on and self._state is not LoopState.ENDING:
            self._state, self._reason = LoopState.ENDING, reason
            self._now["fade_step"] = 1.0 / max(ramp_s * self.facts.rate_hz, 1.0)

    def _keep_block(self, end_s: float) -> None:
        count = 0 if self._program is None else self._program.harmonics + 1
        found = self._now["coefficients"][:, :count]
        output, base, m0 = (tuple((float(c.real), float(c.imag)) for c in row) for row in found)
        steady = bool(self._now["done"] > 1)
        self._now["done"] = 0
        if len(self._blocks) < MOST_BLOCKS:
            self._blocks.append(LoopBlock(end_s=end_s, steady=steady, output=output, base=base, m0=m0))


class _LoopEnd(IntEnum):
    """Result of a native call, as defined by `LoopEnd` in native/world.hpp."""

    COMPLETE = 0
    NEEDS_ATTENTION = 1
    MOTION_LOST = 2


class LoopCables:
    """Connection that passes samples to a controller and plays its voltages, on a fixed time grid.

    The simulated world continues while the controller is silent.
    """

    def __init__(self, loop: VirtualController) -> None:
        self._loop = loop
        engine, steps = native_engine(), loop.steps_per_sample
        self._late = np.zeros(loop.latency_steps + steps)
        self._cables = engine.new("LoopCables", late=self._late, steps_per_sample=steps)

    @property
    def is_on(self) -> bool:
        """Whether the controller is active, or delayed voltages remain to be played."""
        return self._loop.is_on or bool(self._late.any())

    def move(
        self,
        first: int,
        step_s: float,
        shaker: LoadedShaker,
        noise: FloatArray,
        sensors: tuple[SensorParts, SensorParts],
        motion: ShakenMotion,
        signals: FloatArray,
    ) -> int:
        """Advance the shaker as defined in `ClosedLoop`; return the number of completed time steps."""
        cables, drive = self._cables, signals[Signal.DRIVE]
        cables["first"], cables["begin"] = first, 0
        base = sensors[0].showing(motion.base_acceleration, signals[Signal.BASE_ACCELERATION])
        m0 = sensors[1].showing(motion.m0_velocity, signals[Signal.M0_VELOCITY])
        shaker.prepare(motion, drive, noise)
        native_engine().fill(cables, shaker=shaker.structure.ctypes.data, drive=drive, base=base, m0=m0)
        done, end = 0, _LoopEnd.COMPLETE
        while end is not _LoopEnd.MOTION_LOST and done < drive.size:
            with self._loop.hold_state() as loop:
                cables["controller"] = loop.ctypes.data
                end = _LoopEnd(native_engine().call("close_loop", cables))
                done = int(cables["begin"])
                self._loop.attend((first + done) * step_s)
        signals[Signal.AMPLIFIER, :done] = motion.amplifier_voltage[:done]
        return done


def controller_of(
    config: ControllerConfig, grid_rate_hz: float, clock: Callable[[], float]
) -> VirtualController:
    """Return the controller that a hardware configuration describes."""
    values = {name: getattr(config, name) for name in LoopFacts.model_fields if hasattr(config, name)}
    facts = LoopFacts(name="simulated controller", serial="virtual", **values)
    return VirtualController(facts, clock, grid_rate_hz)


def _refusal(sentence: str) -> str:
    return json.dumps({"vibench_loop": LOOP_PROTOCOL, "refused": sentence})
