"""Messages between a host, which sends programs, and a controller, which returns Fourier coefficients.

Version 1 of the protocol. Each message is one line of JSON, answered by one line; the host always begins.
``{"vibench_loop": 1, "ask": "hello" | "play" | "report" | "silence", ...}``; docs/feedback.md has the rest.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final, Literal, Protocol, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from vibench.acquisition.excitation.steps import LoopTone
from vibench.acquisition.instruments import RealTimeController
from vibench.acquisition.rig import ControllerConfig, LoopInput
from vibench.sim import FrozenModel

LOOP_PROTOCOL: Final = 1
MOST_HARMONICS = 20
MOST_MEMORY = 64
"""Largest size of a feedback's memory."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
Row = tuple[Finite, ...]
Pair = tuple[Finite, Finite]
"""Real and imaginary part."""


class LoopFeedback(FrozenModel):
    """A linear law: u = output m + direct s, then m = step m + inlet s; s the input volts, m the memory."""

    step: tuple[Row, ...] = Field(max_length=MOST_MEMORY)
    """Shape (n, n)."""
    inlet: tuple[Row, ...]
    """Shape (n, 2) [per V]."""
    output: Row
    """Shape (n,) [V]."""
    direct: Row
    """Shape (2,) [V/V]."""

    @model_validator(mode="after")
    def _shapes_agree(self) -> Self:
        memory, inputs = len(self.output), len(LoopInput)
        widths = [*(len(row) == memory for row in self.step), *(len(row) == inputs for row in self.inlet)]
        if not (all(widths) and len(self.step) == len(self.inlet) == memory and len(self.direct) == inputs):
            raise ValueError(
                f"a feedback of {memory} outputs needs step of {memory} x {memory}, inlet of {memory} x "
                f"{inputs} and direct of {inputs}; make the shapes agree"
            )
        return self


class LoopProgram(FrozenModel):
    """What a controller plays: a Fourier series plus the output of a law.

    ``v(t) = sum Re(reference_k exp(i k theta)) + u``; theta is the controller's phase, which is continuous
    from program to program.
    """

    frequency_hz: PositiveFloat
    reference_v: tuple[Pair, ...] = Field(min_length=1, max_length=MOST_HARMONICS)
    """Coefficients from the first harmonic on, as pairs [V]."""
    feedback: LoopFeedback | None = None
    """None for no feedback; an unchanged law keeps its memory."""
    glide_s: NonNegativeFloat = 0.1
    """Duration of the change to this program's frequency and coefficients, along a half cosine [s]."""
    block_periods: int = Field(default=10, ge=2, le=1000)
    """Periods of a block of measured coefficients, with a Hann window."""
    harmonics: int = Field(default=9, ge=1, le=MOST_HARMONICS)
    """Highest measured harmonic."""


class LoopState(StrEnum):
    """State of a controller."""

    SILENT = "silent"
    PLAYING = "playing"
    ENDING = "ending"
    """It ramps down by itself."""


class LoopBlock(FrozenModel):
    """Fourier coefficients of one block of periods, from the mean on, as pairs in volts."""

    end_s: float
    """End of the block by the controller's clock [s]."""
    steady: bool
    """Whether nothing changed during the block."""
    output: tuple[Pair, ...]
    """Output of the program."""
    base: tuple[Pair, ...]
    m0: tuple[Pair, ...]


class LoopReport(FrozenModel):
    """Report of a controller; each block is reported once."""

    vibench_loop: Literal[1] = LOOP_PROTOCOL
    state: LoopState
    reason: str = ""
    """Why it is ending or silent without a command."""
    time_s: float
    blocks: tuple[LoopBlock, ...] = ()


class LoopFacts(FrozenModel):
    """Identity and capabilities of a controller."""

    vibench_loop: Literal[1] = LOOP_PROTOCOL
    name: str
    serial: str
    rate_hz: PositiveFloat
    latency_s: NonNegativeFloat
    limit_v: PositiveFloat
    """Largest output, peak [V]."""
    watchdog_s: PositiveFloat
    """Time without a request after which it ramps down [s]."""
    pd_of: LoopInput | None = None
    """The only input on which it takes a proportional-derivative law; None: any linear law."""


class LoopRequest(FrozenModel):
    """A request of the host."""

    vibench_loop: Literal[1] = LOOP_PROTOCOL
    ask: Literal["hello", "play", "report", "silence"]
    program: LoopProgram | None = None
    """Program of "play"."""
    ramp_s: NonNegativeFloat = 0.1
    """Ramp duration of "silence" [s]."""


@dataclass(frozen=True)
class ProgramTone(LoopTone):
    """A sine with the controller's program that plays it."""

    program: LoopProgram | None = None


class LoopController(RealTimeController, Protocol):
    """A control loop from two sensors to the amplifier, with programs from a host."""

    @property
    def facts(self) -> LoopFacts:
        """Rate, latency, limit and watchdog."""

    def play(self, program: LoopProgram) -> LoopReport:
        """Change to a program, along its glide."""

    def report(self) -> LoopReport:
        """Return the blocks measured since the last report, and restart the watchdog.

        Raises InstrumentLost when the controller does not answer.
        """

    def silence(self, ramp_s: float) -> LoopReport:
        """Ramp down to silence; allowed at any time."""


class ControllerDriver(Protocol):
    """Type of an entry point of ``vibench.controllers``."""

    def open(self, config: ControllerConfig) -> LoopController:
        """Connect to a controller and silence it; raises InstrumentError if none or another one answers."""
