"""What a hardware configuration says of an analogue output that drives the amplifier."""

from enum import StrEnum

from pydantic import Field, PositiveFloat

from ..host.toml_file import FrozenModel


class OutputUse(StrEnum):
    """What an analogue output plays, beside a function generator that plays the rest."""

    STREAMS = "streams"
    """Only what never repeats, which no generator can hold."""
    TONES_AND_STREAMS = "tones_and_streams"
    """Sines too: dwells, steps and sweeps, for a bench on which the output stays plugged in."""


class OutputConfig(FrozenModel):
    """An analogue output that drives the amplifier with what a function generator cannot hold.

    It plays the voltage that the generator's terminal would have at the same setting, so that
    ``amplitude_vpp`` means the same whoever plays. Plug one of the two into the amplifier at a time: even
    at zero volts, an output of 50 ohm beside it would halve what the generator gives. The check at low
    level before every run finds the wrong one plugged in.
    """

    physical: str = Field(pattern=r"^ao\d+$")
    """Name on the device: ``"ao0"``."""
    plays: OutputUse = OutputUse.STREAMS
    device: str | None = None
    """The module of the output in the driver, when it is not the converter's own; both must be able
    to share a start trigger, as modules of one chassis are."""
    limit_v: PositiveFloat = Field(le=10.0)
    """Largest voltage that this bench allows, plus and minus [V]."""
    sample_rate_hz: PositiveFloat
    """Rate of the output; it must take this rate exactly."""
    # Three blocks of a run at least: one plays, one is ready, and one is being written.
    ahead_s: float = Field(default=0.5, ge=0.3, le=5.0)
    """How much is written ahead [s]: what a pause of this computer may last, and how long what is
    written already plays on before an early ramp down begins."""
    source: str = Field(min_length=1)
    """Where limit and rate come from."""
