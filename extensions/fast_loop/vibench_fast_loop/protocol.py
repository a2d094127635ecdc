"""Messages between a host, which sends programs, and a controller, which returns Fourier coefficients.

Version 1 of the protocol. Each message is one line of JSON, answered by one line; the host always begins.
``{"vibench_loop": 1, "ask": "hello" | "play" | "report" | "silence", ...}``; the rest is in docs/feedback.md.
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
"""Largest number of state variables of a feedback law."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
Row = tuple[Finite, ...]
Pair = tuple[Finite, Finite]
"""Real and imaginary part of a Fourier coefficient."""


class LoopFeedback(FrozenModel):
    """A linear law: u = output m + direct s; then m = step m + inlet s, for input volts s and memory m."""

    step: tuple[Row, ...] = Field(max_length=MOST_MEMORY)
    """Matrix that maps the memory to its next state, shape (n, n), as rows."""
    inlet: tuple[Row, ...]
    """Matrix that maps the samples to the next state of the memory, shape (n, 2), as rows [per V]."""
    output: Row
    """Row that maps the memory to the output voltage, shape (n,) [V]."""
    direct: Row
    """Row that maps the samples to the output voltage, shape (2,) [V/V]."""

    @model_validator(mode="after")
    def _shapes_agree(self) -> Self:
        memory, inputs = len(self.output), len(LoopInput)
        widths = [*(len(row) == memory for row in self.step), *(len(row) == inputs for row in self.inlet)]
        if not (all(widths) and len(self.step) == len(self.inlet) == memory and len(self.direct) == inputs):
            raise ValueError(
                f"a law with {memory} states needs 'step' of {memory} x {memory}, 'inlet' of {memory} x "
                f"{inputs} and 'direct' of {inputs}; make the shapes agree"
            )
        return self


class LoopProgram(FrozenModel):
    """What a controller plays: a Fourier series plus the output of a feedback law.

    ``v(t) = sum Re(reference_k exp(i k theta)) + u``, where the controller's phase theta is
    continuous from program to program.
    """

    frequency_hz: PositiveFloat
    reference_v: tuple[Pair, ...] = Field(min_length=1, max_length=MOST_HARMONICS)
    """Coefficients of all harmonics, the first harmonic first, as real and imaginary part [V]."""
    feedback: LoopFeedback | None = None
    """Feedback law; None for no feedback. An unchanged law keeps its memory."""
    glide_s: NonNegativeFloat = 0.1
    """Duration of the change to this program's frequency and coefficients, along a half cosine [s]."""
    block_periods: int = Field(default=10, ge=2, le=1000)
    """Number of periods in a block of measured coefficients, under a Hann window."""
    harmonics: int = Field(default=9, ge=1, le=MOST_HARMONICS)
    """Highest harmonic whose coefficient is measured."""


class LoopState(StrEnum):
    """State of a controller."""

    SILENT = "silent"
    PLAYING = "playing"
    ENDING = "ending"
    """The controller ramps its output down."""


class LoopBlock(FrozenModel):
    """Fourier coefficients of one block of periods, as real and imaginary part [V]; the mean comes first."""

    end_s: float
    """End of the block on the clock of the controller [s]."""
    steady: bool
    """Whether the program stayed the same during the block."""
    output: tuple[Pair, ...]
    """Coefficients of the output voltage of program and law together, starting with the mean [V]."""
    base: tuple[Pair, ...]
    m0: tuple[Pair, ...]


class LoopReport(FrozenModel):
    """Report of a controller. Each measured block appears in exactly one report."""

    vibench_loop: Literal[1] = LOOP_PROTOCOL
    state: LoopState
    reason: str = ""
    """Reason why the controller ramps down or is silent without a command; otherwise empty."""
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
    """Largest output voltage of the controller, peak [V]."""
    watchdog_s: PositiveFloat
    """Time without a request after which the controller ramps down by itself [s]."""
    pd_of: LoopInput | None = None
    """Only input of a controller limited to proportional-derivative laws; None if it accepts other laws."""


class LoopRequest(FrozenModel):
    """A request from the host to the controller."""

    vibench_loop: Literal[1] = LOOP_PROTOCOL
    ask: Literal["hello", "play", "report", "silence"]
    program: LoopProgram | None = None
    """Program for the request "play"."""
    ramp_s: NonNegativeFloat = 0.1
    """Ramp duration for a request "silence" [s]."""


@dataclass(frozen=True)
class ProgramTone(LoopTone):
    """A sine in the plan, with the program by which the controller plays it."""

    program: LoopProgram | None = None


class LoopController(RealTimeController, Protocol):
    """A control loop from two sensors to the amplifier, which plays programs from a host."""

    @property
    def facts(self) -> LoopFacts:
        """Identity and capabilities of the controller."""

    def play(self, program: LoopProgram) -> LoopReport:
        """Change to a program over the program's glide time; return the controller's report."""

    def report(self) -> LoopReport:
        """Return the state and the blocks measured since the last report, and restart the watchdog.

        Raises InstrumentLost when the controller does not answer.
        """

    def silence(self, ramp_s: float) -> LoopReport:
        """Ramp down to silence; allowed at any time. Return the controller's report."""


class ControllerDriver(Protocol):
    """Type of an entry point in ``vibench.controllers``."""

    def open(self, config: ControllerConfig) -> LoopController:
        """Connect to a controller and silence it; raises InstrumentError if no controller answers."""
