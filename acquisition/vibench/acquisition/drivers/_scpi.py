"""SCPI instruments over VISA: each setting is read back, and failed connections are reported with advice."""

import os
import re
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyvisa
from numpy.typing import NDArray
from pyvisa.resources import MessageBasedResource

from ..errors import AcquisitionError, InstrumentBusy, InstrumentError, InstrumentLost, SettingRefused
from ..host import LOG
from ..host.installation import shipped
from ..instruments import usb_ids

# Time limit for a reply [s]. The slowest known reply contains all 8192 points of a waveform.
TIMEOUT_S = 3.0
UDEV_RULES = "hardware_configs/70-vibench.rules"
USB_DEVICES = Path("/sys/bus/usb/devices")
USB_NODES = Path("/dev/bus/usb")
_MS_PER_S = 1000.0


Link = MessageBasedResource
"""An open VISA session with an instrument."""


def open_link(resource: str, visa_library: str, timeout_s: float = TIMEOUT_S) -> Link:
    """Open a VISA resource for messages that end in a newline.

    Raises InstrumentLost when no such instrument answers; InstrumentBusy when another program uses it;
    InstrumentError when the VISA library itself cannot be used.
    """
    manager = _manager(visa_library)
    try:
        link = manager.open_resource(resource, open_timeout=int(timeout_s * _MS_PER_S))
    except pyvisa.VisaIOError as error:
        if error.error_code == pyvisa.constants.StatusCode.error_resource_busy:
            raise InstrumentBusy(
                f"{resource} is in use by another program; close that program and open the bench again"
            ) from error
        raise _absent(resource, error) from error
    except MemoryError:  # the caller releases its memory reserve
        raise
    except Exception as error:  # pyvisa-py raises Exception, ValueError or OSError for absent devices
        raise _absent(resource, error) from error
    message_link = cast("Link", link)
    message_link.timeout = timeout_s * _MS_PER_S
    message_link.write_termination = "\n"
    if resource.upper().endswith("::SOCKET"):  # USB marks the end of a reply, a stream does not
        message_link.read_termination = "\n"
    return message_link


def list_visa_resources(visa_library: str = "@py") -> tuple[str, ...]:
    """Return the resource names of everything that the VISA library finds now.

    pyvisa-py writes USB numbers in decimal: ``USB0::1689::851::C010101::0::INSTR`` is an AFG1022.
    """
    with warnings.catch_warnings():
        # When pyvisa-py searches the network, it warns of missing packages and leaves a socket open.
        warnings.simplefilter("ignore", UserWarning)
        warnings.simplefilter("ignore", ResourceWarning)
        return tuple(_manager(visa_library).list_resources("?*"))


def _manager(visa_library: str) -> pyvisa.ResourceManager:
    # Keep one manager for each library until the process ends: all sessions share the manager, and closing
    # the manager would close them all.
    try:
        return pyvisa.ResourceManager(visa_library)
    except (OSError, ValueError) as error:
        raise InstrumentError(
            f"the VISA library {visa_library or 'of the system'} cannot be loaded ({error}); "
            'install it, or set generator.visa_library = "@py"'
        ) from error


def _absent(resource: str, error: Exception) -> InstrumentLost:
    # A list of other devices would help, but searching the network takes seconds: too long in an emergency.
    if _is_locked_out(resource):
        return InstrumentLost(
            f"{resource} is on the USB bus, but this user account may not use it ({error}). Copy "
            f"{shipped(UDEV_RULES)} to /etc/udev/rules.d, run 'udevadm control --reload' as root, and plug "
            "the instrument in again"
        )
    return InstrumentLost(
        f"no instrument answers at {resource} ({error}). Check the instrument's power and cable, and "
        "generator.resource in the hardware configuration; `vibench bench list` lists the instruments found"
    )


