"""Errors of the simulated DAQmx driver: code, sentence, and number of transferred samples."""

from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition import InstrumentError

_SENTENCES: dict[int, str] = {
    DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE: (
        "Samples were overwritten in the buffer before they were read, and are lost. Read more often, "
        "read more samples at once, or make the buffer larger."
    ),
    DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE: (
        "Some or all of the samples requested have not yet been acquired. Wait longer, read later, "
        "or check the start trigger and the sample clock."
    ),
    DAQmxErrors.SAMPLES_WILL_NEVER_BE_AVAILABLE: (
        "The samples requested lie past the end of the finite acquisition. Read fewer samples, "
        "acquire more, or acquire continuously."
    ),
    DAQmxErrors.PAL_RESOURCE_RESERVED: (
        "The specified resource is reserved by another task. Stop or clear that task first."
    ),
    DAQmxErrors.INVALID_TASK: "The task does not exist: it was cleared, or never created on this server.",
    DAQmxErrors.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES: (
        "The generation stopped because the next samples were not written in time and regeneration is "
        "not allowed. Write more often, write more at once, or allow regeneration."
    ),
    DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE: (
        "The task was not done when the time to wait ran out. Wait longer, or stop it."
    ),
    DAQmxErrors.SAMPLES_CAN_NOT_YET_BE_WRITTEN: (
        "There was no room in the output buffer before the timeout. Wait longer, or write less at once."
    ),
    DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK: (
        "The operation cannot be performed because the task has no channels. Add one first."
    ),
    DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING: (
        "The operation cannot be performed while the task is running. Stop the task first."
    ),
    DAQmxErrors.RUNTIME_ABORTING_ROUTING: "The operation was aborted because the device was reset.",
    DAQmxErrors.DEV_CANNOT_BE_ACCESSED: (
        "The device cannot be accessed: it is unplugged, switched off, or was removed from the system."
    ),
    DAQmxErrors.INPUT_FIFO_OVERFLOW_2: (
        "The device's own memory overflowed because the host did not fetch the samples in time."
    ),
}


class DaqmxRefusal(InstrumentError):
    """A call that the driver answers with a negative status."""

    def __init__(
        self, code: int, detail: str = "", samples_read: int | None = None, samples_written: int | None = None
    ) -> None:
        """Store the DAQmx ``code``; ``detail`` gives the rejected and the allowed values."""
        super().__init__("\n\n".join(filter(None, (sentence(code), detail, f"Status Code: {int(code)}"))))
        self.code = int(code)
        self.samples_read = samples_read
        self.samples_written = samples_written


def sentence(code: int) -> str:
    """Return the meaning of a status code: a sentence for frequent codes, NI's name for others."""
    if code in _SENTENCES:
        return _SENTENCES[code]
    try:
        name = str(DAQmxErrors(code).name)
    except ValueError:
        return ""
    return name.replace("_", " ").capitalize() + "."


Member = TypeVar("Member", bound=Enum)


def member(kind: type[Member], code: int, property_name: str) -> Member:
    """Return the member of an NI enum for a number in a request; unknown ones are refused (-200077)."""
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


SERVER_GONE = "server gone"


@dataclass(frozen=True)
class Fault:
    """A rule that makes calls with a name fail with a code.

    Both conditions must be met; by default a fault starts at once and lasts for ever.
    """

    rpc: str
    """Name of the call, such as ``"ReadAnalogF64"``; ``"*"`` for every call."""
    code: int
    """A DAQmx status, such as -200361 (nidaqmx.error_codes.DAQmxErrors)."""
    from_call: int = 1
    """First failing call, counted from 1 after the rule was added."""
    from_s: float = 0.0
    """Rig time from which calls fail [s]."""
    calls: float = float("inf")
    """Number of failing calls."""


@dataclass(frozen=True)
class ServerGone:
    """A rule that leaves all calls unanswered (the client sees UNAVAILABLE), as if the computer were off."""

    rpc: str = "*"
    from_call: int = 1
    from_s: float = 0.0


class Unavailable(Exception):
    """The server does not answer."""


@dataclass
class Faults:
    """The active rules; they can be changed at any time."""

    rules: list[Fault | ServerGone] = field(default_factory=list)
    _seen: dict[int, int] = field(default_factory=dict)
    _restart_is_due: bool = False

    def add(self, rule: Fault | ServerGone) -> None:
        """Add a rule and start counting its calls."""
        self._seen[id(rule)] = 0
        self.rules.append(rule)

    def remove(self, rule: Fault | ServerGone) -> None:
        """Remove a rule; a rule that is not active is ignored."""
        self.rules = [other for other in self.rules if other is not rule]
        self._seen.pop(id(rule), None)
        match rule:
            case ServerGone():
                self._restart_is_due = True

    def take_restart(self) -> bool:
        """Return once whether the server has restarted, without its tasks."""
        is_due, self._restart_is_due = self._restart_is_due, False
        return is_due

    def clear(self) -> None:
        """Remove all rules."""
        self.rules.clear()
        self._seen.clear()

    def check(self, rpc: str, now_s: float) -> None:
        """Raise DaqmxRefusal or Unavailable if a rule applies to the call."""
        for rule in tuple(self.rules):
            if rule.rpc not in ("*", rpc) or now_s < rule.from_s:
                continue
            seen = self._seen[id(rule)] = self._seen.get(id(rule), 0) + 1
            if seen >= rule.from_call:
                match rule:
                    case ServerGone():
                        raise Unavailable(SERVER_GONE)
                    case Fault() if seen < rule.from_call + rule.calls:
                        reads = 0 if rpc.startswith("Read") else None
                        writes = 0 if rpc.startswith("Write") else None
                        raise DaqmxRefusal(rule.code, f"Injected into {rpc}.", reads, writes)
                    case Fault():
                        self.rules.remove(rule)
