"""Output of one channel, which converts changes of settings to signals of a timeline."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from operator import attrgetter

from .scpi_message import ArbitraryMemory, ErrorCode, ScpiError, mnemonic_matches
from .terminal_voltage import (
    OUTPUT_RESISTANCE_OHM,
    UHZ_PER_HZ,
    Burst,
    PeriodicShape,
    PhaseCourse,
    Rectangle,
    Relay,
    Signal,
    Sine,
    Spacing,
    SteadyPhase,
    SweptPhase,
    Table,
    Terminal,
    Timeline,
    Triangle,
)

# Settings of each channel, with limits. Amplitude and offset are stored as open-circuit voltages. The panel,
# commands and queries use the voltage across the declared load (``OUTP:IMP``). Declaring another load
# therefore changes the reading, not the output.

LOWEST_FREQUENCY_HZ = 1e-6
LOWEST_BURST_FREQUENCY_HZ = 2e-3
OPEN_AMPLITUDE_RANGE_VPP = (2e-3, 20.0)
"""Amplitude limits in open circuit, for 1 mVpp to 10 Vpp into 50 ohm (IVI driver tkafg1k)."""
OPEN_PEAK_V = 10.0
"""Largest |offset| + amplitude/2 in open circuit [V], the stricter of two published values."""
_PEAK_ROUNDING_V = 1e-9
_HIGHEST_MEMORY_FREQUENCY_HZ = 10e6


class RunMode(StrEnum):
    """Run modes of the generator; the values are SCPI nodes."""

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
"""Modulations, which SCPI can switch off but not on; the effect of modulation is not simulated."""


SINE, SQUARE, RAMP, PULSE, NOISE, DC = "SIN", "SQU", "RAMP", "PULS", "PRN", "DC"
_WORDS = {
    "SINusoid": SINE,
    "SQUare": SQUARE,
    "RAMP": RAMP,
    "PULSe": PULSE,
    "PRNoise": NOISE,
    "PRNO": NOISE,
    "DC": DC,
}
"""Shapes that need no waveform memory; PRNO (noise) is the spelling in public drivers."""
_HIGHEST_FREQUENCY_HZ = {SINE: 25e6, SQUARE: 12.5e6, PULSE: 12.5e6, RAMP: 1e6, NOISE: 25e6, DC: 1e6}


def standard_shape(word: str) -> str | None:
    """Return the short name of a shape that needs no waveform memory; None for other words."""
    return next((shape for known, shape in _WORDS.items() if mnemonic_matches(word, known)), None)


class BurstMode(StrEnum):
    """Trigger of a burst; nothing is connected to the gate input."""

    TRIGGERED = "TRIGgered"
    GATED = "GATed"


class Trigger(StrEnum):
    """Trigger of a sweep, for generators that offer a choice."""

    IMMEDIATE = "IMMediate"
    BUS = "BUS"


@dataclass(frozen=True)
class ChannelSettings:
    """All settings of one channel; the defaults are the state after ``*RST``."""

    relay: Relay = Relay.OPEN
    declared_load_ohm: float = OUTPUT_RESISTANCE_OHM
    """Declared load [ohm]; ``math.inf`` for high impedance."""
    shape: str = SINE
    frequency_hz: float = 1e6
    amplitude_vpp: float = 2.0
    """Amplitude in open circuit, peak to peak [V]; the default is 1 Vpp into 50 ohm."""
    offset_v: float = 0.0
    """Offset voltage in open circuit [V]."""
    phase_deg: int = 0
    duty_percent: float = 50.0
    mode: RunMode = RunMode.CONTINUOUS
    sweep_start_hz: float = 100e3
    sweep_stop_hz: float = 1e6
    sweep_s: float = 1.0
    sweep_hold_s: float = 0.0
    sweep_spacing: Spacing = Spacing.LINEAR
    trigger: Trigger = Trigger.IMMEDIATE
    burst_cycles: float = 5
    """Number of periods in a burst; ``math.inf`` for an endless burst."""
    burst_mode: BurstMode = BurstMode.TRIGGERED

    @property
    def declared_share(self) -> float:
        """Ratio of displayed voltage to open-circuit voltage."""
        return 1 / (1 + OUTPUT_RESISTANCE_OHM / self.declared_load_ohm)

    @property
    def frequency_range_hz(self) -> tuple[float, float]:
        """Frequency limits of the current shape and run mode [Hz]."""
        lowest = LOWEST_BURST_FREQUENCY_HZ if self.mode is RunMode.BURST else LOWEST_FREQUENCY_HZ
        return lowest, highest_frequency_hz(self.shape)

    def check(self) -> None:
        """Refuse a peak that the output stage cannot deliver, and noise in any mode but continuous (-221)."""
        is_moded_noise = self.mode is not RunMode.CONTINUOUS and self.shape == NOISE
        peak_v = abs(self.offset_v) + self.amplitude_vpp / 2
        if peak_v > OPEN_PEAK_V + _PEAK_ROUNDING_V or is_moded_noise:
            raise ScpiError(ErrorCode.SETTINGS_CONFLICT)


def highest_frequency_hz(shape: str) -> float:
    """Return the highest frequency at which a waveform shape can be played [Hz]."""
    return _HIGHEST_FREQUENCY_HZ.get(shape, _HIGHEST_MEMORY_FREQUENCY_HZ)


_DEGREES = 360.0
_PERCENT = 100.0


def shape_of(settings: ChannelSettings, memory: ArbitraryMemory) -> PeriodicShape | None:
    """Return the selected shape; None for noise and DC. An empty user memory is refused."""
    duty = settings.duty_percent / _PERCENT
    computed: dict[str, PeriodicShape | None] = {
        SINE: Sine(),
        SQUARE: Rectangle(),
        PULSE: Rectangle(duty),
        RAMP: Triangle(),
        DC: None,
        NOISE: None,
    }
    if settings.shape in computed:
        return computed[settings.shape]
    return Table(memory.codes(settings.shape), memory.top_code)


class ChannelOutput(Timeline):
    """Output that plays the settings; a change takes effect at the rig time of its command."""

    def __init__(self, terminal: Terminal, memory: ArbitraryMemory, power_on: ChannelSettings) -> None:
        self.relay_is_stuck = False
        self._memory = memory
        carrier = SteadyPhase(round(power_on.frequency_hz * UHZ_PER_HZ), 0.0)
        super().__init__(terminal, Signal(course=carrier, amplitude_vpp=power_on.amplitude_vpp))

    def follow(self, previous: ChannelSettings, settings: ChannelSettings, now_s: float) -> None:
        """Apply new settings at a rig time.

        The phase is continuous unless the start phase has changed. If noise is selected, the output keeps its
        previous shape. The built-in DC shape stays at zero for any offset (AFG1062, drivers).
        """
        at_s, own_s = self.effective(now_s)
        latest, is_flat = self.latest, settings.shape == DC
        waits = settings.mode is RunMode.BURST
        waiting = Burst(math.inf, math.inf, settings.phase_deg / _DEGREES) if waits else None
        signal = Signal(
            relay=Relay.CLOSED if self.relay_is_stuck else settings.relay,
            course=self._course_after(previous, settings, own_s),
            shape=shape_of(settings, self._memory) or latest.shape,
            amplitude_vpp=0.0 if is_flat else settings.amplitude_vpp,
            offset_v=0.0 if is_flat else settings.offset_v,
            burst=latest.burst if settings.mode is previous.mode else waiting,
        )
        self.change(signal, at_s)

    def trigger(self, settings: ChannelSettings, now_s: float) -> None:
        """Start a burst or sweep that waits for a trigger; do nothing if nothing waits or if a burst runs.

        A gated burst never starts, because nothing is connected to the gate input.
        """
        at_s, own_s = self.effective(now_s)
        latest = self.latest
        if settings.mode is RunMode.SWEEP:
            course = self._sweep(settings, latest.course.phase(own_s), own_s, own_s)
            self.change(replace(latest, course=course), at_s)
            return
        is_waiting = latest.burst is not None and not latest.burst.begin_s <= own_s < latest.burst.end_s
        if settings.mode is RunMode.BURST and settings.burst_mode is BurstMode.TRIGGERED and is_waiting:
            start_phase = settings.phase_deg / _DEGREES
            burst = Burst(own_s, own_s + settings.burst_cycles / settings.frequency_hz, start_phase)
            course = self._course(settings, start_phase % 1.0, own_s)
            self.change(replace(latest, course=course, burst=burst), at_s)

    def align(self, settings: ChannelSettings, now_s: float) -> None:
        """Set the phase of the signal to the start phase at once."""
        at_s, own_s = self.effective(now_s)
        course = self._course(settings, settings.phase_deg / _DEGREES % 1.0, own_s)
        self.change(replace(self.latest, course=course), at_s)

    def _course_after(
        self, previous: ChannelSettings, settings: ChannelSettings, own_s: float
    ) -> PhaseCourse:
        """Return the phase as a function of time; the same object as before if unchanged."""
        running = self.latest.course
        if _course_key(previous) == _course_key(settings):
            return running
        turn = (settings.phase_deg - previous.phase_deg) / _DEGREES
        return self._course(settings, (running.phase(own_s) + turn) % 1.0, own_s)

    def _course(self, settings: ChannelSettings, phase: float, own_s: float) -> PhaseCourse:
        """Return the run mode's phase as a function of time, with ``phase`` [cycles] at ``own_s``."""
        if settings.mode is RunMode.SWEEP:
            return self._sweep(settings, phase, own_s, math.inf)
        return SteadyPhase.with_phase(round(settings.frequency_hz * UHZ_PER_HZ), phase, own_s)

    def _sweep(self, settings: ChannelSettings, phase: float, own_s: float, begin_s: float) -> PhaseCourse:
        return SweptPhase(
            settings.sweep_start_hz, settings.sweep_stop_hz, settings.sweep_s, settings.sweep_hold_s,
            settings.sweep_spacing, begin_s, own_s, phase,
        )  # fmt: skip


_course_key = attrgetter(
    "mode", "frequency_hz", "phase_deg",
    "sweep_start_hz", "sweep_stop_hz", "sweep_s", "sweep_hold_s", "sweep_spacing",
)  # fmt: skip
"""Settings that determine the phase as a function of time."""
