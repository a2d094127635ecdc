"""Errors of the simulated DAQmx driver: code, explanation, and number of transferred samples."""

from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import InstrumentError


class DaqmxRefusal(InstrumentError):
    """A call that the driver answers with a negative status."""

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


@dataclass(frozen=True, eq=False)
class Fault:
    """A rule by which all calls of one name fail with a code."""

    rpc: str
    """Name of the call, such as ``"ReadAnalogF64"``."""
    code: int
    """A DAQmx status, such as -200361 (nidaqmx.error_codes.DAQmxErrors)."""


@dataclass(frozen=True, eq=False)
class ServerGone:
    """A rule that leaves all calls unanswered (the client sees UNAVAILABLE), as if the computer were off."""


class Unavailable(Exception):
    """The server does not answer this call."""


class Faults:
    """The active rules on failing calls; they can be changed at any time."""

    def __init__(self) -> None:
        self._rules: tuple[Fault | ServerGone, ...] = ()
        self._restart_is_due = False

    def add(self, rule: Fault | ServerGone) -> None:
        """Add a rule to the active rules."""
        self._rules += (rule,)

    def remove(self, rule: Fault | ServerGone) -> None:
        """Remove a rule. If the server answers again as a result, it has lost its tasks."""
        self._restart_is_due |= rule in self._rules and isinstance(rule, ServerGone)
        self._rules = tuple(other for other in self._rules if other is not rule)

    def take_restart(self) -> bool:
        """Return whether the server has restarted, and so lost its tasks, since the last call."""
        is_due, self._restart_is_due = self._restart_is_due, False
        return is_due

    def check(self, rpc: str) -> None:
        """Raise DaqmxRefusal or Unavailable if a rule applies to the call."""
        for rule in self._rules:
            match rule:
                case ServerGone():
                    raise Unavailable("server gone")
                case Fault() if rule.rpc == rpc:
                    reads = 0 if rpc.startswith("Read") else None
                    writes = 0 if rpc.startswith("Write") else None
                    raise DaqmxRefusal(rule.code, f"Injected into {rpc}.", reads, writes)
