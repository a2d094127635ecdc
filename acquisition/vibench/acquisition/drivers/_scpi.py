"""One SCPI port for all drivers: no complaint of an instrument is lost, and no loss goes unnamed."""

import re
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import pyvisa
from numpy.typing import NDArray

from ..errors import InstrumentError, InstrumentLost
from ..host import LOG
from ._visa_link import Link

Codes = NDArray[np.uint16]

NO_ERROR = 0
# An error queue holds some tens of entries; more replies than this mean that it is not being emptied.
_LONGEST_QUEUE = 64
# Long enough for a stale reply that is already under way, short enough for an emergency stop [ms].
_STALE_REPLY_MS = 100.0
_QUIET = frozenset({pyvisa.constants.StatusCode.error_timeout})
# pyvisa-py lets the ValueError and OSError of PyUSB through when the device is gone.
_LOST = (ValueError, OSError, pyvisa.errors.InvalidSession)
_QUEUE_ENTRY = re.compile(r'([+-]?\d+)\s*,\s*"?([^"]*)"?')
_LEADING_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")


@dataclass(frozen=True)
class Complaint:
    """One entry of an instrument's error queue."""

    code: int
    text: str

    def __str__(self) -> str:
        return f"{self.text} ({self.code})"


class ScpiPort:
    """Commands and queries over one VISA session.

    A command is followed by reading the error queue until it is empty, which also waits until the
    instrument has done the command. A dialogue that was broken off (Ctrl-C between question and
    answer) is cleaned up before the next one, so that no answer is taken for another question's.

    Parameters
    ----------
    link
        An open VISA session.
    name
        What to call the instrument in errors.
    settle_s
        Pause that the instrument needs after each command [s]; after a question its answer is the sign.

    """

    def __init__(
        self, link: Link, name: str, settle_s: float = 0.0, pause: Callable[[float], None] = time.sleep
    ) -> None:
        self._link = link
        self._name = name
        self._settle_s = settle_s
        self._pause = pause
        self._reply_due = False
        self._lock = threading.RLock()

    def command(self, message: str) -> None:
        """Send a command; raises InstrumentError when the instrument queues any complaint about it."""
        self._refuse(message, self.send(message))

    def send(self, message: str) -> tuple[Complaint, ...]:
        """Send a command and return the complaints that are then in the queue, older ones among them."""
        with self._lock:
            self._write(message)
            return tuple(self._drain())

    def query(self, message: str) -> str:
        """Ask, and return the answer without its line end; bytes outside ASCII are kept readable."""
        with self._lock:
            return _decoded(self._ask(message))

    def query_patiently(self, message: str) -> str:
        """Ask, and once more when the answer is empty, as the first one after ``*CLS`` may be."""
        return self.query(message) or self.query(message)

    def complaints(self) -> tuple[Complaint, ...]:
        """Empty the error queue and return what was in it."""
        with self._lock:
            return tuple(self._drain())

    def write_codes(self, message: str, codes: Codes) -> None:
        """Send ``message`` followed by 16-bit codes as a big-endian binary block."""
        payload = codes.astype(">u2").tobytes()
        length = str(len(payload))
        block = f"{message}#{len(length)}{length}".encode("ascii") + payload + b"\n"
        shown = f"{message}<{codes.size} points>"
        with self._lock:
            self._resynchronise()
            with self._dialogue(shown):
                self._link.write_raw(block)
                self._settle()
            self._refuse(shown, tuple(self._drain()))

    def query_codes(self, message: str) -> Codes:
        """Ask for a big-endian binary block of 16-bit codes."""
        with self._lock:
            reply = self._ask(message)
        return _block_codes(reply, f"{self._name}: {message}")

    def close(self) -> None:
        """Give the session back. Legal at any time: a session that is gone is not missed."""
        with self._lock, self._dialogue("closing the session"):
            self._link.close()

    def _write(self, message: str) -> None:
        self._resynchronise()
        with self._dialogue(message):
            self._link.write(message)
            self._settle()

    def _ask(self, message: str) -> bytes:
        self._resynchronise()
        with self._dialogue(message):
            self._reply_due = True
            self._link.write(message)
            reply = self._link.read_raw()
            self._reply_due = False
        LOG.debug("%s answers %r", self._name, reply)
        return reply

    def _settle(self) -> None:
        # Some firmware drops messages that come too soon after a command, and has no flag to wait for.
        if self._settle_s > 0:
            self._pause(self._settle_s)

    def _refuse(self, message: str, found: tuple[Complaint, ...]) -> None:
        if found:
            told = "; ".join(str(complaint) for complaint in found)
            raise InstrumentError(
                f"{self._name} refused {message!r}: {told}. The setting is not in force; "
                "correct the value, or check that this firmware knows the command"
            )

    def _drain(self) -> Iterator[Complaint]:
        for _ in range(_LONGEST_QUEUE):
            reply = self.query_patiently("SYST:ERR?")
            entry = _QUEUE_ENTRY.fullmatch(reply)
            if entry is None:
                raise InstrumentError(
                    f"{self._name} answered SYST:ERR? with {reply!r}, which is no entry of an error queue; "
                    "check the cable, and try again"
                )
            if int(entry[1]) == NO_ERROR:
                return
            yield Complaint(int(entry[1]), entry[2])
        raise InstrumentError(
            f"{self._name} reports errors without end ({_LONGEST_QUEUE} read); "
            "switch it off and on, and open the bench again"
        )

    def _resynchronise(self) -> None:
        """Read away the answer to a question that was broken off."""
        if not self._reply_due:
            return
        self._reply_due = False
        doing = "resuming the dialogue"
        try:
            usual_ms = self._link.timeout
            self._link.timeout = _STALE_REPLY_MS
            try:
                self._link.read_raw()
            finally:
                self._link.timeout = usual_ms
        except pyvisa.VisaIOError as error:
            if error.error_code not in _QUIET:
                raise InstrumentLost(self._gone(doing, error)) from error
        except _LOST as error:
            raise InstrumentLost(self._gone(doing, error)) from error

    @contextmanager
    def _dialogue(self, doing: str) -> Iterator[None]:
        LOG.debug("%s: %s", self._name, doing)
        try:
            yield
        except pyvisa.VisaIOError as error:
            if error.error_code in _QUIET:
                raise InstrumentError(
                    f"{self._name} did not answer {doing!r} within {self._link.timeout / 1000:g} s; "
                    "what it does now is unknown. Check that it is not busy or on a menu, and try again"
                ) from error
            raise InstrumentLost(self._gone(doing, error)) from error
        except _LOST as error:
            raise InstrumentLost(self._gone(doing, error)) from error

    def _gone(self, doing: str, error: Exception) -> str:
        return (
            f"{self._name} is gone: {doing!r} failed ({error}). Its output state is unknown; "
            "check its cable and power, then open the bench again"
        )


