"""What an AFG1022 can do: ranges by shape and load, checked before anything is sent."""

from enum import StrEnum
from math import inf
from typing import Literal

from ..errors import LimitExceeded
from ..rig import HIGH_Z, GeneratorConfig

Load = Literal["high-z"] | float

# Source of the figures: Tektronix AFG1022 specification, as the IVI driver tkafg1k checks them.
SOURCE_OHM = 50.0
LOWEST_HZ = 1e-6
_OPEN_MINIMUM_VPP = 2e-3
_OPEN_MAXIMUM_VPP = 20.0
# Drivers and measurements agree on 10 V; the IVI driver allows twice that. The stricter one holds.
_OPEN_PEAK_V = 10.0
LOAD_RANGE_OHM = (1.0, 10_000.0)
BURST_CYCLES = (1, 50_000)


class Shape(StrEnum):
    """A shape that the driver plays; the value is its SCPI word."""

    SINE = "SIN"
    EDIT_MEMORY = "EMEM"


HIGHEST_HZ = {Shape.SINE: 25e6, Shape.EDIT_MEMORY: 10e6}


def shown_fraction(load: Load) -> float:
    """Part of the open-circuit voltage that the panel shows for a load: its voltage divider."""
    ohm = inf if load == HIGH_Z else float(load)
    return 1.0 if ohm == inf else ohm / (ohm + SOURCE_OHM)


def instrument_range_vpp(load: Load) -> tuple[float, float]:
    """Smallest and largest setting of the instrument with a load, peak to peak [V]."""
    fraction = shown_fraction(load)
    return _OPEN_MINIMUM_VPP * fraction, _OPEN_MAXIMUM_VPP * fraction


def amplitude_range_vpp(config: GeneratorConfig) -> tuple[float, float]:
    """Smallest and largest amplitude setting of this bench, peak to peak [V]."""
    lowest, highest = instrument_range_vpp(config.load_ohm)
    return lowest, min(highest, config.amplitude_limit_vpp)


def check_frequency(shape: Shape, frequency_hz: float) -> None:
    """Raise LimitExceeded unless the generator can play ``shape`` so often a second."""
    if not LOWEST_HZ <= frequency_hz <= HIGHEST_HZ[shape]:
        raise LimitExceeded(
            f"{frequency_hz:g} Hz was asked for; an AFG1022 plays {shape.value} from {LOWEST_HZ:g} to "
            f"{HIGHEST_HZ[shape]:g} Hz. Nothing was sent; choose a frequency in that range"
        )


def check_amplitude(config: GeneratorConfig, amplitude_vpp: float, offset_v: float) -> None:
    """Raise LimitExceeded unless bench and generator allow this amplitude with this offset."""
    lowest, highest = amplitude_range_vpp(config)
    if not lowest <= amplitude_vpp <= highest:
        reason = (
            f"generator.amplitude_limit_vpp = {config.amplitude_limit_vpp:g}"
            if highest == config.amplitude_limit_vpp
            else f"the AFG1022's range into {_load_text(config.load_ohm)}"
        )
        raise LimitExceeded(
            f"{amplitude_vpp:g} Vpp was asked for; {lowest:g} to {highest:g} Vpp are allowed here "
            f"({reason}). Nothing was sent; choose an amplitude in that range"
        )
    largest_peak_v = min(_OPEN_PEAK_V * shown_fraction(config.load_ohm), config.amplitude_limit_vpp / 2)
    peak_v = abs(offset_v) + amplitude_vpp / 2
    if not peak_v <= largest_peak_v:
        raise LimitExceeded(
            f"{amplitude_vpp:g} Vpp around {offset_v:g} V peaks at {peak_v:g} V; {largest_peak_v:g} V is "
            "allowed (abs(offset) + Vpp/2, of the generator and of generator.amplitude_limit_vpp). "
            "Nothing was sent; lower one of them"
        )


def _load_text(load: Load) -> str:
    return load if isinstance(load, str) else f"{load:g} ohm"
