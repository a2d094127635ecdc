"""From settings to the signal at the terminal: which phase goes on, and which starts anew."""

import math
from dataclasses import dataclass

from . import _built_in_shape as built_in_shape
from ._afg1022_settings import (
    DC,
    NOISE,
    PULSE,
    RAMP,
    SINE,
    SQUARE,
    BurstMode,
    ChannelSettings,
    ModulationSettings,
    OwnSweep,
    RunMode,
    Source,
    SweepTrigger,
)
from ._arbitrary_memory import ArbitraryMemory
from ._periodic_shape import Flat, PeriodicShape, Rectangle, Sine, Table, Triangle
from ._phase_course import (
    UHZ_PER_HZ,
    FrequencyModulatedPhase,
    Modulator,
    PhaseCourse,
    PhaseModulatedPhase,
    Spacing,
    SteadyPhase,
    SweptPhase,
    TriggeredSweepPhase,
)
from ._terminal_voltage import AmplitudeModulation, Burst, Constant, Envelope, PulseWidthModulation

DEGREES = 360.0
PERCENT = 100.0


@dataclass(frozen=True)
class Panel:
    """What only the front panel can set."""

    declared_load_ohm: float = 50.0
    """The load the panel shows at power-on; ``math.inf`` for high impedance."""
    sweep_s: float = 1.0
    sweep_spacing: Spacing = Spacing.LINEAR


def shape(name: str, memory: ArbitraryMemory, duty_percent: float) -> PeriodicShape | None:
    """Return the shape that a name means; None for noise. An empty user memory is refused."""
    computed: dict[str, PeriodicShape | None] = {
        SINE: Sine(),
        SQUARE: Rectangle(),
        PULSE: Rectangle(duty_percent / PERCENT),
        RAMP: Triangle(),
        DC: Flat(),
        NOISE: None,
    }
    if name in computed:
        return computed[name]
    if name in built_in_shape.FORMULAS:
        return Table(built_in_shape.codes(name))
    return Table(memory.codes(name), memory.top_code)


def modulator(settings: ModulationSettings, memory: ArbitraryMemory) -> Modulator:
    """Return the modulating signal; an open external input, and noise, count as silence."""
    playing = shape(settings.shape, memory, PERCENT / 2)
    if playing is None or settings.source is Source.EXTERNAL:
        playing = Flat()
    return Modulator(playing, SteadyPhase(round(settings.frequency_hz * UHZ_PER_HZ), 0.0))


def keying(settings: ModulationSettings) -> Modulator:
    """Return the square that keys between two states."""
    playing: PeriodicShape = Flat() if settings.source is Source.EXTERNAL else Rectangle()
    return Modulator(playing, SteadyPhase(round(settings.frequency_hz * UHZ_PER_HZ), 0.0))


def course(
    settings: ChannelSettings, memory: ArbitraryMemory, panel: Panel, phase: float, own_time_s: float
) -> PhaseCourse:
    """Return the course that the mode asks for, passing through a phase [cycles] at a time."""
    frequency_uhz = round(settings.frequency_hz * UHZ_PER_HZ)
    if settings.mode is RunMode.SWEEP:
        return swept(settings, panel, phase, own_time_s, math.inf)
    steady = SteadyPhase.through(frequency_uhz, phase, own_time_s)
    if settings.mode is RunMode.PM:
        chosen = settings.modulation[RunMode.PM]
        return PhaseModulatedPhase(steady, chosen.amount / DEGREES, modulator(chosen, memory))
    if settings.mode is RunMode.PSK:
        chosen = settings.modulation[RunMode.PSK]
        half = chosen.amount / DEGREES / 2  # a square from -half to +half about a carrier moved by half
        moved = SteadyPhase(steady.frequency_uhz, (steady.offset + half) % 1.0)
        return PhaseModulatedPhase(moved, half, keying(chosen))
    if settings.mode is RunMode.FM:
        chosen = settings.modulation[RunMode.FM]
        return _frequency_modulated(
            frequency_uhz, chosen.amount, modulator(chosen, memory), phase, own_time_s
        )
    if settings.mode is RunMode.FSK:
        chosen = settings.modulation[RunMode.FSK]
        hop_uhz = round(chosen.amount * UHZ_PER_HZ)
        half_hz = (hop_uhz - frequency_uhz) / UHZ_PER_HZ / 2
        middle_uhz = (hop_uhz + frequency_uhz) // 2
        return _frequency_modulated(middle_uhz, half_hz, keying(chosen), phase, own_time_s)
    return steady


def swept(
    settings: ChannelSettings, panel: Panel, phase: float, own_time_s: float, begin_s: float
) -> PhaseCourse:
    """Return a sweep: one at a trigger, or one after the other."""
    ends = settings.sweep_start_hz, settings.sweep_stop_hz
    sweep = settings.sweep or OwnSweep(panel.sweep_s, spacing=panel.sweep_spacing)
    if sweep.trigger is SweepTrigger.IMMEDIATE:
        return SweptPhase(*ends, sweep.sweep_s, sweep.spacing, own_time_s, phase)
    return TriggeredSweepPhase(*ends, sweep.sweep_s, sweep.hold_s, sweep.spacing, begin_s, own_time_s, phase)


def _frequency_modulated(
    carrier_uhz: int, deviation_hz: float, modulating: Modulator, phase: float, own_time_s: float
) -> FrequencyModulatedPhase:
    """Return frequency modulation whose phase passes through a given one."""
    trial = FrequencyModulatedPhase(SteadyPhase(carrier_uhz, 0.0), deviation_hz, modulating)
    carrier = SteadyPhase(carrier_uhz, (phase - trial.phase(own_time_s)) % 1.0)
    return FrequencyModulatedPhase(carrier, deviation_hz, modulating)


def envelope(settings: ChannelSettings, memory: ArbitraryMemory) -> Envelope:
    """Return how the mode changes the amplitude; AM of 100 % swings between zero and the full one."""
    if settings.mode is RunMode.AM:
        chosen = settings.modulation[RunMode.AM]
        depth = chosen.amount / PERCENT
        return AmplitudeModulation((1 - depth) / 2, (1 + depth) / 2, modulator(chosen, memory))
    if settings.mode is RunMode.ASK:
        chosen = settings.modulation[RunMode.ASK]
        return AmplitudeModulation(1.0, chosen.amount / settings.amplitude_vpp, keying(chosen))
    return Constant()


def pulse_width(settings: ChannelSettings, memory: ArbitraryMemory) -> PulseWidthModulation | None:
    """Return the modulation of the pulse's duty, if that is the mode."""
    if settings.mode is not RunMode.PWM:
        return None
    chosen = settings.modulation[RunMode.PWM]
    return PulseWidthModulation(
        settings.duty_percent / PERCENT, chosen.amount / PERCENT, modulator(chosen, memory)
    )


def waiting_burst(settings: ChannelSettings) -> Burst | None:
    """Return the burst that waits for its trigger, if that is the mode."""
    if settings.mode is not RunMode.BURST:
        return None
    return Burst(math.inf, math.inf, settings.phase_deg / DEGREES)


def triggered_burst(settings: ChannelSettings, own_time_s: float) -> Burst | None:
    """Return the burst that a trigger starts now; a gated burst needs the gate input, which is open."""
    if settings.mode is not RunMode.BURST or settings.burst_mode is BurstMode.GATED:
        return None
    end_s = own_time_s + settings.burst_cycles / settings.frequency_hz
    return Burst(own_time_s, end_s, settings.phase_deg / DEGREES)
