"""A script of faults by rig time, so that a whole night can be rehearsed in minutes.

::

    [[faults]]
    at_s = 120
    fault = "pull_usb_cable"
    for_s = 5
"""

from dataclasses import dataclass, field
from pathlib import Path

from vibench.acquisition import FrozenModel, load_toml

from ..world import World
from ._fault_kinds import FaultKind
from ._faults import RigFaults


class FaultScript(FrozenModel):
    """What goes wrong, and when; in any order."""

    faults: tuple[FaultKind, ...] = ()


def load_fault_script(path: Path) -> FaultScript:
    """Read a script; raises ConfigurationError with file, key and what is allowed."""
    return load_toml(path, FaultScript)


@dataclass(frozen=True)
class PlayedFault:
    """One fault that has begun."""

    fault: str
    began_s: float
    """Rig time [s]."""


@dataclass
class FaultPlay:
    """A script being played on a rig: each fault at its rig time, whatever advances it."""

    world: World
    rig: RigFaults
    played: list[PlayedFault] = field(default_factory=list)

    def begin(self, script: FaultScript) -> None:
        """Make an appointment for every fault of the script."""
        for fault in script.faults:
            self.world.at(fault.at_s, lambda fault=fault: self._befall(fault))  # type: ignore[misc]

    def _befall(self, fault: FaultKind) -> None:
        heal = fault.begin(self.rig)
        self.played.append(PlayedFault(fault.fault, self.world.time_s))
        if fault.for_s is not None:
            self.world.at(fault.at_s + fault.for_s, heal)
