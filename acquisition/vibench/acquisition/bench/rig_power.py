"""The instruments of a rig, held for this process while benches on it are opened and closed."""

from collections.abc import Sequence
from contextlib import ExitStack, closing
from threading import Event as Alarm
from types import TracebackType
from typing import Self

from ..rig import Rig
from .lock import BenchLock
from .simulated_rig import PlayedFault, SimulatedRig, simulated_rig


class RigPower:
    """Holds the instruments of a rig, in a ``with``: a virtual one is switched on and off, a real one locked.

    A virtual rig lives in rig time: what happens to it, a script of faults for example, goes on while
    a bench on it is closed and opened again, because it stays the same rig.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._virtual: SimulatedRig | None = None
        self._closing = ExitStack()

    @property
    def connected(self) -> Rig:
        """The rig with the addresses at which its instruments answer now."""
        if self._virtual is None:
            return self.rig
        rig, virtual = self.rig, self._virtual
        controller = rig.controller and rig.controller.model_copy(
            update={"resource": virtual.controller_resource}
        )
        return rig.model_copy(
            update={
                "controller": controller,
                "daq": rig.daq.model_copy(update={"server": virtual.daq_address}),
                "generator": rig.generator.model_copy(update={"resource": virtual.visa_resource}),
            }
        )

    @property
    def played_faults(self) -> Sequence[PlayedFault]:
        """What a script has done to the rig so far."""
        return () if self._virtual is None else self._virtual.played_faults

    def let_pass(self, duration_s: float) -> None:
        """Let rig time pass on a virtual rig that is not sampled; on every other it passes by itself."""
        if self._virtual is not None:
            self._virtual.let_pass(duration_s)

    def idle(self, duration_s: float) -> None:
        """Wait while nothing is sampled: by the clock, or in rig time on a virtual rig at its own pace."""
        if self._virtual is not None and self.rig.virtual is not None and self.rig.virtual.pace == "free":
            self._virtual.let_pass(duration_s)
        else:
            Alarm().wait(duration_s)

    def __enter__(self) -> Self:
        if self.rig.virtual is not None:
            self._virtual = self._closing.enter_context(simulated_rig(self.rig))
        else:
            self._closing.enter_context(closing(BenchLock.of(self.rig)))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._virtual = None
        self._closing.close()