def _is_locked_out(resource: str) -> bool:
    """Whether Linux lists a USB device that this account may not write to; libusb finds no such device."""
    wanted = usb_ids(resource)
    for device in USB_DEVICES.glob("*"):
        try:
            found = tuple(int((device / each).read_text(), 16) for each in ("idVendor", "idProduct"))
            bus, number = (int((device / each).read_text()) for each in ("busnum", "devnum"))
        except (OSError, ValueError):  # the device is a port of a hub, or was just unplugged
            continue
        if found == wanted and not os.access(USB_NODES / f"{bus:03d}" / f"{number:03d}", os.W_OK):
            return True
    return False


Codes = NDArray[np.uint16]

# An error queue has some tens of entries. More replies than this mean that reading does not empty the queue.
_LONGEST_QUEUE = 64
# A faulty instrument may never stop sending. The longest SCPI text has 255 letters; 8192 points have 16 kB.
_LONGEST_TEXT = 300
_LONGEST_REPLY = 1_000_000
# Waiting time for a late reply [ms]: long enough to receive the reply, short enough for an emergency stop.
_STALE_REPLY_MS = 100.0
_LATE = pyvisa.constants.StatusCode.error_timeout
_QUEUE_ENTRY = re.compile(r'([+-]?[0-9]{1,9})\s*,\s*"?([^"]*)"?')
_LEADING_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")


