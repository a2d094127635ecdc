"""The commands of the seven modulations: state, source, internal frequency and shape, and how much."""

import math
from dataclasses import replace

from ._afg1022_settings import (
    MODULATING_RANGE_HZ,
    MODULATIONS,
    NOISE,
    OPEN_AMPLITUDE_RANGE_VPP,
    RAMP,
    SINE,
    SQUARE,
    ChannelSettings,
    ModulationSettings,
    RunMode,
    Source,
)
from ._arbitrary_memory import memory_name
from ._channel_commands import FREQUENCY_DECIMALS, angle_deg, shape_name, with_mode
from ._scpi_command import Command, Generator, Number, Parameters, choice, none, only, switch
from ._scpi_header import HeaderPattern
from ._scpi_status import ErrorCode, ScpiError
from ._scpi_value import AMPLITUDE_UNITS, FREQUENCY_UNITS, NO_UNITS, PERCENT_UNITS, as_number

_MODULATING_SHAPES = (SINE, SQUARE, RAMP, NOISE)
_KEYED = (RunMode.FSK, RunMode.ASK, RunMode.PSK)
_HALF_TURN_DEG = 180.0
_HIGHEST_DUTY_DEVIATION_PERCENT = 49.9


def _of(settings: ChannelSettings, mode: RunMode) -> ModulationSettings:
    return settings.modulation[mode]


def _with(settings: ChannelSettings, mode: RunMode, chosen: ModulationSettings) -> ChannelSettings:
    return replace(settings, modulation={**settings.modulation, mode: chosen})


def _amount(settings: ChannelSettings, mode: RunMode, amount: float) -> ChannelSettings:
    return _with(settings, mode, replace(_of(settings, mode), amount=amount))


def _switches(mode: RunMode) -> list[Command]:
    """Return state, source and rate, which every modulation has."""
    root = f"[SOURce#:]{mode.value}"
    rate_nodes = ("FREQuency", "RATE") if mode in _KEYED else ("FREQuency",)
    rates = [
        Number(
            f"{root}:INTernal:{node}",
            FREQUENCY_UNITS,
            lambda s: _of(s, mode).frequency_hz,
            lambda s, hz: _with(s, mode, replace(_of(s, mode), frequency_hz=hz)),
            lambda _: MODULATING_RANGE_HZ,
            default=10e3,
            decimals=FREQUENCY_DECIMALS,
        ).command()
        for node in rate_nodes
    ]
    return [
        switch(f"{root}:STATe", lambda s: s.mode is mode, lambda s, on: with_mode(mode, s, on)),
        choice(
            f"{root}:SOURce",
            Source,
            lambda s: _of(s, mode).source,
            lambda s, source: _with(s, mode, replace(_of(s, mode), source=source)),
        ),
        *rates,
    ]


def _shape(mode: RunMode) -> Command:
    """Return the entry of the internal shape: sine, square, ramp, noise or a waveform memory."""

    def write(generator: Generator, channel: int, parameters: Parameters) -> None:
        name = shape_name(only(parameters))
        if name not in _MODULATING_SHAPES:
            if memory_name(name) is None:
                raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
            generator.memory.codes(name)
        settings = generator.settings(channel)
        generator.configure(channel, _with(settings, mode, replace(_of(settings, mode), shape=name)))

    def ask(generator: Generator, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        name = _of(generator.settings(channel), mode).shape
        return b"PRN" if name == NOISE else name.encode("ascii")

    return Command(HeaderPattern(f"[SOURce#:]{mode.value}:INTernal:FUNCtion[:SHAPe]"), write, ask)


def _angle(mode: RunMode) -> Command:
    """Return the entry of a deviation of phase: degrees inside, radians in replies, as ``PHAS:ADJ``."""
    degrees = Number(
        f"[SOURce#:]{mode.value}[:DEViation]",
        NO_UNITS,
        lambda s: _of(s, mode).amount,
        lambda s, deg: _amount(s, mode, deg),
        lambda _: (0.0, _HALF_TURN_DEG),
        default=90.0,
        decimals=1,
        read=angle_deg,
    ).command()

    def ask(generator: Generator, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        radians = math.radians(_of(generator.settings(channel), mode).amount)
        return as_number(radians)

    return Command(degrees.pattern, degrees.write, ask)


_AMOUNTS = (
    Number(
        "[SOURce#:]AM[:DEPTh]",
        PERCENT_UNITS,
        lambda s: _of(s, RunMode.AM).amount,
        lambda s, percent: _amount(s, RunMode.AM, percent),
        lambda _: (0.0, 100.0),
        default=50.0,
        decimals=1,
    ).command(),
    Number(
        "[SOURce#:]FM[:DEViation]",
        FREQUENCY_UNITS,
        lambda s: _of(s, RunMode.FM).amount,
        lambda s, hz: _amount(s, RunMode.FM, hz),
        lambda s: (0.0, min(s.frequency_hz, s.frequency_range_hz[1] - s.frequency_hz)),
        default=100e3,
        decimals=FREQUENCY_DECIMALS,
    ).command(),
    Number(
        "[SOURce#:]FSK[:FREQuency]",
        FREQUENCY_UNITS,
        lambda s: _of(s, RunMode.FSK).amount,
        lambda s, hz: _amount(s, RunMode.FSK, hz),
        lambda s: s.frequency_range_hz,
        default=100e3,
        decimals=FREQUENCY_DECIMALS,
    ).command(),
    Number(
        "[SOURce#:]PWM[:DEViation][:DCYCle]",
        PERCENT_UNITS,
        lambda s: _of(s, RunMode.PWM).amount,
        lambda s, percent: _amount(s, RunMode.PWM, percent),
        lambda _: (0.0, _HIGHEST_DUTY_DEVIATION_PERCENT),
        default=5.0,
        decimals=1,
    ).command(),
    Number(
        "[SOURce#:]ASK[:AMPLitude]",
        AMPLITUDE_UNITS,
        lambda s: _of(s, RunMode.ASK).amount * s.declared_share,
        lambda s, vpp: _amount(s, RunMode.ASK, vpp / s.declared_share),
        lambda s: (0.0, OPEN_AMPLITUDE_RANGE_VPP[1] * s.declared_share),
        default=0.5,
        decimals=4,
    ).command(),
    _angle(RunMode.PM),
    _angle(RunMode.PSK),
)

MODULATION_COMMANDS = (
    *(command for mode in MODULATIONS for command in _switches(mode)),
    *(_shape(mode) for mode in MODULATIONS if mode not in _KEYED),
    *_AMOUNTS,
)
