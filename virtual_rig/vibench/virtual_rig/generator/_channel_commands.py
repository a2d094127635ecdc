"""The commands of one channel: output, shape, frequency, voltages, phase, sweep, burst.

Source: IVI driver tkafg1k and public drivers, as collected in the hardware reference, section 1.2.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

from ._afg1022_settings import (
    DECLARED_LOAD_RANGE_OHM,
    MOST_BURST_CYCLES,
    NOISE,
    OPEN_AMPLITUDE_RANGE_VPP,
    OPEN_PEAK_V,
    BurstMode,
    ChannelSettings,
    RunMode,
    highest_frequency_hz,
    standard_or_built_in,
)
from ._arbitrary_memory import memory_name
from ._scpi_command import Command, Generator, Number, Parameters, choice, none, only, switch
from ._scpi_header import HeaderPattern
from ._scpi_status import ErrorCode, ScpiError
from ._scpi_value import (
    AMPLITUDE_UNITS,
    FREQUENCY_UNITS,
    NO_UNITS,
    PERCENT_UNITS,
    RESISTANCE_UNITS,
    VOLTAGE_UNITS,
    Limit,
    as_number,
    number_and_unit,
    number_or_limit,
    text,
)
from ._terminal_voltage import Relay

FREQUENCY_DECIMALS = 6
VOLTAGE_DECIMALS = 4
GBK_OHM_SIGN = b"\xa6\xb8"
DUTY_RANGE_PERCENT = (0.1, 99.9)
"""Assumed; the pulse's width is not a remote command."""


class FrequencyMode(Enum):
    """What ``FREQ:MODE`` takes."""

    FIXED = "CW"
    SWEEP = "SWEep"


def angle_deg(parameter: bytes, _: Mapping[str, float]) -> float | Limit:
    """Read ``31DEG``; a bare number is in radians (measured on an AFG1062)."""
    if parameter[:1].isalpha():
        return number_or_limit(parameter, NO_UNITS)
    value, unit = number_and_unit(parameter)
    if unit == "DEG":
        return value
    if unit in ("", "RAD"):
        return math.degrees(value)
    raise ScpiError(ErrorCode.INVALID_SUFFIX)


def shape_name(parameter: bytes) -> str:
    """Return the canonical name of the shape that a parameter means, or refuse it with -224."""
    word = text(parameter)
    name = standard_or_built_in(word) or memory_name(word)
    if name is None:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return name


def _write_shape(generator: Generator, channel: int, parameters: Parameters) -> None:
    settings = generator.settings(channel)
    name = shape_name(only(parameters))
    frequency_hz = min(settings.frequency_hz, highest_frequency_hz(name))
    generator.configure(channel, replace(settings, shape=name, frequency_hz=frequency_hz))


def _ask_shape(generator: Generator, channel: int, parameters: Parameters) -> bytes:
    none(parameters)
    name = generator.settings(channel).shape
    return b"PRN" if name == NOISE else name.encode("ascii")


def _write_phase(generator: Generator, channel: int, parameters: Parameters) -> None:
    angle = angle_deg(only(parameters), NO_UNITS)
    full_turn = 360.0
    if isinstance(angle, Limit):
        angle = full_turn if angle is Limit.MAXIMUM else 0.0
    if not 0 <= angle <= full_turn:
        raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
    # A hair is added so that 31 degrees, sent in radians, are not truncated to 30.
    whole_degrees = math.floor(angle + 1e-9)
    generator.configure(channel, replace(generator.settings(channel), phase_deg=whole_degrees))


def _ask_phase(generator: Generator, channel: int, parameters: Parameters) -> bytes:
    none(parameters)
    return as_number(math.radians(generator.settings(channel).phase_deg))


def _ask_load(generator: Generator, channel: int, parameters: Parameters) -> bytes:
    reply = LOAD.ask(generator, channel, parameters)
    high_impedance = math.isinf(generator.settings(channel).declared_load_ohm) and not parameters
    return reply + GBK_OHM_SIGN if high_impedance and generator.quirks.high_impedance_has_ohm_sign else reply


def _write_duty(generator: Generator, channel: int, parameters: Parameters) -> None:
    DUTY.write(generator, channel, parameters)
    if generator.quirks.duty_queues_error:
        raise ScpiError(ErrorCode.SYNTAX_ERROR)


def with_mode(mode: RunMode, settings: ChannelSettings, wanted: bool) -> ChannelSettings:  # noqa: FBT001
    """Return settings with a mode switched on, or off if it was on (SCPI has one switch for each mode)."""
    if wanted:
        return replace(settings, mode=mode)
    return replace(settings, mode=RunMode.CONTINUOUS) if settings.mode is mode else settings


