"""Faults on demand: which call fails, from when on, and with which code."""

from dataclasses import dataclass, field

from .errors import DaqmxRefusal

SERVER_GONE = "server gone"


@dataclass(frozen=True)
class Fault:
    """A rule: calls of that name fail with that code.

    Both conditions must hold; by default a fault applies at once and for ever.
    """

    rpc: str
    """Name of the call, ``"ReadAnalogF64"`` for example; ``"*"``: every call."""
    code: int
    """A DAQmx status, -200361 for example (nidaqmx.error_codes.DAQmxErrors)."""
    from_call: int = 1
    """First call that fails, counted from 1 since the rule was given."""
    from_s: float = 0.0
    """Rig time from which on calls fail [s]."""
    calls: float = float("inf")
    """How many calls fail before the fault heals."""


@dataclass(frozen=True)
class ServerGone:
    """A rule: from then on no call is answered (the client sees UNAVAILABLE), as if the computer were off."""

    rpc: str = "*"
    from_call: int = 1
    from_s: float = 0.0


class Unavailable(Exception):
    """The server plays dead."""


@dataclass
class Faults:
    """The rules in force; change them at any time."""

    rules: list[Fault | ServerGone] = field(default_factory=list)
    _seen: dict[int, int] = field(default_factory=dict)
    _restart_is_due: bool = False

    def add(self, rule: Fault | ServerGone) -> None:
        """Put a rule in force; its calls are counted from now on."""
        self._seen[id(rule)] = 0
        self.rules.append(rule)

    def remove(self, rule: Fault | ServerGone) -> None:
        """Heal one rule; nothing happens when it is out of force already."""
        self.rules = [other for other in self.rules if other is not rule]
        self._seen.pop(id(rule), None)
        match rule:
            case ServerGone():
                self._restart_is_due = True

    def take_restart(self) -> bool:
        """Say, once, whether the server has come back from being gone: with none of its tasks."""
        is_due, self._restart_is_due = self._restart_is_due, False
        return is_due

    def clear(self) -> None:
        """Heal everything."""
        self.rules.clear()
        self._seen.clear()

    def check(self, rpc: str, now_s: float) -> None:
        """Fail the call if a rule says so; raises DaqmxRefusal or Unavailable as the rule demands."""
        for rule in tuple(self.rules):
            if rule.rpc not in ("*", rpc) or now_s < rule.from_s:
                continue
            seen = self._seen[id(rule)] = self._seen.get(id(rule), 0) + 1
            if seen >= rule.from_call:
                self._apply(rule, rpc, seen)

    def _apply(self, rule: Fault | ServerGone, rpc: str, seen: int) -> None:
        match rule:
            case ServerGone():
                raise Unavailable(SERVER_GONE)
            case Fault() if seen < rule.from_call + rule.calls:
                reads = 0 if rpc.startswith("Read") else None
                writes = 0 if rpc.startswith("Write") else None
                raise DaqmxRefusal(rule.code, f"Injected into {rpc}.", reads, writes)
            case Fault():
                self.rules.remove(rule)
