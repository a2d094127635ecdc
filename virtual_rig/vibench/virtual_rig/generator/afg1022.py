"""A simulated Tektronix AFG1022: messages in, replies out, and the voltage at its terminal.

The simulation is reconstructed from the IVI driver ``tkafg1k`` (IVI), public drivers tested on a real AFG1022
(drivers) and public measurements on an AFG1062 with firmware FV:V1.0.2 (AFG1062); nothing here was compared
with the lab's own unit. `COMMANDS` names the source of each command.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from . import scpi_message as scpi
from .channel_output import (
    MODULATIONS,
    OPEN_AMPLITUDE_RANGE_VPP,
    OPEN_PEAK_V,
    BurstMode,
    ChannelOutput,
    ChannelSettings,
    RunMode,
    highest_frequency_hz,
    shape_of,
    standard_shape,
)
from .scpi_instrument import (
    CHANNELS,
    Command,
    Quirks,
    ScpiInstrument,
    choice,
    number,
    setting,
)
from .terminal_voltage import Relay, Terminal

DEFAULT_SERIAL = "C010101"
SOUNDING_CHANNEL = 1
"""The only connected channel; channel 2 only stores settings."""


class AFG1022(ScpiInstrument):
    """The generator, for USB, socket and the analogue world.

    Parameters
    ----------
    clock
        See `ScpiInstrument`.
    serial
        Serial number, part of the VISA address.
    quirks, terminal
        Peculiarities of the firmware; properties of the output (load, clock error, noise).
    """

    maker, model, firmware = "TEKTRONIX", "AFG1022", "SCPI:99.0 FV:V1.0.2"
    points, top_code = (2, 8192), 16383  # 14-bit codes (by the IVI driver and public programs)
    defaults = ChannelSettings()

    def __init__(
        self,
        clock: Callable[[], float],
        *,
        serial: str = DEFAULT_SERIAL,
        quirks: Quirks = Quirks(),  # noqa: B008 - frozen
        terminal: Terminal = Terminal(),  # noqa: B008 - frozen
    ) -> None:
        identity = f"{self.maker},{self.model},{serial},{self.firmware}"
        super().__init__(clock, identity, quirks, self._table(quirks))
        self.serial = serial
        self.memory = scpi.ArbitraryMemory(self.points, self.top_code)
        self._power_on = replace(self.defaults, declared_load_ohm=quirks.panel_load_ohm or 50.0)
        self._channels = dict.fromkeys(range(1, CHANNELS + 1), self._power_on)
        self._output = ChannelOutput(terminal, self.memory, self._power_on)
        self.frequencies_are_locked = False

    def _table(self, quirks: Quirks) -> tuple[Command, ...]:
        return (*COMMANDS, LOAD) if quirks.panel_load_ohm is None else COMMANDS

    def render(self, start_s: float, interval_s: float, count: int) -> NDArray[np.float64]:
        """Return the mean voltage at channel 1's terminal over ``count`` intervals, shape (count,) [V].

        The first interval begins at ``start_s`` [s of rig time], which must not decrease from call to call.
        The load is the load in ``Terminal``. Commands take effect at the rig time of their arrival or, if
        later, at the end of the rendered part.
        """
        with self.lock:
            return self._output.render(start_s, interval_s, count)

    # Operations for commands

    def settings(self, channel: int) -> ChannelSettings:
        """Return the settings of channel 1 or 2."""
        return self._channels[channel]

    def configure(self, channel: int, settings: ChannelSettings) -> None:
        """Check and apply new settings; if they are refused, raises ScpiError and changes nothing."""
        settings.check()
        shape_of(settings, self.memory)
        previous = self._channels[channel]
        self._replace(channel, settings)
        if self.frequencies_are_locked and settings.frequency_hz != previous.frequency_hz:
            self._follow_frequency(channel)

    def lock_frequencies(self, channel: int, *, locked: bool) -> None:
        """Make the other channel follow this channel's frequency, or no longer follow it."""
        self.frequencies_are_locked = locked
        if locked:
            self._follow_frequency(channel)

    def memory_changed(self) -> None:
        """If a changed waveform is playing, apply the change at once."""
        sounding = self._channels[SOUNDING_CHANNEL]
        if standard_shape(sounding.shape) is None:
            self._replace(SOUNDING_CHANNEL, sounding)

    def reset(self) -> None:
        """Restore the defaults, except the load setting if only the panel can set it."""
        self.frequencies_are_locked = False
        for channel in self._channels:
            self._replace(channel, self._power_on)

    def trigger(self) -> None:
        """Start a burst or sweep that waits for a trigger (``*TRG``)."""
        self._output.trigger(self._channels[SOUNDING_CHANNEL], self.now_s)

    def align_phases(self) -> None:
        """Set both channels to their start phase at once."""
        self._output.align(self._channels[SOUNDING_CHANNEL], self.now_s)

    def _replace(self, channel: int, settings: ChannelSettings) -> None:
        previous, self._channels[channel] = self._channels[channel], settings
        if channel == SOUNDING_CHANNEL:
            self._output.follow(previous, settings, self.now_s)

    def _follow_frequency(self, leader: int) -> None:
        """Set the frequency of the other channels, within the limits of their shapes."""
        for channel, follower in self._channels.items():
            if channel != leader:
                low, high = follower.frequency_range_hz
                hz = min(max(self._channels[leader].frequency_hz, low), high)
                self._replace(channel, replace(follower, frequency_hz=hz))

    # Faults

    def stick_output_relay(self, *, is_stuck: bool) -> None:
        """Make ``OUTP OFF`` ineffective (accepted and reported as off, but still on), or repair the relay."""
        now_s = self.clock()
        with self.lock:
            self._output.relay_is_stuck = is_stuck
            settings = self._channels[SOUNDING_CHANNEL]
            self._output.follow(settings, settings, now_s)

    def jump_clock(self, by_s: float) -> None:
        """Shift the generator's clock, and thus the phase of its output [s]."""
        with self.lock:
            self._output.jump(by_s)