def number_in(reply: str, asked: str) -> float:
    """Return the number at the start of a reply; raises InstrumentError when there is none."""
    found = _LEADING_NUMBER.match(reply)
    if found is None:
        raise InstrumentError(f"{asked} was answered {reply!r}, which is not a number; try again")
    return float(found.group(1))


def _decoded(reply: bytes) -> str:
    # This family marks ohms with the GBK character A6 B8: anything that is not text must not stop a query.
    return reply.decode("gb18030", errors="replace").strip()


def _block_codes(reply: bytes, asked: str) -> Codes:
    start = reply.find(b"#")
    digits = int(reply[start + 1 : start + 2]) if reply[start + 1 : start + 2].isdigit() else 0
    length_text = reply[start + 2 : start + 2 + digits]
    if start < 0 or digits == 0 or not length_text.isdigit():
        raise InstrumentError(f"{asked} was answered without a binary block ({reply[:20]!r}); try again")
    length = int(length_text)
    payload = reply[start + 2 + digits : start + 2 + digits + length]
    if len(payload) != length or length % 2:
        raise InstrumentError(
            f"{asked} announced {length} bytes and sent {len(payload)}; "
            "an even number, complete, is needed. Upload again"
        )
    return np.frombuffer(payload, dtype=">u2").astype(np.uint16)
