"""A simulated Tektronix AFG1022: messages in, replies out, and the voltage at its terminal.

Reconstructed from the IVI driver ``tkafg1k``, public drivers tested on a real AFG1022 and public
measurements on an AFG1062 with firmware FV:V1.0.2; nothing here was compared with the lab's own unit.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from . import _output_signal as output_signal
from ._afg1022_settings import ChannelSettings
from ._arbitrary_memory import ArbitraryMemory, memory_name
from ._channel_commands import CHANNEL_COMMANDS, LOAD_COMMANDS, SWEEP_COMMANDS
from ._channel_output import ChannelOutput, OutputHabits
from ._common_commands import COMMON_COMMANDS
from ._memory_commands import MEMORY_COMMANDS
from ._modulation_commands import MODULATION_COMMANDS
from ._output_signal import Panel
from ._scpi_command import CHANNELS, Command, Quirks
from ._scpi_header import HeaderPath
from ._scpi_message import Unit, units
from ._scpi_status import BYTE, ErrorCode, ScpiError, Status, StatusByte
from ._terminal_voltage import Relay, Terminal

MAKER = "TEKTRONIX"
MODEL = "AFG1022"
DEFAULT_SERIAL = "C010101"
FIRMWARE = "SCPI:99.0 FV:V1.0.2"
SOUNDING_CHANNEL = 1
"""The channel whose terminal is wired; channel 2 keeps its settings and plays nothing."""


LONGEST_REPLY = 1 << 20
"""Bytes of the answers to one message; the longest that is of use has 17 kB."""
MOST_SPELLINGS = 4096
"""Of headers that are remembered."""


@dataclass(frozen=True)
class Reply:
    """What the instrument answers to one message; empty when nothing was asked."""

    data: bytes
    delay_s: float = 0.0
    """How long the instrument lets its host wait."""


class AFG1022:
    """The generator: one object behind USB, socket and the analogue world; any thread may call it.

    Parameters
    ----------
    clock
        Rig time [s]: when a command arrives. It is called outside the generator's lock, so that it may
        take a lock that is held while ``render`` is called.
    serial
        Serial number, part of the VISA address.
    quirks, panel, terminal
        Habits of the firmware; settings of the front panel; load, clock error and noise of the output.

    """

    maker, model, firmware = MAKER, MODEL, FIRMWARE

    def __init__(
        self,
        clock: Callable[[], float],
        *,
        serial: str = DEFAULT_SERIAL,
        quirks: Quirks = Quirks(),  # noqa: B008 - frozen
        panel: Panel = Panel(),  # noqa: B008 - frozen
        terminal: Terminal = Terminal(),  # noqa: B008 - frozen
    ) -> None:
        self.serial = serial
        self.quirks = quirks
        self.status = Status()
        self.memory = self._new_memory()
        self._clock = clock
        self._lock = threading.RLock()
        self._now_s = 0.0
        power_on = self._power_on(panel.declared_load_ohm)
        self._channels: dict[int, ChannelSettings] = dict.fromkeys(range(1, CHANNELS + 1), power_on)
        self._output = ChannelOutput(terminal, OutputHabits(quirks, panel, self.memory), power_on)
        self._saved: dict[int, tuple[ChannelSettings, ...]] = {}
        self._frequencies_locked = False
        self._identity_is_due_empty = False
        self._next_delay_s = 0.0
        self._next_is_corrupted = False
        self._commands = self._table()
        self._found: dict[str, tuple[Command, int]] = {}

    # What a transport needs

    def execute(self, message: bytes) -> Reply:
        """Carry out one complete message and return its reply."""
        now_s = self._clock()
        with self._lock:
            self._now_s = now_s
            answers = self._answers(message)
            if not answers:
                return Reply(b"")
            data = b";".join(answers) + b"\n"
            delay_s, self._next_delay_s = self._next_delay_s, 0.0
            if self._next_is_corrupted:
                self._next_is_corrupted = False
                data = _spoiled(data)
            return Reply(data, delay_s)

    def report(self, code: ErrorCode) -> None:
        """Queue an error that the interface has found: an unread reply, or a read without a query."""
        with self._lock:
            self.status.report(code)

    @property
    def status_byte(self) -> StatusByte:
        """The status byte without the bit for a waiting message."""
        with self._lock:
            return self.status.byte

    # What the analogue world needs

    def render(self, start_s: float, interval_s: float, count: int) -> NDArray[np.float64]:
        """Return the mean voltage at channel 1's terminal over consecutive intervals.

        Parameters
        ----------
        start_s
            Rig time of the first interval [s]; calls move forward in time.
        interval_s, count
            Length of the intervals [s] and how many.

        Returns
        -------
        NDArray
            Shape (count,) [V], into the load of ``Terminal``. Commands act at the rig time at which
            they arrived, or at the end of what was already rendered if that is later.

        """
        with self._lock:
            return self._output.render(start_s, interval_s, count)

    # What a command may do

    def settings(self, channel: int) -> ChannelSettings:
        """Return the settings of channel 1 or 2."""
        return self._channels[channel]

    def configure(self, channel: int, settings: ChannelSettings) -> None:
        """Check and take over new settings; raises ScpiError and changes nothing if they are refused."""
        settings.checked()
        output_signal.shape(settings.shape, self.memory, settings.duty_percent)
        previous = self._channels[channel]
        self._channels[channel] = settings
        if self._frequencies_locked and settings.frequency_hz != previous.frequency_hz:
            self._follow_frequency(channel)
        if channel == SOUNDING_CHANNEL:
            self._play(previous)

    # Faults on demand

    def weld_output_relay(self) -> None:
        """From now on ``OUTP OFF`` is obeyed and reported, and the output stays on all the same."""
        now_s = self._clock()
        with self._lock:
            self._output.weld_relay(self._channels[SOUNDING_CHANNEL], now_s)

    def repair_output_relay(self) -> None:
        """Let the output be what it is set to."""
        now_s = self._clock()
        with self._lock:
            self._output.repair_relay(self._channels[SOUNDING_CHANNEL], now_s)

    def jump_clock(self, by_s: float) -> None:
        """Let the generator's clock jump, and with it the phase of what plays [s]."""
        with self._lock:
            self._output.jump_clock(by_s)

    def delay_next_reply(self, delay_s: float) -> None:
        """Let the next reply come late; beyond the host's timeout it is found by the read after."""
        with self._lock:
            self._next_delay_s = delay_s

    def corrupt_next_reply(self) -> None:
        """Spoil the next reply: its first byte and every second one after it, but not its end."""
        with self._lock:
            self._next_is_corrupted = True

    # Messages

    def _answers(self, message: bytes) -> list[bytes]:
        """Carry out every unit of a message in order and collect the answers."""
        path = HeaderPath()
        answers: list[bytes] = []
        room = LONGEST_REPLY
        for unit in units(message):
            header, path = (HeaderPath() if unit.starts_line else path).resolve(unit.header)
            if unit.asks and room < 0:
                continue
            try:
                answers.extend(found := self._obey(header, unit))
            except ScpiError as error:
                self.status.report(error.code)
                continue
            room -= sum(map(len, found))
            if (
                found and room < 0
            ):  # nobody fetches them while the message is carried out (IEEE 488.2, 6.3.1.7)
                answers.clear()
                self.status.report(ErrorCode.QUERY_DEADLOCKED)
        return answers

    def _obey(self, header: str, unit: Unit) -> list[bytes]:
        """Carry out one unit; return its answer, if it asks."""
        command, suffix = self._find(header)
        if command is None or (command.ask if unit.asks else command.write) is None:
            return self._unknown(unit)
        if not 1 <= suffix <= command.channels:
            raise ScpiError(ErrorCode.SUFFIX_OUT_OF_RANGE)
        if unit.asks and command.ask is not None:
            return [command.ask(self, suffix, unit.parameters)]
        if command.write is not None:
            command.write(self, suffix, unit.parameters)
        return []

    def _find(self, header: str) -> tuple[Command | None, int]:
        """Return the command of a header, and its numeric suffix."""
        if header in self._found:
            return self._found[header]
        for command in self._commands:
            suffix = command.pattern.match(header)
            if suffix is not None:
                if len(self._found) >= MOST_SPELLINGS:
                    self._found.clear()
                self._found[header] = command, suffix
                return command, suffix
        return None, 1

    def _unknown(self, unit: Unit) -> list[bytes]:
        """Refuse a header that is not in the table, the way the firmware does."""
        if not self.quirks.unknown_is_syntax_error:
            raise ScpiError(ErrorCode.UNDEFINED_HEADER)
        self.status.report(ErrorCode.SYNTAX_ERROR)
        return [b""] if unit.asks else []

    # The output

    def _play(self, previous: ChannelSettings) -> None:
        """Bring the terminal in line with the settings of channel 1, as of now."""
        self._output.follow(previous, self._channels[SOUNDING_CHANNEL], self._now_s)

    def _follow_frequency(self, channel: int) -> None:
        """Give the other channel the same frequency, within what its shape allows."""
        leader = self._channels[channel]
        for other in self._channels:
            if other != channel:
                follower = self._channels[other]
                low, high = follower.frequency_range_hz
                hz = min(max(leader.frequency_hz, low), high)
                self._channels[other] = replace(follower, frequency_hz=hz)
                if other == SOUNDING_CHANNEL:
                    self._play(follower)

    def _new_memory(self) -> ArbitraryMemory:
        """Return the memory of waveforms at power-on."""
        return ArbitraryMemory()

    def _power_on(self, declared_load_ohm: float) -> ChannelSettings:
        """Return the settings of a channel at power-on."""
        return ChannelSettings(declared_load_ohm=declared_load_ohm)

    def _table(self) -> tuple[Command, ...]:
        """Return every command this firmware knows."""
        quirks = self.quirks
        return (
            *CHANNEL_COMMANDS,
            *(() if quirks.load_is_panel_only else LOAD_COMMANDS),
            *(() if quirks.sweep_is_unknown else SWEEP_COMMANDS),
            *MODULATION_COMMANDS,
            *MEMORY_COMMANDS,
            *COMMON_COMMANDS,
        )

    # Commands of the whole instrument (see common_commands)

    def identity(self) -> bytes:
        """Return who the instrument is; the first time after ``*CLS`` it may say nothing."""
        if self._identity_is_due_empty:
            self._identity_is_due_empty = False
            return b""
        return f"{self.maker},{self.model},{self.serial},{self.firmware}".encode("ascii")

    def clear_status(self) -> None:
        """Empty error queue and event register."""
        self.status.clear()
        self._identity_is_due_empty = self.quirks.first_identity_after_clear_is_empty

    def reset(self) -> None:
        """Return to the defaults; a load that only the panel can set stays."""
        self._frequencies_locked = False
        for channel, settings in self._channels.items():
            load_ohm = settings.declared_load_ohm if self.quirks.load_is_panel_only else 50.0
            self._replace(channel, self._power_on(load_ohm))

    def save(self, number: int) -> None:
        """Keep the settings of both channels under a number."""
        self._saved[number] = tuple(self._channels.values())

    def recall(self, number: int) -> None:
        """Return to saved settings, with the outputs off."""
        if number not in self._saved:
            raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
        for channel, settings in zip(self._channels, self._saved[number], strict=True):
            self._replace(channel, replace(settings, relay=Relay.OPEN))

    def _replace(self, channel: int, settings: ChannelSettings) -> None:
        previous, self._channels[channel] = self._channels[channel], settings
        if channel == SOUNDING_CHANNEL:
            self._play(previous)

    def trigger(self) -> None:
        """Start a waiting burst."""
        self._output.trigger(self._channels[SOUNDING_CHANNEL], self._now_s)

    def align_phases(self) -> None:
        """Start both channels at their start phase now."""
        self._output.align(self._channels[SOUNDING_CHANNEL], self._now_s)

    @property
    def frequencies_are_locked(self) -> bool:
        """Whether both channels share one frequency."""
        return self._frequencies_locked

    def lock_frequencies(self, channel: int, *, locked: bool) -> None:
        """Let the other channel follow the frequency of this one, or not."""
        self._frequencies_locked = locked
        if locked:
            self._follow_frequency(channel)

    def memory_changed(self) -> None:
        """Let a changed waveform act at once if it is playing."""
        sounding = self._channels[SOUNDING_CHANNEL]
        if memory_name(sounding.shape) is not None:
            self._play(sounding)


def _spoiled(reply: bytes) -> bytes:
    """Invert every second byte, from the first on, and leave the newline that frames the reply."""
    return bytes(byte if place % 2 else byte ^ BYTE for place, byte in enumerate(reply[:-1])) + reply[-1:]