# Special commands


def with_mode(mode: RunMode, settings: ChannelSettings, wanted: bool) -> ChannelSettings:  # noqa: FBT001
    """Return settings with a run mode switched on or off; in SCPI, every run mode has a separate switch."""
    if wanted:
        return replace(settings, mode=mode)
    return replace(settings, mode=RunMode.CONTINUOUS) if settings.mode is mode else settings


def without_mode(mode: RunMode, settings: ChannelSettings, wanted: bool) -> ChannelSettings:  # noqa: FBT001
    """Return settings with an unsimulated mode switched off; such a mode cannot be switched on (-241)."""
    if wanted:
        raise scpi.ScpiError(scpi.ErrorCode.HARDWARE_MISSING)
    return with_mode(mode, settings, wanted)


def modulation_switch(mode: RunMode) -> Command:
    """Return the command that switches a modulation off, or queries its state."""
    return setting(
        f"[SOURce#:]{mode.value}:STATe", "IVI; on: not simulated",
        lambda s: s.mode is mode, partial(without_mode, mode),
    )  # fmt: skip


def _write_shape(generator: AFG1022, channel: int, parameter: bytes) -> None:
    """Select a shape, and lower the frequency to the limit of this shape if necessary."""
    settings = generator.settings(channel)
    name = standard_shape(scpi.text(parameter)) or scpi.memory_name(parameter)
    frequency_hz = min(settings.frequency_hz, highest_frequency_hz(name))
    generator.configure(channel, replace(settings, shape=name, frequency_hz=frequency_hz))


def _whole_degrees(parameter: bytes) -> int:
    """Return the phase in whole degrees, truncated, from ``31DEG`` or radians; it must not be negative."""
    full_turn_deg = 360.0
    angle, unit = scpi.number_and_unit(parameter)
    if unit not in ("", "RAD", "DEG"):
        raise scpi.ScpiError(scpi.ErrorCode.INVALID_SUFFIX)
    angle_deg = angle if unit == "DEG" else math.degrees(angle)
    if not 0 <= angle_deg <= full_turn_deg:
        raise scpi.ScpiError(scpi.ErrorCode.DATA_OUT_OF_RANGE)
    # Without the margin 1e-9, 31 degrees sent in radians could be truncated to 30.
    return math.floor(angle_deg + 1e-9)


def _load_memory(generator: AFG1022, _: int, target: bytes, data: bytes) -> None:
    generator.memory.store(scpi.memory_name(target), scpi.numbers(data, ">u2"))
    generator.memory_changed()


def _read_memory(generator: AFG1022, _: int, name: bytes) -> bytes:
    return scpi.as_block(generator.memory.codes(scpi.memory_name(name)).astype(">u2").tobytes())


def _define_memory(generator: AFG1022, _: int, target: bytes, points: bytes) -> None:
    if scpi.memory_name(target) != scpi.EDIT_MEMORY:
        raise scpi.ScpiError(scpi.ErrorCode.ILLEGAL_PARAMETER_VALUE)
    generator.memory.define(scpi.integer(points))
    generator.memory_changed()


def _copy_memory(generator: AFG1022, _: int, target: bytes, source: bytes) -> None:
    generator.memory.copy(scpi.memory_name(source), scpi.memory_name(target))
    generator.memory_changed()


def _ask_catalogue(generator: AFG1022, _: int) -> bytes:
    edit, *users = generator.memory.names
    names = [edit, *sorted(users, key=lambda name: int(name.removeprefix("USER")))]
    return ",".join(f'"{name}"' for name in names).encode("ascii")


def load_command(header: str) -> Command:
    """Return the command that declares the load; high impedance is an infinite load."""
    row = number(
        header, "IVI; drivers contradict each other", "declared_load_ohm", scpi.RESISTANCE_UNITS,
        lambda _: (1.0, 10e3), default=50.0, decimals=0, largest=math.inf,
    )  # fmt: skip

    def ask(generator: AFG1022, channel: int) -> bytes:
        assert row.ask is not None
        reply = row.ask(generator, channel)
        is_open = math.isinf(generator.settings(channel).declared_load_ohm)
        gbk_ohm_sign = b"\xa6\xb8"
        return reply + gbk_ohm_sign if is_open and generator.quirks.high_impedance_has_ohm_sign else reply

    return replace(row, ask=ask)


