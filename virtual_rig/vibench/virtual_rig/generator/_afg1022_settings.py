"""What the generator is set to, channel by channel, and what it allows.

Amplitude and offset are kept as the voltage without load. What the panel shows, and what commands and
queries speak of, is that voltage divided by the load the user has declared (``OUTP:IMP``): declaring
another load changes the reading, not the output.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum

from ._built_in_shape import FORMULAS
from ._phase_course import Spacing
from ._scpi_header import mnemonic_matches, short_form
from ._scpi_status import ErrorCode, ScpiError
from ._terminal_voltage import OUTPUT_RESISTANCE_OHM, Relay

LOWEST_FREQUENCY_HZ = 1e-6
LOWEST_BURST_FREQUENCY_HZ = 2e-3
MODULATING_RANGE_HZ = (2e-3, 20e3)
OPEN_AMPLITUDE_RANGE_VPP = (2e-3, 20.0)
"""Without load; 1 mVpp to 10 Vpp into 50 ohm (IVI driver tkafg1k)."""
OPEN_PEAK_V = 10.0
"""Largest |offset| + amplitude/2 without load, the stricter of the two published readings."""
MOST_BURST_CYCLES = 50_000
DECLARED_LOAD_RANGE_OHM = (1.0, 10e3)
_PEAK_ROUNDING_V = 1e-9


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


MODULATIONS = tuple(
    mode for mode in RunMode if mode not in (RunMode.CONTINUOUS, RunMode.SWEEP, RunMode.BURST)
)


class StandardShape(Enum):
    """The shapes with a button of their own."""

    SINE = "SINusoid"
    SQUARE = "SQUare"
    RAMP = "RAMP"
    PULSE = "PULSe"
    NOISE = "PRNoise"

    @property
    def short(self) -> str:
        """What a query answers."""
        return short_form(self.value)


SINE = StandardShape.SINE.short
SQUARE = StandardShape.SQUARE.short
RAMP = StandardShape.RAMP.short
PULSE = StandardShape.PULSE.short
NOISE = StandardShape.NOISE.short
DC = "DC"

_HIGHEST_FREQUENCY_HZ = {SINE: 25e6, SQUARE: 12.5e6, PULSE: 12.5e6, RAMP: 1e6, NOISE: 25e6}
_HIGHEST_MEMORY_FREQUENCY_HZ = 10e6
_HIGHEST_BUILT_IN_FREQUENCY_HZ = 1e6
# The public drivers and users also write the three-letter form.
_ALIASES = {"PRN": NOISE, "PRNO": NOISE}


def standard_or_built_in(word: str) -> str | None:
    """Return the canonical name of a shape that needs no memory, or None if the word means none."""
    if word.upper() in _ALIASES:
        return _ALIASES[word.upper()]
    for shape in StandardShape:
        if mnemonic_matches(word, shape.value):
            return shape.short
    return next((name for name in FORMULAS if name.upper() == word.upper()), None)


class Source(Enum):
    """Where the modulating signal comes from; nothing is connected to the external input."""

    INTERNAL = "INTernal"
    EXTERNAL = "EXTernal"


class BurstMode(Enum):
    """What starts a burst; nothing is connected to the gate input."""

    TRIGGERED = "TRIGgered"
    GATED = "GATed"


class SweepTrigger(Enum):
    """What starts a sweep, and a burst, of a generator that lets one choose."""

    IMMEDIATE = "IMMediate"
    BUS = "BUS"


@dataclass(frozen=True)
class ModulationSettings:
    """One kind of modulation."""

    amount: float
    """AM: depth [%]; FM: deviation [Hz]; PM, PSK: deviation [deg]; FSK: hop [Hz]; PWM: deviation [%];
    ASK: the other amplitude, without load [V]."""
    source: Source = Source.INTERNAL
    frequency_hz: float = 10e3
    shape: str = SINE


_DEFAULT_AMOUNT = {
    RunMode.AM: 50.0,
    RunMode.FM: 100e3,
    RunMode.PM: 90.0,
    RunMode.FSK: 100e3,
    RunMode.PWM: 5.0,
    RunMode.ASK: 1.0,
    RunMode.PSK: 180.0,
}


def _modulation_defaults() -> Mapping[RunMode, ModulationSettings]:
    return {mode: ModulationSettings(_DEFAULT_AMOUNT[mode]) for mode in MODULATIONS}


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
    modulation: Mapping[RunMode, ModulationSettings] = field(default_factory=_modulation_defaults)

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

        Raises ScpiError -221 for a peak beyond the output stage, a sweep of pulse or noise, a burst or
        modulation of noise, and pulse-width modulation of anything but a pulse. A frequency above what
        a newly selected shape allows is lowered.
        """
        if abs(self.offset_v) + self.amplitude_vpp / 2 > OPEN_PEAK_V + _PEAK_ROUNDING_V:
            raise ScpiError(ErrorCode.SETTINGS_CONFLICT)
        if self.mode is RunMode.SWEEP and self.shape in (PULSE, NOISE):
            raise ScpiError(ErrorCode.SETTINGS_CONFLICT)
        if self.mode is not RunMode.CONTINUOUS and self.shape == NOISE:
            raise ScpiError(ErrorCode.SETTINGS_CONFLICT)
        if self.mode is RunMode.PWM and self.shape != PULSE:
            raise ScpiError(ErrorCode.SETTINGS_CONFLICT)
        return self


def highest_frequency_hz(shape: str) -> float:
    """Return the highest frequency at which a shape can be played."""
    if shape in FORMULAS:
        return _HIGHEST_BUILT_IN_FREQUENCY_HZ
    return _HIGHEST_FREQUENCY_HZ.get(shape, _HIGHEST_MEMORY_FREQUENCY_HZ)