LOAD = Number(
    "OUTPut#:IMPedance",
    RESISTANCE_UNITS,
    lambda s: s.declared_load_ohm,
    lambda s, ohm: replace(s, declared_load_ohm=ohm),
    lambda _: DECLARED_LOAD_RANGE_OHM,
    default=50.0,
    decimals=0,
    infinity_allowed=lambda _: True,
)
DUTY = Number(
    "[SOURce#:]PULSe:DCYCle",
    PERCENT_UNITS,
    lambda s: s.duty_percent,
    lambda s, percent: replace(s, duty_percent=percent),
    lambda _: DUTY_RANGE_PERCENT,
    default=50.0,
    decimals=1,
)
FREQUENCY = Number(
    "[SOURce#:]FREQuency[:FIXed]",
    FREQUENCY_UNITS,
    lambda s: s.frequency_hz,
    lambda s, hz: replace(s, frequency_hz=hz),
    lambda s: s.frequency_range_hz,
    default=1e6,
    decimals=FREQUENCY_DECIMALS,
)
AMPLITUDE = Number(
    "[SOURce#:]VOLTage[:LEVel][:IMMediate][:AMPLitude]",
    AMPLITUDE_UNITS,
    lambda s: s.amplitude_vpp * s.declared_share,
    lambda s, vpp: replace(s, amplitude_vpp=vpp / s.declared_share),
    lambda s: (
        OPEN_AMPLITUDE_RANGE_VPP[0] * s.declared_share,
        OPEN_AMPLITUDE_RANGE_VPP[1] * s.declared_share,
    ),
    default=1.0,
    decimals=VOLTAGE_DECIMALS,
)
OFFSET = Number(
    "[SOURce#:]VOLTage[:LEVel][:IMMediate]:OFFSet",
    VOLTAGE_UNITS,
    lambda s: s.offset_v * s.declared_share,
    lambda s, volts: replace(s, offset_v=volts / s.declared_share),
    lambda s: (-OPEN_PEAK_V * s.declared_share, OPEN_PEAK_V * s.declared_share),
    default=0.0,
    decimals=VOLTAGE_DECIMALS,
)
BURST_CYCLES = Number(
    "[SOURce#:]BURSt:NCYCles",
    NO_UNITS,
    lambda s: s.burst_cycles,
    lambda s, cycles: replace(s, burst_cycles=cycles),
    lambda _: (1, MOST_BURST_CYCLES),
    default=5,
    decimals=0,
    channels=1,
    infinity_allowed=lambda _: True,
)
SWEEP_START = Number(
    "[SOURce#:]FREQuency:STARt",
    FREQUENCY_UNITS,
    lambda s: s.sweep_start_hz,
    lambda s, hz: replace(s, sweep_start_hz=hz),
    lambda s: s.frequency_range_hz,
    default=100e3,
    decimals=FREQUENCY_DECIMALS,
)
SWEEP_STOP = Number(
    "[SOURce#:]FREQuency:STOP",
    FREQUENCY_UNITS,
    lambda s: s.sweep_stop_hz,
    lambda s, hz: replace(s, sweep_stop_hz=hz),
    lambda s: s.frequency_range_hz,
    default=1e6,
    decimals=FREQUENCY_DECIMALS,
)

SWEEP_COMMANDS = (
    SWEEP_START.command(),
    SWEEP_STOP.command(),
    choice(
        "[SOURce#:]FREQuency:MODE",
        FrequencyMode,
        lambda s: FrequencyMode.SWEEP if s.mode is RunMode.SWEEP else FrequencyMode.FIXED,
        lambda s, word: with_mode(RunMode.SWEEP, s, word is FrequencyMode.SWEEP),
    ),
)
LOAD_COMMANDS = (Command(HeaderPattern(LOAD.pattern), LOAD.write, _ask_load),)
COMMON_CHANNEL_COMMANDS = (
    switch(
        "OUTPut#[:STATe]",
        lambda s: s.relay is Relay.CLOSED,
        lambda s, on: replace(s, relay=Relay.CLOSED if on else Relay.OPEN),
    ),
    FREQUENCY.command(),
    AMPLITUDE.command(),
    OFFSET.command(),
    SWEEP_START.command(),
    SWEEP_STOP.command(),
)
"""What the simulated generators have in common."""
CHANNEL_COMMANDS = (
    *COMMON_CHANNEL_COMMANDS[:4],
    Command(HeaderPattern("[SOURce#:]FUNCtion[:SHAPe]"), _write_shape, _ask_shape),
    Command(HeaderPattern("[SOURce#:]PHASe[:ADJust]"), _write_phase, _ask_phase),
    Command(HeaderPattern(DUTY.pattern), _write_duty, DUTY.ask),
    switch(
        "[SOURce#:]BURSt[:STATe]",
        lambda s: s.mode is RunMode.BURST,
        lambda s, on: with_mode(RunMode.BURST, s, on),
        channels=1,
    ),
    BURST_CYCLES.command(),
    choice(
        "[SOURce#:]BURSt:MODE",
        BurstMode,
        lambda s: s.burst_mode,
        lambda s, mode: replace(s, burst_mode=mode),
        channels=1,
    ),
)