_share = attrgetter("declared_share")
_DUTY = number(
    "[SOURce#:]PULSe:DCYCle", "drivers, AFG1062; range assumed", "duty_percent", scpi.PERCENT_UNITS,
    lambda _: (0.1, 99.9), default=50.0, decimals=1,
)  # fmt: skip


def _write_duty(generator: AFG1022, channel: int, parameter: bytes) -> None:
    """Set the duty cycle and queue an error, as the instrument does."""
    assert _DUTY.write is not None
    _DUTY.write(generator, channel, parameter)
    raise scpi.ScpiError(scpi.ErrorCode.SYNTAX_ERROR)


def burst_cycles(most: int, channels: int) -> Command:
    """Return the command that sets the number of periods in a burst."""
    return number(
        "[SOURce#:]BURSt:NCYCles", "IVI, drivers", "burst_cycles", scpi.NO_UNITS, lambda _: (1, most),
        default=5, decimals=0, channels=channels, largest=math.inf,
    )  # fmt: skip


# fmt: off
LOAD = load_command("OUTPut#:IMPedance")
SHARED_COMMANDS = (
    Command("*RST", "IEEE 488.2, 10.32", lambda generator, _: generator.reset(), takes=0),
    Command("*TRG", "IEEE 488.2, 10.37", lambda generator, _: generator.trigger(), takes=0),
    setting("OUTPut#[:STATe]", "IVI",
        lambda s: s.relay is Relay.CLOSED,
        lambda s, on: replace(s, relay=Relay.CLOSED if on else Relay.OPEN)),
    number("[SOURce#:]FREQuency[:FIXed]", "IVI", "frequency_hz", scpi.FREQUENCY_UNITS,
        lambda s: s.frequency_range_hz, default=1e6, decimals=6),
    number("[SOURce#:]VOLTage[:LEVel][:IMMediate][:AMPLitude]", "IVI", "amplitude_vpp", scpi.AMPLITUDE_UNITS,
        lambda s: (OPEN_AMPLITUDE_RANGE_VPP[0] * _share(s), OPEN_AMPLITUDE_RANGE_VPP[1] * _share(s)),
        default=1.0, decimals=4, scale=_share),
    number("[SOURce#:]VOLTage[:LEVel][:IMMediate]:OFFSet", "IVI", "offset_v", scpi.VOLTAGE_UNITS,
        lambda s: (-OPEN_PEAK_V * _share(s), OPEN_PEAK_V * _share(s)), default=0.0, decimals=4, scale=_share),
)
COMMANDS = (
    *SHARED_COMMANDS,
    Command("[SOURce#:]FUNCtion[:SHAPe]", "IVI, except 45 built-in shapes", _write_shape,
        lambda generator, channel: generator.settings(channel).shape.encode("ascii")),
    setting("[SOURce#:]PHASe[:ADJust]", "AFG1062",
        lambda s: s.phase_deg, lambda s, deg: replace(s, phase_deg=deg),
        parse=_whole_degrees, show=lambda deg: scpi.as_number(math.radians(deg))),
    Command("[SOURce#:]PHASe:INITiate", "AFG1062", lambda generator, _: generator.align_phases(), takes=0),
    replace(_DUTY, write=_write_duty),
    Command("[SOURce#:]FREQuency:CONCurrent[:STATe]", "drivers",
        lambda generator, channel, on: generator.lock_frequencies(channel, locked=scpi.boolean(on)),
        lambda generator, _: b"1" if generator.frequencies_are_locked else b"0"),
    choice("[SOURce#:]FREQuency:MODE", "IVI; sweep: not simulated", ("CW", "SWEep"),
        lambda s: "SWEep" if s.mode is RunMode.SWEEP else "CW",
        lambda s, word: without_mode(RunMode.SWEEP, s, word == "SWEep")),
    setting("[SOURce#:]BURSt[:STATe]", "IVI, drivers",
        lambda s: s.mode is RunMode.BURST, partial(with_mode, RunMode.BURST), channels=1),
    burst_cycles(50_000, channels=1),
    choice("[SOURce#:]BURSt:MODE", "IVI, drivers", BurstMode,
        lambda s: s.burst_mode, lambda s, mode: replace(s, burst_mode=mode), channels=1),
    *(modulation_switch(mode) for mode in MODULATIONS),
    Command("DATA[:DATA]", "IVI, drivers", _load_memory, _read_memory, takes=2, query_takes=1),
    Command("DATA:DEFine", "IVI", _define_memory, takes=2),
    Command("DATA:POINts", "IVI, drivers", query_takes=1,
        ask=lambda generator, _, name: b"%d" % len(generator.memory.codes(scpi.memory_name(name)))),
    Command("DATA:COPY", "IVI, drivers", _copy_memory, takes=2),
    Command("DATA:CATalog", "IVI, drivers", ask=_ask_catalogue),
)
"""Commands of an AFG1022, except the common commands and `LOAD`."""
# fmt: on
