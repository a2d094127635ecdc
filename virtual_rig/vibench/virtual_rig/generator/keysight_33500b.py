"""A simulated Keysight 33500B: the output stage of the AFG1022, with another table of commands.

Source: Keysight Trueform Series Operating and Service Guide, as used by public drivers (pymeasure's
``agilent33500``, MATLAB and Python programs of laboratories); not compared with an instrument.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import scpi_message as scpi
from .afg1022 import (
    AFG1022,
    SHARED_COMMANDS,
    burst_cycles,
    load_command,
    modulation_switch,
    with_mode,
    without_mode,
)
from .channel_output import SINE, BurstMode, ChannelSettings, RunMode, Trigger
from .phase_course import Spacing
from .scpi_instrument import Command, Parameters, Quirks, choice, none, number, only, switch

TOP_CODE = 65_534
"""Largest code; the codes -32767 to 32767 are shifted to start at zero."""
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


@dataclass(frozen=True)
class _Settings(ChannelSettings):
    frequency_hz: float = 1e3
    amplitude_vpp: float = 0.2
    order: str = "NORMal"
    filter: str = "NORMal"


class Keysight33500B(AFG1022):
    """The generator; see `AFG1022`. Waveforms have names; sweeps have a duration, hold time and trigger."""

    maker, model, firmware = "Agilent Technologies", "33522B", "4.00-1.19-2.00-52-00"

    def __init__(self, *arguments: object, **options: object) -> None:
        super().__init__(*arguments, **{"serial": DEFAULT_SERIAL, **options, "quirks": _QUIRKS})  # type: ignore[arg-type]
        self.waveforms: dict[str, scpi.Codes] = {}
        self.selected = ""

    def _new_memory(self) -> scpi.ArbitraryMemory:
        return scpi.ArbitraryMemory(POINTS[1], TOP_CODE)

    def _power_on(self) -> ChannelSettings:
        return _Settings()

    def _table(self, quirks: Quirks) -> tuple[Command, ...]:
        del quirks
        return (*_COMMANDS, *SHARED_COMMANDS)


def _name(parameter: bytes) -> str:
    return scpi.text(parameter).strip('"').upper()


def _write_dac(own: Keysight33500B, _: int, parameters: Parameters) -> None:
    """Store a waveform from a binary block of 16-bit numbers, or from a list."""
    if len(parameters) < 2:
        raise scpi.ScpiError(scpi.ErrorCode.MISSING_PARAMETER)
    name = _name(parameters[0])
    if name in own.waveforms:
        raise scpi.ScpiError(scpi.ErrorCode.SETTINGS_CONFLICT)  # 786, "Specified arb waveform already exists"
    values = _numbers(own, parameters[1:])
    if not POINTS[0] <= values.size <= POINTS[1] or np.any(np.abs(values) > _MIDDLE):
        raise scpi.ScpiError(scpi.ErrorCode.DATA_OUT_OF_RANGE)
    if sum(map(len, own.waveforms.values())) + values.size > POINTS[1]:
        raise scpi.ScpiError(scpi.ErrorCode.OUT_OF_MEMORY)
    own.waveforms[name] = (values + _MIDDLE).astype(np.uint16)


def _numbers(own: Keysight33500B, parameters: Parameters) -> NDArray[np.float64]:
    if parameters[0].startswith(b"#"):
        settings: Any = own.settings(1)
        order = ">i2" if settings.order == "NORMal" else "<i2"
        data = scpi.block(parameters[0])
        if len(data) % 2:
            raise scpi.ScpiError(scpi.ErrorCode.INVALID_BLOCK_DATA)
        return np.frombuffer(data, dtype=order).astype(np.float64)
    return np.array([float(scpi.integer(each)) for each in parameters])


def _stored(own: Keysight33500B, parameters: Parameters) -> str:
    """Return the name of a stored waveform."""
    name = _name(only(parameters))
    if name not in own.waveforms:
        raise scpi.ScpiError(scpi.ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return name


def _select(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    name = _stored(own, parameters)
    rate_hz = _rate_hz(own, channel)
    own.selected = name
    own.memory.hold(own.waveforms[name])
    own.memory_changed()
    if own.settings(channel).shape == scpi.EDIT_MEMORY:
        _set_rate(own, channel, rate_hz)


def _clear(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    none(parameters)
    if own.settings(channel).shape == scpi.EDIT_MEMORY:
        own.configure(channel, replace(own.settings(channel), shape=SINE))
    own.waveforms.clear()
    own.selected = ""


def _attribute(node: str, of: Callable[[scpi.Codes], float]) -> Command:
    """Return the query for a number that describes a stored waveform."""

    def ask(own: Keysight33500B, _: int, parameters: Parameters) -> bytes:
        return scpi.as_number(of(own.waveforms[_stored(own, parameters)]))

    return Command(f"[SOURce#:]DATA:ATTRibute:{node}", _GUIDE, None, ask)


def _rate_hz(own: Keysight33500B, channel: int) -> float:
    return own.settings(channel).frequency_hz * len(own.memory.codes(scpi.EDIT_MEMORY))


def _set_rate(own: Keysight33500B, channel: int, rate_hz: float) -> None:
    points = len(own.memory.codes(scpi.EDIT_MEMORY))
    own.configure(channel, replace(own.settings(channel), frequency_hz=rate_hz / points))


def _write_rate(own: Keysight33500B, channel: int, parameters: Parameters) -> None:
    rate_hz = scpi.number(only(parameters), scpi.NO_UNITS)
    if not 0 < rate_hz <= HIGHEST_RATE_HZ:
        raise scpi.ScpiError(scpi.ErrorCode.DATA_OUT_OF_RANGE)
    _set_rate(own, channel, rate_hz)


def _sweeping(settings: ChannelSettings, wanted: bool) -> ChannelSettings:  # noqa: FBT001
    """Return settings with the sweep on or off; sweeps that repeat without a trigger are not simulated."""
    if settings.trigger is Trigger.IMMEDIATE:
        return without_mode(RunMode.SWEEP, settings, wanted)
    return with_mode(RunMode.SWEEP, settings, wanted)


_GUIDE = "Operating and Service Guide"
_SECONDS = {"": 1.0, "S": 1.0, "MS": 1e-3}
# fmt: off
_COMMANDS = (
    load_command("OUTPut#:LOAD"),
    choice("[SOURce#:]FUNCtion", _GUIDE, ("SINusoid", "ARB"),
        lambda s: "ARB" if s.shape == scpi.EDIT_MEMORY else "SINusoid",
        lambda s, word: replace(s, shape=scpi.EDIT_MEMORY if word == "ARB" else SINE)),
    Command("[SOURce#:]FUNCtion:ARBitrary", _GUIDE, _select, lambda own, *_: own.selected.encode()),
    Command("[SOURce#:]FUNCtion:ARBitrary:SRATe", _GUIDE, _write_rate,
        lambda own, channel, _: scpi.as_number(_rate_hz(own, channel))),
    choice("[SOURce#:]FUNCtion:ARBitrary:FILTer", _GUIDE, ("OFF", "STEP", "NORMal"),
        lambda s: s.filter, lambda s, word: replace(s, filter=word)),
    Command("[SOURce#:]DATA:ARBitrary:DAC", _GUIDE, _write_dac, None),
    Command("[SOURce#:]DATA:VOLatile:CLEar", _GUIDE, _clear, None),
    _attribute("POINts", len),
    _attribute("AVERage", lambda codes: float(np.mean(codes)) / _MIDDLE - 1),
    choice("FORMat:BORDer", _GUIDE, ("NORMal", "SWAPped"),
        lambda s: s.order, lambda s, word: replace(s, order=word)),
    choice("[SOURce#:]VOLTage:UNIT", _GUIDE, ("VPP",), lambda _: "VPP", lambda s, _: s),
    number("[SOURce#:]FREQuency:STARt", _GUIDE, "sweep_start_hz", scpi.FREQUENCY_UNITS,
        lambda s: s.frequency_range_hz, default=100e3, decimals=6),
    number("[SOURce#:]FREQuency:STOP", _GUIDE, "sweep_stop_hz", scpi.FREQUENCY_UNITS,
        lambda s: s.frequency_range_hz, default=1e6, decimals=6),
    switch("[SOURce#:]SWEep:STATe", _GUIDE, lambda s: s.mode is RunMode.SWEEP, _sweeping),
    number("[SOURce#:]SWEep:TIME", _GUIDE, "sweep_s", _SECONDS, lambda _: SWEEP_S, default=1.0, decimals=6),
    number("[SOURce#:]SWEep:HTIMe", _GUIDE, "sweep_hold_s", _SECONDS, lambda _: HOLD_S,
        default=0.0, decimals=6),
    choice("[SOURce#:]SWEep:SPACing", _GUIDE, Spacing,
        lambda s: s.sweep_spacing, lambda s, word: replace(s, sweep_spacing=word)),
    choice("TRIGger#:SOURce", _GUIDE, Trigger, lambda s: s.trigger, lambda s, word: replace(s, trigger=word)),
    switch("[SOURce#:]BURSt:STATe", _GUIDE,
        lambda s: s.mode is RunMode.BURST, lambda s, on: with_mode(RunMode.BURST, s, on)),
    burst_cycles(MOST_BURST_CYCLES, channels=2),
    choice("[SOURce#:]BURSt:MODE", _GUIDE, BurstMode,
        lambda s: s.burst_mode, lambda s, mode: replace(s, burst_mode=mode)),
    *map(modulation_switch, (RunMode.AM, RunMode.FM, RunMode.PM, RunMode.FSK, RunMode.PWM)),
)
# fmt: on