class ScpiInstrument:
    """Commands, queries and verified settings over a VISA session.

    After a command the error queue is read until it is empty, which also waits until the instrument has
    carried out the command. After an interrupted query (Ctrl-C) the old reply is removed before the next
    query.

    Parameters
    ----------
    connect
        Function that opens the VISA session; `reconnect` calls it again.
    name
        Name of the instrument in errors.
    channel
        Replaces ``{c}`` in the headers of settings.
    settle_s
        Pause that the instrument needs after each command [s]; no pause is needed after a reply.
    """

    def __init__(
        self,
        connect: Callable[[], Link],
        name: str,
        channel: int = 1,
        settle_s: float = 0.0,
        pause: Callable[[float], None] = time.sleep,
    ) -> None:
        self.name = name
        self.channel = channel
        self.held: dict[str, Any] = {}
        """Values of the settings, as read back since the last failure, by SCPI header."""
        self._connect = connect
        self._settle_s = settle_s
        self._pause = pause
        self._lock = threading.RLock()
        self._link = connect()
        self._reply_due = False

    def command(self, message: str, codes: Codes | None = None) -> None:
        """Send a command; raises InstrumentError if the error queue has an entry afterwards."""
        if complaints := self.send(message, codes):
            raise InstrumentError(
                f"{self.name} refused {message!r}: {'; '.join(complaints)}. The setting has no effect; "
                "correct the value, or check that this firmware supports the command"
            )

    def send(self, message: str, codes: Codes | None = None) -> tuple[str, ...]:
        """Send a command, then 16-bit codes, if any, as a big-endian block; return the error queue's entries.

        The queue may contain entries from earlier commands.
        """
        with self._dialogue(message):
            if codes is None:
                self._link.write(message)
            else:
                block = pyvisa.util.to_ieee_block(codes.tolist(), "H", is_big_endian=True)
                self._link.write_raw(message.encode("ascii") + block + b"\n")
            # Some firmware silently drops messages that come too soon after a command.
            if self._settle_s > 0:
                self._pause(self._settle_s)
            return self.complaints()

    def query(self, message: str) -> str:
        """Return the reply to a query without its line end, decoded as GB 18030; replace invalid bytes."""
        # These generators send "ohm" as the GBK character A6 B8: invalid text must not stop a query.
        return self._ask(message, _LONGEST_TEXT).decode("gb18030", errors="replace").strip()

    def query_patiently(self, message: str) -> str:
        """Return the reply to a query; after an empty reply (as after ``*CLS``), repeat the query once."""
        return self.query(message) or self.query(message)

    def query_number(self, message: str) -> float:
        """Return the number in a reply; text after it is ignored."""
        reply = self.query(message)
        found = _LEADING_NUMBER.match(reply)
        if found is None or not isfinite(number := float(found.group(1))):
            raise InstrumentError(
                f"{self.name}: {message} was answered with {reply!r}, which is not a number; try again"
            )
        return number

    def query_codes(self, message: str) -> Codes:
        """Return a big-endian binary block of 16-bit codes."""
        reply = self._ask(message, _LONGEST_REPLY)
        first, length = _block(reply)
        if length < 0:
            raise InstrumentError(
                f"{self.name}: {message} was answered without a binary block ({reply[:20]!r}); try again"
            )
        payload = reply[first : first + length]
        if len(payload) != length or length % 2:
            raise InstrumentError(
                f"{self.name}: {message} announced {length} bytes but sent {len(payload)}; both must be "
                "the same even number. Upload the waveform again"
            )
        return np.frombuffer(payload, dtype=">u2").astype(np.uint16)

    def complaints(self) -> tuple[str, ...]:
        """Empty the error queue and return its entries."""
        found: list[str] = []
        for _ in range(_LONGEST_QUEUE):
            reply = self.query_patiently("SYST:ERR?")
            entry = _QUEUE_ENTRY.fullmatch(reply)
            if entry is None:
                raise InstrumentError(
                    f"{self.name} answered SYST:ERR? with {reply!r}, which is not an entry of an error "
                    "queue; check the cable, and try again"
                )
            if int(entry[1]) == 0:
                return tuple(found)
            found.append(f"{entry[2]} ({int(entry[1])})")
        raise InstrumentError(
            f"{self.name} still reports errors after {_LONGEST_QUEUE} were read; "
            "switch the instrument off and on, and open the bench again"
        )

    def last_value(self, header: str) -> Any:
        """Return the last value read back for a setting; raises InstrumentError after a failed change."""
        if header not in self.held:
            raise InstrumentError(
                f"{self.name}: a change failed, so the settings are unknown; load a sine or a waveform first"
            )
        return self.held[header]

    def end_if_known(self, header: str, word: str, answers: tuple[str, ...]) -> None:
        """End a mode. An empty reply means that the firmware has no such mode, so it cannot be on."""
        header = header.format(c=self.channel)
        self.send(f"{header} {word}")
        reply = self.query(f"{header}?")
        self.complaints()  # after an unknown query, the reply is empty and the queue has an error
        if reply and reply.strip('"').upper() not in answers:
            raise SettingRefused(
                f"{self.name}: {header} was set to {word}, but still reads {reply!r}; "
                "the output is off. End that mode on the instrument's panel and open the bench again"
            )

    def disconnect(self) -> None:
        """Close the session. May be called at any time, even when the connection is lost."""
        with self._lock, self._report_losses("closing the session"):
            self._link.close()

    def reconnect(self) -> None:
        """Open a new session, even if the old session still exists or has failed."""
        try:
            self.disconnect()
        except InstrumentError as error:
            LOG.debug("%s: %s", self.name, error)
        self._link = self._connect()
        self._reply_due = False

    def _ask(self, message: str, longest: int) -> bytes:
        with self._dialogue(message):
            self._reply_due = True
            self._link.write(message)
            reply = self._link.read_bytes(longest + 1, break_on_termchar=True)
            # A read from a stream also ends at a newline byte among the waveform codes.
            while self._link.read_termination and len(reply) <= min(sum(_block(reply)), longest):
                reply += self._link.read_bytes(longest + 1 - len(reply), break_on_termchar=True)
            if len(reply) > longest:
                raise InstrumentError(
                    f"{self.name}: {message} was answered with more than {longest} bytes; check the "
                    "instrument's address, switch the instrument off and on, and open the bench again"
                )
            self._reply_due = False
        LOG.debug("%s answers %r", self.name, reply)
        return reply

    @contextmanager
    def _dialogue(self, message: str) -> Iterator[None]:
        """Exchange messages with the instrument; first discard the reply to an interrupted query."""
        with self._lock:
            if self._reply_due:
                self._reply_due = False
                with self._report_losses("resuming the dialogue"):
                    usual_ms, self._link.timeout = self._link.timeout, _STALE_REPLY_MS
                    try:
                        is_stream = bool(self._link.read_termination)  # waveform codes may contain newlines
                        self._link.read_bytes(_LONGEST_REPLY, break_on_termchar=not is_stream)
                    except pyvisa.VisaIOError as error:
                        if error.error_code != _LATE:
                            raise
                    finally:
                        self._link.timeout = usual_ms
            with self._report_losses(message):
                yield

    @contextmanager
    def _report_losses(self, doing: str) -> Iterator[None]:
        LOG.debug("%s: %s", self.name, doing)
        try:
            yield
        except (AcquisitionError, MemoryError):
            raise
        except Exception as error:  # pyvisa-py does not catch errors of PyUSB, sockets and RPC
            if isinstance(error, pyvisa.VisaIOError) and error.error_code == _LATE:
                raise InstrumentError(
                    f"{self.name} did not answer {doing!r} within {self._link.timeout / 1000:g} s; "
                    "its state is unknown. Check that it is not busy and shows no menu, and try again"
                ) from error
            raise InstrumentLost(
                f"the connection to {self.name} is lost: {doing!r} failed ({error}). The state of its output "
                "is unknown; check the instrument's cable and power, then open the bench again"
            ) from error


