"""A simulated Keysight 33500B: the same output stage as the AFG1022's, behind another table of commands.

Source: Keysight Trueform Series Operating and Service Guide, as public drivers use it (pymeasure's
``agilent33500``, MATLAB and Python programs of laboratories); nothing was compared with an instrument.
"""

from collections.abc import Callable
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from . import _channel_commands as channel_commands
from ._afg1022 import AFG1022
from ._afg1022_settings import (
    SINE,
    BurstMode,
    ChannelSettings,
    OwnSweep,
    RunMode,
    SweepTrigger,
)
from ._arbitrary_memory import EDIT_MEMORY, ArbitraryMemory, Codes
from ._channel_commands import COMMON_CHANNEL_COMMANDS, LOAD, with_mode
from ._common_commands import COMMON_COMMANDS
from ._phase_course import Spacing
from ._scpi_command import Command, Generator, Number, Parameters, Quirks, choice, none, only, switch
from ._scpi_header import HeaderPattern
from ._scpi_status import ErrorCode, ScpiError
from ._scpi_value import NO_UNITS, Limit, as_number, block, integer, number_or_limit, text

TOP_CODE = 65_534
"""Codes -32767 to 32767, counted from zero."""
_MIDDLE = 32_767
POINTS = (8, 1_048_576)
HIGHEST_RATE_HZ = 250e6
MOST_BURST_CYCLES = 100_000_000
SWEEP_S = 1e-3, 250_000.0
HOLD_S = 0.0, 3600.0
DEFAULT_SERIAL = "MY52000001"
_QUIRKS = Quirks(
    first_identity_after_clear_is_empty=False,
    high_impedance_has_ohm_sign=False,
    unknown_is_syntax_error=False,
    noise_is_not_played=False,
    out_of_range_becomes_default=False,
    dc_ignores_offset=False,
    duty_queues_error=False,
)


class _Shape(Enum):
    SINE = "SINusoid"
    ARBITRARY = "ARB"


class _Spacing(Enum):
    LINEAR = "LINear"
    LOGARITHMIC = "LOGarithmic"


class _Unit(Enum):
    VPP = "VPP"


class _Order(Enum):
    NORMAL = "NORMal"
    SWAPPED = "SWAPped"


class _Filter(Enum):
    OFF = "OFF"
    STEP = "STEP"
    NORMAL = "NORMal"


class Keysight33500B(AFG1022):
    """The generator: see `AFG1022`; its waveforms have names, and its sweeps a time, a hold and a trigger."""

    maker, model, firmware = "Agilent Technologies", "33522B", "4.00-1.19-2.00-52-00"

    def __init__(self, *arguments: object, **options: object) -> None:
        super().__init__(*arguments, **{"serial": DEFAULT_SERIAL, **options, "quirks": _QUIRKS})  # type: ignore[arg-type]
        self.order = _Order.NORMAL
        self.filter = _Filter.NORMAL
        self.waveforms: dict[str, Codes] = {}
        self.selected = ""

    def _new_memory(self) -> ArbitraryMemory:
        return ArbitraryMemory(POINTS[1], TOP_CODE)

    def _power_on(self, declared_load_ohm: float) -> ChannelSettings:
        return ChannelSettings(
            declared_load_ohm=declared_load_ohm, frequency_hz=1e3, amplitude_vpp=0.2, sweep=OwnSweep()
        )

    def _table(self) -> tuple[Command, ...]:
        return (*_COMMANDS, *COMMON_CHANNEL_COMMANDS, *COMMON_COMMANDS)


def _own(generator: Generator) -> Keysight33500B:
    assert isinstance(generator, Keysight33500B)
    return generator


def _sweep(settings: ChannelSettings) -> OwnSweep:
    return settings.sweep or OwnSweep()


def _name(parameter: bytes) -> str:
    return text(parameter).strip('"').upper()


