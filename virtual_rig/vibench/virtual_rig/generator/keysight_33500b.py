"""A simulated Keysight 33500B: the output stage of the AFG1022, with another table of commands.

Source: Keysight Trueform Series Operating and Service Guide, as used by public drivers (pymeasure's
``agilent33500``, MATLAB and Python programs of laboratories); not compared with an instrument.
"""

from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from .afg1022 import AFG1022, SHARED_COMMANDS, burst_cycles, load_command, modulation_switch, with_mode
from .channel_output import SINE, BurstMode, ChannelSettings, OwnSweep, RunMode, SweepTrigger
from .phase_course import Spacing
from .scpi_instrument import Command, Parameters, Quirks, choice, none, only, switch
from .scpi_message import (
    EDIT_MEMORY,
    NO_UNITS,
    ArbitraryMemory,
    Codes,
    ErrorCode,
    ScpiError,
    as_number,
    block,
    integer,
    number,
    text,
)

TOP_CODE = 65_534
"""Codes -32767 to 32767, with an offset to start at zero."""
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
    out_of_range_becomes_default=False,
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
    """The generator; see `AFG1022`. Its waveforms have names, its sweeps a time, a hold and a trigger."""

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

    def _table(self, quirks: Quirks) -> tuple[Command, ...]:
        del quirks
        return (*_COMMANDS, *SHARED_COMMANDS)


def _sweep(settings: ChannelSettings) -> OwnSweep:
    return settings.sweep or OwnSweep()


def _name(parameter: bytes) -> str:
    return text(parameter).strip('"').upper()


def _write_dac(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    """Store a waveform from a binary block of 16-bit numbers, or from a list."""
    del channel
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


def _select(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    name = _name(only(parameters))
    if name not in own.waveforms:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    rate_hz = _rate_hz(own, channel)
    own.selected = name
    own.memory.hold(own.waveforms[name])
    own.memory_changed()
    if own.settings(channel).shape == EDIT_MEMORY:
        _set_rate(own, channel, rate_hz)


def _clear(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    none(parameters)
    if own.settings(channel).shape == EDIT_MEMORY:
        own.configure(channel, replace(own.settings(channel), shape=SINE))
    own.waveforms.clear()
    own.selected = ""


def _points(own: Keysight33500B, _: int, parameters: Parameters) -> bytes:
    name = _name(only(parameters))
    if name not in own.waveforms:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return as_number(len(own.waveforms[name]))


def _average(own: Keysight33500B, _: int, parameters: Parameters) -> bytes:
    name = _name(only(parameters))
    if name not in own.waveforms:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return as_number(float(np.mean(own.waveforms[name])) / _MIDDLE - 1)


def _rate_hz(own: Keysight33500B, channel: int) -> float:
    return own.settings(channel).frequency_hz * len(own.memory.codes(EDIT_MEMORY))


def _set_rate(own: Keysight33500B, channel: int, rate_hz: float) -> None:
    points = len(own.memory.codes(EDIT_MEMORY))
    own.configure(channel, replace(own.settings(channel), frequency_hz=rate_hz / points))


def _write_rate(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    rate_hz = number(only(parameters), NO_UNITS)
    if not 0 < rate_hz <= HIGHEST_RATE_HZ:
        raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
    _set_rate(own, channel, rate_hz)


def _write_order(own: Keysight33500B, _: int, parameters: Parameters) -> None:
    word = _name(only(parameters))
    own.order = _Order.SWAPPED if word.startswith("SWAP") else _Order.NORMAL


def _write_filter(own: Keysight33500B, _: int, parameters: Parameters) -> None:
    word = _name(only(parameters))
    if word not in ("OFF", "STEP", "NORM", "NORMAL"):
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    own.filter = _Filter[{"NORM": "NORMAL"}.get(word, word)]


def _set_sweep(own: Keysight33500B, channel: int, field: str, value: object) -> None:
    settings = own.settings(channel)
    own.configure(channel, replace(settings, sweep=replace(_sweep(settings), **{field: value})))  # type: ignore[arg-type]


def _sweep_seconds(node: str, field: str, range_s: tuple[float, float]) -> Command:
    """Return the command of a sweep time [s]."""

    def write(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
        seconds = number(only(parameters), _SECONDS)
        if not range_s[0] <= seconds <= range_s[1]:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        _set_sweep(own, channel, field, round(seconds, 6))

    def ask(own: Keysight33500B, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        return as_number(getattr(_sweep(own.settings(channel)), field))

    return Command(f"[SOURce#:]SWEep:{node}", _GUIDE, write, ask)


_GUIDE = "Operating and Service Guide"
_SECONDS = {"": 1.0, "S": 1.0, "MS": 1e-3}
# fmt: off
_COMMANDS = (
    load_command("OUTPut#:LOAD"),
    choice("[SOURce#:]FUNCtion", _GUIDE, _Shape,
        lambda s: _Shape.ARBITRARY if s.shape == EDIT_MEMORY else _Shape.SINE,
        lambda s, word: replace(s, shape=SINE if word is _Shape.SINE else EDIT_MEMORY)),
    Command("[SOURce#:]FUNCtion:ARBitrary", _GUIDE, _select, lambda own, *_: own.selected.encode()),
    Command("[SOURce#:]FUNCtion:ARBitrary:SRATe", _GUIDE, _write_rate,
        lambda own, channel, _: as_number(_rate_hz(own, channel))),
    Command("[SOURce#:]FUNCtion:ARBitrary:FILTer", _GUIDE, _write_filter,
        lambda own, *_: own.filter.name[:4].encode()),
    Command("[SOURce#:]DATA:ARBitrary:DAC", _GUIDE, _write_dac, None),
    Command("[SOURce#:]DATA:VOLatile:CLEar", _GUIDE, _clear, None),
    Command("[SOURce#:]DATA:ATTRibute:POINts", _GUIDE, None, _points),
    Command("[SOURce#:]DATA:ATTRibute:AVERage", _GUIDE, None, _average),
    Command("FORMat:BORDer", _GUIDE, _write_order, lambda own, *_: own.order.name[:4].encode()),
    choice("[SOURce#:]VOLTage:UNIT", _GUIDE, _Unit, lambda _: _Unit.VPP, lambda s, _: s),
    switch("[SOURce#:]SWEep:STATe", _GUIDE,
        lambda s: s.mode is RunMode.SWEEP, lambda s, on: with_mode(RunMode.SWEEP, s, on)),
    _sweep_seconds("TIME", "sweep_s", SWEEP_S),
    _sweep_seconds("HTIMe", "hold_s", HOLD_S),
    choice("[SOURce#:]SWEep:SPACing", _GUIDE, _Spacing,
        lambda s: _Spacing[_sweep(s).spacing.name],
        lambda s, word: replace(s, sweep=replace(_sweep(s), spacing=Spacing[word.name]))),
    choice("TRIGger#:SOURce", _GUIDE, SweepTrigger,
        lambda s: _sweep(s).trigger, lambda s, word: replace(s, sweep=replace(_sweep(s), trigger=word))),
    switch("[SOURce#:]BURSt:STATe", _GUIDE,
        lambda s: s.mode is RunMode.BURST, lambda s, on: with_mode(RunMode.BURST, s, on)),
    burst_cycles(MOST_BURST_CYCLES, channels=2),
    choice("[SOURce#:]BURSt:MODE", _GUIDE, BurstMode,
        lambda s: s.burst_mode, lambda s, mode: replace(s, burst_mode=mode)),
    *map(modulation_switch, (RunMode.AM, RunMode.FM, RunMode.PM, RunMode.FSK, RunMode.PWM)),
)
# fmt: on