def _block(reply: bytes) -> tuple[int, int]:
    """Return the start and the length of the data of a binary block; (0, -1) for other replies."""
    try:
        return pyvisa.util.parse_ieee_block_header(reply, 0) if reply.startswith(b"#") else (0, -1)
    except ValueError:
        return 0, -1


# Settings are descriptors: an assignment sends the value, reads it back, and keeps the instrument's value. If
# a value is out of range, these generators use a default without an error (Tektronix AFG1000 programmer
# manual, general syntax). Only reading back shows this.


@dataclass(frozen=True)
class Number:
    """Numeric setting, sent in format ``form``. A value read back outside the tolerances is an error."""

    header: str
    """SCPI header of the setting; ``{c}`` stands for the channel."""
    form: str = "{:g}"
    absolute: float = 0.0
    relative: float = 0.0

    def __get__(self, owner: ScpiInstrument, _: type | None = None) -> float:
        return float(owner.last_value(self.header))

    def __set__(self, owner: ScpiInstrument, value: float) -> None:
        header, text = self.header.format(c=owner.channel), self.form.format(value)
        owner.command(f"{header} {text}")
        got = owner.query_number(f"{header}?")
        if not abs(got - value) <= self.absolute + self.relative * abs(value):  # this form also refuses a NaN
            raise _refusal(owner, header, text, f"{got:.10g}")
        owner.held[self.header] = got


@dataclass(frozen=True)
class Word:
    """Setting whose value is a word; ``answers`` lists the valid replies for each word, in upper case."""

    header: str
    answers: Mapping[str, tuple[str, ...]]

    def __get__(self, owner: ScpiInstrument, _: type | None = None) -> str:
        return str(owner.last_value(self.header))

    def __set__(self, owner: ScpiInstrument, word: str) -> None:
        owner.command(f"{self.header.format(c=owner.channel)} {word}")
        self._expect(owner, word)

    def insist(self, owner: ScpiInstrument, word: str) -> None:
        """Change the setting. Only the value read back counts: queued errors may be old and are ignored."""
        owner.send(f"{self.header.format(c=owner.channel)} {word}")
        self._expect(owner, word)

    def _expect(self, owner: ScpiInstrument, word: str) -> None:
        header = self.header.format(c=owner.channel)
        reply = owner.query(f"{header}?")
        if reply.strip('"').upper() not in self.answers[word]:
            raise _refusal(owner, header, word, reply)
        owner.held[self.header] = word


def _refusal(owner: ScpiInstrument, header: str, sent: str, got: str) -> SettingRefused:
    return SettingRefused(
        f"{owner.name}: {header} was set to {sent}, but {got!r} was read back: the instrument uses another "
        "value but reports no error. Stop, and check this setting and its limits on the panel"
    )


SWITCH = {"ON": ("1", "ON"), "OFF": ("0", "OFF")}
"""Command words of an on/off setting, and the valid replies to its query for each word."""
