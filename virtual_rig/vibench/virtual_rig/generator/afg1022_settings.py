"""What the generator is set to, channel by channel, and what it allows.

Amplitude and offset are kept as the voltage without load. What the panel shows, and what commands and
queries speak of, is that voltage divided by the load the user has declared (``OUTP:IMP``): declaring
another load changes the reading, not the output.
"""

from dataclasses import dataclass
from enum import Enum, StrEnum

from .phase_course import Spacing
from .scpi_message import ErrorCode, ScpiError, mnemonic_matches, short_form
from .terminal_voltage import OUTPUT_RESISTANCE_OHM, Relay

LOWEST_FREQUENCY_HZ = 1e-6
LOWEST_BURST_FREQUENCY_HZ = 2e-3
OPEN_AMPLITUDE_RANGE_VPP = (2e-3, 20.0)
"""Without load; 1 mVpp to 10 Vpp into 50 ohm (IVI driver tkafg1k)."""
OPEN_PEAK_V = 10.0
"""Largest |offset| + amplitude/2 without load, the stricter of the two published readings."""
_PEAK_ROUNDING_V = 1e-9
_HIGHEST_MEMORY_FREQUENCY_HZ = 10e6


class RunMode(StrEnum):
    """What the generator does with its carrier; values are the SCPI nodes."""

    CONTINUOUS = "CW"
    SWEEP = "SWE"
    BURST = "BURS"
    AM = "AM"
    FM = "FM"
    PM = "PM"
    FSK = "FSK"
    PWM = "PWM"
    ASK = "ASK"
    PSK = "PSK"


MODULATIONS = tuple(RunMode)[3:]
"""Can be left on at the panel, and switched off remotely; what they do to the output is not simulated."""


class StandardShape(Enum):
    """The shapes that need no memory."""

    SINE = "SINusoid"
    SQUARE = "SQUare"
    RAMP = "RAMP"
    PULSE = "PULSe"
    NOISE = "PRNoise"
    DC = "DC"

    @property
    def short(self) -> str:
        """What a query answers."""
        return short_form(self.value)


SINE = StandardShape.SINE.short
SQUARE = StandardShape.SQUARE.short
RAMP = StandardShape.RAMP.short
PULSE = StandardShape.PULSE.short
NOISE = StandardShape.NOISE.short
DC = StandardShape.DC.short

_HIGHEST_FREQUENCY_HZ = {SINE: 25e6, SQUARE: 12.5e6, PULSE: 12.5e6, RAMP: 1e6, NOISE: 25e6, DC: 1e6}


def standard_shape(word: str) -> str | None:
    """Return the canonical name of a shape that needs no memory, or None if the word means none."""
    if word.upper() in ("PRN", "PRNO"):  # public drivers and users write it so
        return NOISE
    return next((shape.short for shape in StandardShape if mnemonic_matches(word, shape.value)), None)


class BurstMode(Enum):
    """What starts a burst; nothing is connected to the gate input."""

    TRIGGERED = "TRIGgered"
    GATED = "GATed"


class SweepTrigger(Enum):
    """What starts a sweep, and a burst, of a generator that lets one choose."""

    IMMEDIATE = "IMMediate"
    BUS = "BUS"


@dataclass(frozen=True)
class OwnSweep:
    """A sweep whose time is set remotely, as some generators have it."""

    sweep_s: float = 1.0
    hold_s: float = 0.0
    spacing: Spacing = Spacing.LINEAR
    trigger: SweepTrigger = SweepTrigger.IMMEDIATE


@dataclass(frozen=True)
class ChannelSettings:
    """All settings of one channel; the defaults are those of ``*RST``."""

    relay: Relay = Relay.OPEN
    declared_load_ohm: float = OUTPUT_RESISTANCE_OHM
    """``math.inf`` for high impedance."""
    shape: str = SINE
    frequency_hz: float = 1e6
    amplitude_vpp: float = 2.0
    """Without load: 1 Vpp into 50 ohm."""
    offset_v: float = 0.0
    """Without load."""
    phase_deg: int = 0
    duty_percent: float = 50.0
    mode: RunMode = RunMode.CONTINUOUS
    sweep_start_hz: float = 100e3
    sweep_stop_hz: float = 1e6
    sweep: OwnSweep | None = None
    """None where time and spacing are the panel's."""
    burst_cycles: float = 5
    """``math.inf`` for a burst that never ends."""
    burst_mode: BurstMode = BurstMode.TRIGGERED

    @property
    def declared_share(self) -> float:
        """Displayed voltage over voltage without load."""
        return 1 / (1 + OUTPUT_RESISTANCE_OHM / self.declared_load_ohm)

    @property
    def frequency_range_hz(self) -> tuple[float, float]:
        """What the present shape and mode allow."""
        lowest = LOWEST_BURST_FREQUENCY_HZ if self.mode is RunMode.BURST else LOWEST_FREQUENCY_HZ
        return lowest, highest_frequency_hz(self.shape)

    def checked(self) -> "ChannelSettings":
        """Return these settings if they may stand together.

        Raises ScpiError -221 for a peak beyond the output stage, a sweep of pulse or noise, and a burst or
        modulation of noise.
        """
        is_swept_pulse = self.mode is RunMode.SWEEP and self.shape == PULSE
        is_moded_noise = self.mode is not RunMode.CONTINUOUS and self.shape == NOISE
        peak_v = abs(self.offset_v) + self.amplitude_vpp / 2
        if peak_v > OPEN_PEAK_V + _PEAK_ROUNDING_V or is_swept_pulse or is_moded_noise:
            raise ScpiError(ErrorCode.SETTINGS_CONFLICT)
        return self


def highest_frequency_hz(shape: str) -> float:
    """Return the highest frequency at which a shape can be played."""
    return _HIGHEST_FREQUENCY_HZ.get(shape, _HIGHEST_MEMORY_FREQUENCY_HZ)
