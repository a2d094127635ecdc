"""Errors of the simulated DAQmx driver: code, explanation, and number of transferred samples."""

from collections.abc import Callable
from enum import Enum
from typing import TypeVar

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import InstrumentError


class DaqmxRefusal(InstrumentError):
    """Error: the driver answers a call with a negative status."""

    def __init__(
        self, code: int, detail: str = "", samples_read: int | None = None, samples_written: int | None = None
    ) -> None:
        """Store the DAQmx ``code``; ``detail`` is text on the rejected and the allowed values."""
        super().__init__("\n\n".join(filter(None, (sentence(code), detail, f"Status Code: {int(code)}"))))
        self.code = int(code)
        self.samples_read = samples_read
        self.samples_written = samples_written


def sentence(code: int) -> str:
    """Return NI's name of a status code as a sentence; empty for an unknown code."""
    try:
        name = str(DAQmxErrors(code).name)
    except ValueError:
        return ""
    return name.replace("_", " ").capitalize() + "."


Member = TypeVar("Member", bound=Enum)


def member(kind: type[Member], code: int, property_name: str) -> Member:
    """Return the member of an NI enum for a number in a request; unknown numbers are refused (-200077)."""
    try:
        return kind(code)
    except ValueError:
        allowed = ", ".join(each.name for each in kind)
        raise unsupported_value(property_name, code, allowed) from None


def unsupported_value(property_name: str, requested: object, allowed: str) -> DaqmxRefusal:
    """Return the error for a property value that is not supported (-200077)."""
    return DaqmxRefusal(
        DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
        f"Property: {property_name}\nRequested Value: {requested}\nPossible Values: {allowed}",
    )


class Unavailable(Exception):
    """The server does not answer this call."""


class Faults:
    """The present faults, which can be changed at any time."""

    def __init__(self) -> None:
        self._in_force: tuple[tuple[int | None, tuple[str, ...]], ...] = ()
        self._restart_is_due = False

    def add(self, code: int | None, *calls: str) -> Callable[[], None]:
        """Make all calls of these names fail with a DAQmx code; return the function that ends the fault.

        With None, no call at all is answered, as if the computer were off, and all tasks are lost afterwards.
        """
        fault = (code, calls)
        self._in_force += (fault,)

        def end() -> None:
            others = tuple(other for other in self._in_force if other is not fault)
            self._restart_is_due |= code is None and others != self._in_force
            self._in_force = others

        return end

    def take_restart(self) -> bool:
        """Return whether the server has restarted since the last call, and thus lost its tasks."""
        is_due, self._restart_is_due = self._restart_is_due, False
        return is_due

    def check(self, call: str) -> None:
        """Raise DaqmxRefusal or Unavailable if a fault applies to the call."""
        for code, calls in self._in_force:
            if code is None:
                raise Unavailable("server gone")
            if call in calls:
                reads = 0 if call.startswith("Read") else None
                writes = 0 if call.startswith("Write") else None
                raise DaqmxRefusal(code, f"Injected into {call}.", reads, writes)