def _write_dac(generator: Generator, channel: int, parameters: Parameters) -> None:
    """Take a waveform as a binary block of 16-bit numbers, or as a list of them."""
    del channel
    own = _own(generator)
    if len(parameters) < 2:
        raise ScpiError(ErrorCode.MISSING_PARAMETER)
    name = _name(parameters[0])
    if name in own.waveforms:
        raise ScpiError(ErrorCode.SETTINGS_CONFLICT)  # 786, "Specified arb waveform already exists"
    values = _numbers(own, parameters[1:])
    if not POINTS[0] <= values.size <= POINTS[1] or np.any(np.abs(values) > _MIDDLE):
        raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
    if sum(map(len, own.waveforms.values())) + values.size > POINTS[1]:
        raise ScpiError(ErrorCode.OUT_OF_MEMORY)
    own.waveforms[name] = (values + _MIDDLE).astype(np.uint16)


def _numbers(own: Keysight33500B, parameters: Parameters) -> NDArray[np.float64]:
    if parameters[0].startswith(b"#"):
        order = ">i2" if own.order is _Order.NORMAL else "<i2"
        data = block(parameters[0])
        if len(data) % 2:
            raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
        return np.frombuffer(data, dtype=order).astype(np.float64)
    return np.array([float(integer(each)) for each in parameters])


def _select(generator: Generator, channel: int, parameters: Parameters) -> None:
    own, name = _own(generator), _name(only(parameters))
    if name not in own.waveforms:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    rate_hz = _rate_hz(own, channel)
    own.selected = name
    own.memory.hold(own.waveforms[name])
    own.memory_changed()
    if own.settings(channel).shape == EDIT_MEMORY:
        _set_rate(own, channel, rate_hz)


def _clear(generator: Generator, channel: int, parameters: Parameters) -> None:
    none(parameters)
    own = _own(generator)
    if own.settings(channel).shape == EDIT_MEMORY:
        own.configure(channel, replace(own.settings(channel), shape=SINE))
    own.waveforms.clear()
    own.selected = ""


def _points(generator: Generator, _: int, parameters: Parameters) -> bytes:
    own, name = _own(generator), _name(only(parameters))
    if name not in own.waveforms:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return as_number(len(own.waveforms[name]))


def _average(generator: Generator, _: int, parameters: Parameters) -> bytes:
    own, name = _own(generator), _name(only(parameters))
    if name not in own.waveforms:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return as_number(float(np.mean(own.waveforms[name])) / _MIDDLE - 1)


def _rate_hz(own: Keysight33500B, channel: int) -> float:
    return own.settings(channel).frequency_hz * len(own.memory.codes(EDIT_MEMORY))


def _set_rate(own: Keysight33500B, channel: int, rate_hz: float) -> None:
    points = len(own.memory.codes(EDIT_MEMORY))
    own.configure(channel, replace(own.settings(channel), frequency_hz=rate_hz / points))


def _write_rate(generator: Generator, channel: int, parameters: Parameters) -> None:
    rate_hz = number_or_limit(only(parameters), NO_UNITS)
    if isinstance(rate_hz, Limit) or not 0 < rate_hz <= HIGHEST_RATE_HZ:
        raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
    _set_rate(_own(generator), channel, rate_hz)


def _set_shape(settings: ChannelSettings, word: _Shape) -> ChannelSettings:
    return replace(settings, shape=SINE if word is _Shape.SINE else EDIT_MEMORY)


def _write_order(generator: Generator, _: int, parameters: Parameters) -> None:
    word = _name(only(parameters))
    _own(generator).order = _Order.SWAPPED if word.startswith("SWAP") else _Order.NORMAL


def _write_filter(generator: Generator, _: int, parameters: Parameters) -> None:
    word = _name(only(parameters))
    if word not in ("OFF", "STEP", "NORM", "NORMAL"):
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    _own(generator).filter = _Filter[{"NORM": "NORMAL"}.get(word, word)]


