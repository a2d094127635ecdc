"""Simulated instruments: what a bench needs of them, and the one place that loads them."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from importlib import import_module
from typing import Protocol, cast

from ..rig import Rig


class PlayedFault(Protocol):
    """One fault of a script that has begun."""

    @property
    def fault(self) -> str:
        """Name of its kind."""


class SimulatedRig(Protocol):
    """Instruments that answer from entering to leaving the ``with`` that gave them."""

    @property
    def daq_address(self) -> str:
        """``"host:port"`` of the DAQ server."""

    @property
    def visa_resource(self) -> str:
        """VISA name of the generator."""

    @property
    def controller_resource(self) -> str:
        """VISA name of the real-time controller; empty without one."""

    @property
    def played_faults(self) -> Sequence[PlayedFault]:
        """What a script has done to the rig so far."""

    def let_pass(self, duration_s: float) -> None:
        """Let rig time pass while nothing is sampled."""


def simulated_rig(rig: Rig) -> AbstractContextManager[SimulatedRig]:
    """Load the virtual rig by name: a real bench must not load the simulation, nor depend on it."""
    virtual_rig = import_module("vibench.virtual_rig")
    return cast("AbstractContextManager[SimulatedRig]", virtual_rig.VirtualRig(rig))
