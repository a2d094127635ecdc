"""What a run needs of a bench: open instruments, and who they are."""

from collections.abc import Mapping
from typing import Protocol

from ..instruments import AnalogOutput, Digitizer, FunctionGenerator, Identity, RealTimeController
from ..rig import Channel, KnobSheet, Rig
from .result import CheckResult


class RunBench(Protocol):
    """The open instruments of a rig, as `vibench.acquisition.bench.open_bench` gives them."""

    @property
    def rig(self) -> Rig:
        """The configuration that the bench was opened from."""

    @property
    def generator(self) -> FunctionGenerator:
        """What plays sines and waveforms."""

    @property
    def output(self) -> AnalogOutput | None:
        """What plays signals that never repeat; None where the rig has no analogue output."""

    @property
    def controller(self) -> RealTimeController | None:
        """What closes a fast loop; None where the rig has no such controller."""

    @property
    def digitizer(self) -> Digitizer:
        """What samples."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What is recorded, in the order of the rows of a block."""

    @property
    def identities(self) -> Mapping[str, Identity]:
        """Who answered, by the instrument's part in the bench."""

    @property
    def confirmations(self) -> KnobSheet:
        """What the operator confirmed by hand."""

    def idle(self, duration_s: float) -> None:
        """Wait while nothing is sampled [s], in the rig's own time."""

    @property
    def last_check(self) -> CheckResult | None:
        """The check that the bench was admitted on; None when it was waived and there was none."""
