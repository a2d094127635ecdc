"""The USB test-and-measurement class of an instrument: messages in bulk transfers.

Sources: USBTMC 1.0 (2003) and its USB488 subclass 1.0; section numbers in the docstrings refer to
USBTMC. Waiting is not simulated: a transfer that would exceed the host's timeout fails at once.
"""

import errno
import os
import struct
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import NoReturn

from ..generator.afg1022 import AFG1022
from ..generator.scpi_message import BYTE, LONGEST_MESSAGE, ErrorCode

# A USB device for the bus: descriptors, and transfers that succeed or fail like real ones. The bus does not
# know whether a device is in this process or behind a network connection. Transfers fail with OSError: ENODEV
# if the device is disconnected, EPIPE if the device stalls an endpoint, and TimeoutError (ETIMEDOUT) if the
# device does not answer in time.

BULK_OUT = 0x01
BULK_IN = 0x82


@dataclass(frozen=True)
class Identification:
    """Identity that a USB device reports at enumeration."""

    vendor_id: int
    product_id: int
    maker: str
    product: str
    serial: str
    packet_bytes: int = 64
    """Largest bulk packet; the real instrument's value is unknown."""

    @property
    def resource_name(self) -> str:
        """The VISA address of the device's instrument interface."""
        return f"USB0::0x{self.vendor_id:04X}::0x{self.product_id:04X}::{self.serial}::INSTR"


AFG1022_IDS = 0x0699, 0x0353
"""USB vendor and product number; both are the same for AFG1022 and AFG1062."""
HEADER = struct.Struct("<BBBxIBBxx")
"""Bulk header: message id, tag, inverted tag, length, attributes, termination character (tables 1 to 4)."""
ALIGNMENT = 4
NEVER_MS = 2**32 - 1


class MessageId(IntEnum):
    """Type of a bulk transfer (USBTMC table 2)."""

    OUT = 1
    REQUEST_IN = 2


END_OF_MESSAGE = 1
"""Attribute of a bulk header (USBTMC tables 3 and 9)."""
SUCCESS = 1
TRANSFER_NOT_IN_PROGRESS = 0x81
"""Values of the first byte of the response to a class request (table 16)."""

_CAPABILITIES = bytes([SUCCESS, 0, 0x00, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0x00, 0x01, 0b100, 0, *bytes(8)])
"""Reply to GET_CAPABILITIES: USBTMC 1.0 without options, USB488 1.0 with 488.2, and reserved bytes."""


@dataclass
class _Flight:
    """Pending data between host and instrument; the data are lost if the cable or the instrument fails."""

    message: bytes = b""
    """Parts of an incomplete message that have been received so far."""
    reply: bytes = b""
    late_ms: float = 0.0
    """Remaining delay of the reply [ms]."""
    request: tuple[int, int] | None = None
    """Tag and length of the host's request for a reply."""
    rest: bytes = b""
    """Remainder of a transfer that did not fit into the host's buffer."""
    aborting: bool = False
    """Whether an aborted transfer must still send its short packet."""