def _sweep_number(
    node: str,
    get: Callable[[OwnSweep], float],
    put: Callable[[OwnSweep, float], OwnSweep],
    range_s: tuple[float, float],
) -> Command:
    return Number(
        f"[SOURce#:]SWEep:{node}",
        {"": 1.0, "S": 1.0, "MS": 1e-3},
        lambda s: get(_sweep(s)),
        lambda s, value: replace(s, sweep=put(_sweep(s), value)),
        lambda _: range_s,
        default=1.0,
        decimals=6,
    ).command()


def _modulation(mode: RunMode) -> Command:
    return switch(
        f"[SOURce#:]{mode.value}:STATe",
        lambda s: s.mode is mode,
        lambda s, on: with_mode(mode, s, on),
    )


_COMMANDS = (
    replace(LOAD, pattern="OUTPut#:LOAD").command(),
    choice(
        "[SOURce#:]FUNCtion",
        _Shape,
        lambda s: _Shape.ARBITRARY if s.shape == EDIT_MEMORY else _Shape.SINE,
        _set_shape,
    ),
    Command(HeaderPattern("[SOURce#:]FUNCtion:ARBitrary"), _select, lambda g, *_: _own(g).selected.encode()),
    Command(
        HeaderPattern("[SOURce#:]FUNCtion:ARBitrary:SRATe"),
        _write_rate,
        lambda g, channel, _: as_number(_rate_hz(_own(g), channel)),
    ),
    Command(
        HeaderPattern("[SOURce#:]FUNCtion:ARBitrary:FILTer"),
        _write_filter,
        lambda g, *_: _own(g).filter.name[:4].encode(),
    ),
    Command(HeaderPattern("[SOURce#:]DATA:ARBitrary:DAC"), _write_dac, None),
    Command(HeaderPattern("[SOURce#:]DATA:VOLatile:CLEar"), _clear, None),
    Command(HeaderPattern("[SOURce#:]DATA:ATTRibute:POINts"), None, _points),
    Command(HeaderPattern("[SOURce#:]DATA:ATTRibute:AVERage"), None, _average),
    Command(HeaderPattern("FORMat:BORDer"), _write_order, lambda g, *_: _own(g).order.name[:4].encode()),
    choice("[SOURce#:]VOLTage:UNIT", _Unit, lambda _: _Unit.VPP, lambda s, _: s),
    switch(
        "[SOURce#:]SWEep:STATe",
        lambda s: s.mode is RunMode.SWEEP,
        lambda s, on: with_mode(RunMode.SWEEP, s, on),
    ),
    _sweep_number("TIME", lambda s: s.sweep_s, lambda s, value: replace(s, sweep_s=value), SWEEP_S),
    _sweep_number("HTIMe", lambda s: s.hold_s, lambda s, value: replace(s, hold_s=value), HOLD_S),
    choice(
        "[SOURce#:]SWEep:SPACing",
        _Spacing,
        lambda s: _Spacing[_sweep(s).spacing.name],
        lambda s, word: replace(s, sweep=replace(_sweep(s), spacing=Spacing[word.name])),
    ),
    choice(
        "TRIGger#:SOURce",
        SweepTrigger,
        lambda s: _sweep(s).trigger,
        lambda s, word: replace(s, sweep=replace(_sweep(s), trigger=word)),
    ),
    switch(
        "[SOURce#:]BURSt:STATe",
        lambda s: s.mode is RunMode.BURST,
        lambda s, on: with_mode(RunMode.BURST, s, on),
    ),
    replace(channel_commands.BURST_CYCLES, limits=lambda _: (1, MOST_BURST_CYCLES), channels=2).command(),
    choice(
        "[SOURce#:]BURSt:MODE",
        BurstMode,
        lambda s: s.burst_mode,
        lambda s, mode: replace(s, burst_mode=mode),
    ),
    *map(_modulation, (RunMode.AM, RunMode.FM, RunMode.PM, RunMode.FSK, RunMode.PWM)),
)
