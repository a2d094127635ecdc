"""What instruments hand over: who they are, samples, and what a person must confirm."""

from dataclasses import dataclass
from datetime import date
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from ..host.toml_file import FrozenModel

Samples = NDArray[np.float64]
Counts = NDArray[np.int32]


@dataclass(frozen=True)
class Identity:
    """Who an instrument says it is, kept with every recording."""

    maker: str
    model: str
    serial: str
    firmware: str
    reply: str
    """The whole reply, as it came."""
    origin: str = ""
    """``"simulated"`` or ``"imported"`` where the instrument knows that its numbers are; else empty."""


class Knob(FrozenModel):
    """A setting made by hand that no instrument reports: the operator confirms it."""

    instrument: str
    setting: str
    value: str


@dataclass(frozen=True)
class FoundDevice:
    """A converter that was found."""

    name: str
    """For ``daq.device``."""
    product: str
    """For ``daq.product``."""
    serial: str
    inputs: tuple[str, ...]
    """For ``daq.channels.physical``, the part behind the slash."""
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Overload:
    """An input past 95 % of its range: which channel, and which samples of the run."""

    channel: str
    """Role of the channel, ``"m0_velocity"`` for example."""
    first_sample: int
    last_sample: int
    """Inclusive; counted from the first sample of the run."""


@dataclass(frozen=True)
class Block:
    """Samples handed over at once, for all channels, without a gap to the block before."""

    first_sample: int
    """Position of the first sample in the run."""
    volts: Samples
    """Shape (channels, samples) [V] at the converter's input."""
    overloads: tuple[Overload, ...] = ()
    counts: Counts | None = None
    """The converter's own numbers, where volts are these times `Digitizer.volts_per_count`: recorded as they
    are. None where the converter gives volts only."""


def _not_zero(units: float) -> float:
    if units == 0:
        raise ValueError("a sensor that gives no volts measures nothing")
    return units


@dataclass(frozen=True)
class SensorFacts:
    """How a sensor turns its quantity into volts."""

    quantity: str
    """``"voltage"``, ``"acceleration"`` or ``"velocity"``: what the role of its channel records."""
    unit: str
    """UDUNITS text: ``"V"``, ``"m s-2"``, ``"m s-1"``."""
    units_per_volt: Annotated[float, AfterValidator(_not_zero)]
    full_scale_v: Annotated[float, Field(gt=0, allow_inf_nan=True)]
    """Largest output, peak [V]; infinite for a wire."""
    name: str
    serial: str = ""
    delay_s: Annotated[float, Field(ge=0)] = 0.0
    """How much later its volts are than the quantity [s]."""
    calibrated: date | None = None