class UsbTmcInstrument:
    """An instrument on a USB cable, which can be disconnected."""

    def __init__(self, device: AFG1022, usb_ids: tuple[int, int] = AFG1022_IDS) -> None:
        self._device = device
        self.identification = Identification(*usb_ids, device.maker, device.model, device.serial)
        self._lock = threading.RLock()
        self._failures: set[int] = set()
        self._flight = _Flight()

    def fail(self, number: int) -> None:
        """Let all transfers fail with ENODEV (cable pulled) or ETIMEDOUT (hung); the output continues."""
        with self._lock:
            self._failures.add(number)

    def mend(self, number: int) -> None:
        """End a failure: reconnect the cable, or make the instrument respond again; pending data are lost."""
        with self._lock:
            self._failures.discard(number)
            self._flight = _Flight()

    # Transfers

    def bulk_out(self, data: bytes) -> None:
        """Receive one bulk-OUT transfer: part of a message, or a request for a reply (3.2)."""
        with self._lock:
            self._check_cable()
            if len(data) < HEADER.size:
                _fail(errno.EPIPE)
            message_id, tag, inverse, length, attributes, _ = HEADER.unpack_from(data)
            if tag == 0 or tag ^ inverse != BYTE:
                _fail(errno.EPIPE)
            if message_id == MessageId.OUT:
                self._take(data[HEADER.size : HEADER.size + length], attributes)
            elif message_id == MessageId.REQUEST_IN:
                self._flight.request = tag, length
            else:
                _fail(errno.EPIPE)

    def bulk_in(self, length: int, timeout_ms: int) -> bytes:
        """Return the requested reply (3.3), or time out.

        A read without a query queues -420 and times out. A reply that comes after the timeout stays pending,
        with its delay reduced by the timeout.
        """
        with self._lock:
            self._check_cable()
            if self._flight.rest:
                return self._hand_over(length)
            if self._flight.aborting:
                self._flight.aborting = False
                return b""
            if self._flight.request is None:
                _fail(errno.ETIMEDOUT)
            if not self._flight.reply:
                self._device.report(ErrorCode.QUERY_UNTERMINATED)
                _fail(errno.ETIMEDOUT)
            if self._flight.late_ms > timeout_ms and timeout_ms != NEVER_MS:
                self._flight.late_ms -= timeout_ms
                _fail(errno.ETIMEDOUT)
            self._flight.late_ms = 0.0
            self._flight.rest = self._transfer(*self._flight.request)
            self._flight.request = None
            return self._hand_over(length)

    def control(self, request: int, value: int, length: int) -> bytes:
        """Answer a class request (USBTMC 4.2.1) with at most ``length`` bytes."""
        with self._lock:
            self._check_cable()
            if request not in _REQUESTS:
                _fail(errno.EPIPE)
            return _REQUESTS[request](self, value & BYTE)[:length]

    # Internal functions

    def _take(self, payload: bytes, attributes: int) -> None:
        self._flight.message += payload
        if len(self._flight.message) > LONGEST_MESSAGE:
            self._flight.message = b""
            _fail(errno.EPIPE)
        if attributes & END_OF_MESSAGE:
            message, self._flight.message = self._flight.message, b""
            # An unread earlier reply is lost, with error -410 (IEEE 488.2, 6.3.2.3).
            if self._flight.reply or self._flight.rest:
                self._flight.reply = self._flight.rest = b""
                self._flight.request = None
                self._device.report(ErrorCode.QUERY_INTERRUPTED)
            reply = self._device.execute(message)
            self._flight.reply, self._flight.late_ms = reply.data, 1e3 * reply.delay_s

    def _transfer(self, tag: int, length: int) -> bytes:
        """Return a transfer with the requested part of the reply; the end bit marks the last part."""
        payload, self._flight.reply = self._flight.reply[:length], self._flight.reply[length:]
        attributes = 0 if self._flight.reply else END_OF_MESSAGE
        header = HEADER.pack(MessageId.REQUEST_IN, tag, tag ^ BYTE, len(payload), attributes, 0)
        return header + payload + bytes(-len(payload) % ALIGNMENT)

    def _hand_over(self, length: int) -> bytes:
        transfer, self._flight.rest = self._flight.rest[:length], self._flight.rest[length:]
        return transfer

    def abort_bulk_in(self, tag: int) -> bytes:
        """Abort a transfer for which the host has stopped waiting; the reply stays pending."""
        if self._flight.request is None or self._flight.request[0] != tag:
            return bytes([TRANSFER_NOT_IN_PROGRESS, 0])
        self._flight.request = None
        self._flight.rest = b""
        self._flight.aborting = True
        return bytes([SUCCESS, tag])

    def _check_cable(self) -> None:
        if self._failures:
            _fail(min(self._failures))  # ENODEV, if the cable of a hung instrument is pulled


def _fail(number: int) -> NoReturn:
    raise OSError(number, os.strerror(number))  # for ETIMEDOUT, this is a TimeoutError


_REQUESTS: Mapping[int, Callable[[UsbTmcInstrument, int], bytes]] = {
    3: UsbTmcInstrument.abort_bulk_in,  # INITIATE_ABORT_BULK_IN, 4.2.1.4
    4: lambda *_: bytes([SUCCESS, *bytes(7)]),  # CHECK_ABORT_BULK_IN_STATUS, 4.2.1.5: always complete
    7: lambda *_: _CAPABILITIES,  # GET_CAPABILITIES, 4.2.1.8
}
"""Class requests used by pyvisa (table 15), by number; each gets the tag. All other requests stall."""
