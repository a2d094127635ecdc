"""A simulated Keysight 33500B: the output stage of the AFG1022, with another table of commands.

Source: Keysight Trueform Series Operating and Service Guide, as used by public drivers (pymeasure's
``agilent33500``, MATLAB and Python programs of laboratories); not compared with an instrument.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vibench.virtual_rig.generator import scpi_message as scpi
from vibench.virtual_rig.generator.afg1022 import (
    AFG1022,
    SHARED_COMMANDS,
    burst_cycles,
    load_command,
    modulation_switch,
    with_mode,
    without_mode,
)
from vibench.virtual_rig.generator.channel_output import SINE, BurstMode, ChannelSettings, RunMode, Trigger
from vibench.virtual_rig.generator.scpi_instrument import Command, Quirks, choice, number, setting
from vibench.virtual_rig.generator.terminal_voltage import Spacing

_MIDDLE = 32_767
HIGHEST_RATE_HZ = 250e6
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
    points, top_code = (8, 1_048_576), 65_534  # codes -32767 to 32767, shifted to begin at zero
    defaults = _Settings()

    def __init__(self, *arguments: object, **options: object) -> None:
        super().__init__(*arguments, **{"serial": DEFAULT_SERIAL, **options, "quirks": _QUIRKS})  # type: ignore[arg-type]
        self.selected = ""

    def _table(self, quirks: Quirks) -> tuple[Command, ...]:
        del quirks
        return (*_COMMANDS, *SHARED_COMMANDS)


def _name(parameter: bytes) -> str:
    """Return a waveform's name in quotes; the quotes distinguish it from the names of other memories."""
    bare = scpi.text(parameter).strip('"').upper()
    return f'"{bare}"'


def _write_dac(own: Keysight33500B, _: int, name: bytes, data: bytes) -> None:
    """Store a waveform from a binary block of 16-bit numbers."""
    settings = own.settings(1)
    assert isinstance(settings, _Settings)
    codes = scpi.numbers(data, ">i2" if settings.order == "NORMal" else "<i2") + _MIDDLE
    stored = own.memory.names[1:]
    if _name(name) in stored:
        raise scpi.ScpiError(scpi.ErrorCode.SETTINGS_CONFLICT)  # 786, "Specified arb waveform already exists"
    if sum(own.memory.codes(each).size for each in stored) + codes.size > own.points[1]:
        raise scpi.ScpiError(scpi.ErrorCode.OUT_OF_MEMORY)
    own.memory.store(_name(name), codes)


def _select(own: Keysight33500B, channel: int, parameter: bytes) -> None:
    rate_hz = _rate_hz(own, channel)
    own.memory.copy(_name(parameter), scpi.EDIT_MEMORY)
    own.selected = _name(parameter)
    own.memory_changed()
    if own.settings(channel).shape == scpi.EDIT_MEMORY:
        _set_rate(own, channel, rate_hz)


def _clear(own: Keysight33500B, channel: int) -> None:
    if own.settings(channel).shape == scpi.EDIT_MEMORY:
        own.configure(channel, replace(own.settings(channel), shape=SINE))
    own.memory.clear()
    own.selected = ""


def _attribute(node: str, of: Callable[[scpi.Codes], float]) -> Command:
    """Return the query for a number that describes a stored waveform."""
    return Command(
        f"[SOURce#:]DATA:ATTRibute:{node}", _GUIDE, query_takes=1,
        ask=lambda own, _, name: scpi.as_number(of(own.memory.codes(_name(name)))),
    )  # fmt: skip


def _rate_hz(own: Keysight33500B, channel: int) -> float:
    return own.settings(channel).frequency_hz * len(own.memory.codes(scpi.EDIT_MEMORY))


def _set_rate(own: Keysight33500B, channel: int, rate_hz: float) -> None:
    points = len(own.memory.codes(scpi.EDIT_MEMORY))
    own.configure(channel, replace(own.settings(channel), frequency_hz=rate_hz / points))


def _write_rate(own: Keysight33500B, channel: int, parameter: bytes) -> None:
    rate_hz = scpi.number(parameter, scpi.NO_UNITS)
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
    Command("[SOURce#:]FUNCtion:ARBitrary", _GUIDE, _select, lambda own, _: own.selected.strip('"').encode()),
    Command("[SOURce#:]FUNCtion:ARBitrary:SRATe", _GUIDE, _write_rate,
        lambda own, channel: scpi.as_number(_rate_hz(own, channel))),
    choice("[SOURce#:]FUNCtion:ARBitrary:FILTer", _GUIDE, ("OFF", "STEP", "NORMal"),
        lambda s: s.filter, lambda s, word: replace(s, filter=word)),
    Command("[SOURce#:]DATA:ARBitrary:DAC", _GUIDE, _write_dac, takes=2),
    Command("[SOURce#:]DATA:VOLatile:CLEar", _GUIDE, _clear, takes=0),
    _attribute("POINts", len),
    _attribute("AVERage", lambda codes: float(np.mean(codes)) / _MIDDLE - 1),
    choice("FORMat:BORDer", _GUIDE, ("NORMal", "SWAPped"),
        lambda s: s.order, lambda s, word: replace(s, order=word)),
    choice("[SOURce#:]VOLTage:UNIT", _GUIDE, ("VPP",), lambda _: "VPP", lambda s, _: s),
    number("[SOURce#:]FREQuency:STARt", _GUIDE, "sweep_start_hz", scpi.FREQUENCY_UNITS,
        lambda s: s.frequency_range_hz, default=100e3, decimals=6),
    number("[SOURce#:]FREQuency:STOP", _GUIDE, "sweep_stop_hz", scpi.FREQUENCY_UNITS,
        lambda s: s.frequency_range_hz, default=1e6, decimals=6),
    setting("[SOURce#:]SWEep:STATe", _GUIDE, lambda s: s.mode is RunMode.SWEEP, _sweeping),
    number("[SOURce#:]SWEep:TIME", _GUIDE, "sweep_s", _SECONDS,
        lambda _: (1e-3, 250e3), default=1.0, decimals=6),
    number("[SOURce#:]SWEep:HTIMe", _GUIDE, "sweep_hold_s", _SECONDS,
        lambda _: (0.0, 3600.0), default=0.0, decimals=6),
    choice("[SOURce#:]SWEep:SPACing", _GUIDE, Spacing,
        lambda s: s.sweep_spacing, lambda s, word: replace(s, sweep_spacing=word)),
    choice("TRIGger#:SOURce", _GUIDE, Trigger, lambda s: s.trigger, lambda s, word: replace(s, trigger=word)),
    setting("[SOURce#:]BURSt:STATe", _GUIDE, lambda s: s.mode is RunMode.BURST,
        partial(with_mode, RunMode.BURST)),
    burst_cycles(100_000_000, channels=2),
    choice("[SOURce#:]BURSt:MODE", _GUIDE, BurstMode,
        lambda s: s.burst_mode, lambda s, mode: replace(s, burst_mode=mode)),
    *map(modulation_switch, (RunMode.AM, RunMode.FM, RunMode.PM, RunMode.FSK, RunMode.PWM)),
)
# fmt: on
