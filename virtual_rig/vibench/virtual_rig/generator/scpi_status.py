"""What a SCPI instrument remembers of its troubles: error queue and event register."""

from collections import deque
from enum import IntEnum, IntFlag

QUEUE_LENGTH = 20
"""Errors kept before the last one becomes "Queue overflow" (the depth is assumed, SCPI asks for >= 2)."""


class ErrorCode(IntEnum):
    """SCPI-1999 error numbers (volume 2, chapter 21.8) that the instrument uses."""

    NO_ERROR = 0
    SYNTAX_ERROR = -102
    DATA_TYPE_ERROR = -104
    PARAMETER_NOT_ALLOWED = -108
    MISSING_PARAMETER = -109
    UNDEFINED_HEADER = -113
    HEADER_SUFFIX_OUT_OF_RANGE = -114
    EXPONENT_TOO_LARGE = -123
    INVALID_SUFFIX = -131
    INVALID_BLOCK_DATA = -161
    SETTINGS_CONFLICT = -221
    DATA_OUT_OF_RANGE = -222
    ILLEGAL_PARAMETER_VALUE = -224
    OUT_OF_MEMORY = -225
    HARDWARE_MISSING = -241
    QUEUE_OVERFLOW = -350
    QUERY_INTERRUPTED = -410
    QUERY_UNTERMINATED = -420
    QUERY_DEADLOCKED = -430

    @property
    def text(self) -> str:
        """The words that SYST:ERR? sends with the number."""
        words = self.name.replace("_", " ").capitalize()
        kind, _, problem = words.partition(" ")
        return f"{kind} {problem.upper()}" if kind == "Query" else words


class ScpiError(Exception):
    """A command was refused; carries the number that goes into the error queue."""

    def __init__(self, code: ErrorCode) -> None:
        super().__init__(f'{int(code)},"{code.text}"')
        self.code = code


class Event(IntFlag):
    """Bits of the standard event status register (IEEE 488.2-1992, 11.5.1)."""

    NONE = 0
    OPERATION_COMPLETE = 1
    QUERY_ERROR = 4
    DEVICE_ERROR = 8
    EXECUTION_ERROR = 16
    COMMAND_ERROR = 32
    POWER_ON = 128


_EVENT_OF_HUNDRED = {
    1: Event.COMMAND_ERROR,
    2: Event.EXECUTION_ERROR,
    3: Event.DEVICE_ERROR,
    4: Event.QUERY_ERROR,
}
BYTE = 255


class Status:
    """Error queue and registers of one instrument."""

    def __init__(self) -> None:
        self._errors: deque[ErrorCode] = deque()
        self._events = Event.POWER_ON

    def report(self, code: ErrorCode) -> None:
        """Queue an error and set its bit in the event register."""
        self._events |= _EVENT_OF_HUNDRED[-int(code) // 100]
        if len(self._errors) < QUEUE_LENGTH:
            self._errors.append(code)
        else:
            self._errors[-1] = ErrorCode.QUEUE_OVERFLOW

    def next_error(self) -> ErrorCode:
        """Take the oldest error from the queue; NO_ERROR when it is empty."""
        return self._errors.popleft() if self._errors else ErrorCode.NO_ERROR

    def take_events(self) -> Event:
        """Read the event register, which clears it."""
        events, self._events = self._events, Event.NONE
        return events

    def operation_complete(self) -> None:
        """Note that everything asked for is done (``*OPC``)."""
        self._events |= Event.OPERATION_COMPLETE

    def clear(self) -> None:
        """Empty queue and event register (``*CLS``)."""
        self._errors.clear()
        self._events = Event.NONE
