"""Faults of the virtual rig, on demand or at the rig times of a script, to rehearse a long campaign.

::

    [[faults]]
    at_s = 120
    fault = "pull_usb_cable"
    for_s = 5
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from inspect import signature
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from nidaqmx.error_codes import DAQmxErrors
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, create_model

from vibench.acquisition import file_path, load_toml
from vibench.acquisition.recording import DiskTrouble
from vibench.sim import FrozenModel

from ..daqmx.data_calls import DATA_CALLS
from ..daqmx.server import DaqServer
from ..generator.afg1022 import AFG1022
from ..usb.usbtmc import UsbTmcInstrument
from ..world.world import World

Heal = Callable[[], None]
"""Function that ends one fault of the rig."""
# Calls at which a program first accesses the device: setting a task's clock, and starting the task.
_RESERVING = ("CfgSampClkTiming", "StartTask")
_READS = tuple(call for call in DATA_CALLS if call.startswith("Read"))


@dataclass(frozen=True)
class PlayedFault:
    """A fault of a script that has started."""

    fault: str
    began_s: float


def nothing_to_heal() -> None:
    """Do nothing, because the fault ends by itself."""


class RigFaults:
    """Faults of a running virtual rig: each method starts a fault and returns a function to end it.

    A scripted fault has the name and parameters of its method. The class is thread-safe.
    """

    def __init__(
        self, world: World, generator: AFG1022, cable: UsbTmcInstrument, daq: DaqServer, disk: DiskTrouble
    ) -> None:
        self._world = world
        self._generator = generator
        self._cable = cable
        self._daq = daq
        self._disk = disk
        self._heals: list[Heal] = []
        self.played: list[PlayedFault] = []
        """Faults of scripts that have started so far."""

    def play(self, script: "FaultScript") -> None:
        """Schedule every fault of a script at its rig time."""
        for fault in script.faults:
            self._world.at(fault.at_s, partial(self._start, fault))

    def _start(self, fault: "ScriptedFault") -> None:
        heal = fault.begin(self)
        self.played.append(PlayedFault(fault.fault, self._world.time_s))
        if fault.for_s is not None:
            self._world.at(fault.at_s + fault.for_s, heal)

    def heal(self) -> None:
        """End every fault that has not ended."""
        while self._heals:
            self._heals.pop()()

    def _until(self, heal: Heal) -> Heal:
        self._heals.append(heal)
        return heal

    def pull_usb_cable(self) -> Heal:
        """Disconnect the generator: every transfer fails, and its output continues."""
        self._cable.pull_cable()
        return self._until(self._cable.plug_cable)

    def hang_generator(self) -> Heal:
        """Make the generator stop answering; its output continues."""
        self._cable.hang()
        return self._until(self._cable.wake)

    def jump_clock(self, by_s: float) -> Heal:
        """Shift the generator's clock (forwards if positive) [s], and thus the phase of the output."""
        self._generator.jump_clock(by_s)
        return nothing_to_heal

    def delay_reply(self, delay_s: PositiveFloat) -> Heal:
        """Delay the generator's next reply."""
        self._generator.delay_next_reply(delay_s)
        return nothing_to_heal

    def corrupt_reply(self) -> Heal:
        """Corrupt the generator's next reply."""
        self._generator.corrupt_next_reply()
        return nothing_to_heal

    def stick_output(self) -> Heal:
        """Weld the generator's output relay: the output stays on although the generator reports off."""
        self._generator.stick_output_relay(is_stuck=True)
        return self._until(lambda: self._generator.stick_output_relay(is_stuck=False))

    def turn_amplifier_gain(self, gain_db: Annotated[float, Field(ge=-60, le=60)]) -> Heal:
        """Set the amplifier's gain to a value other than the configured gain."""
        self._world.set_amplifier_gain_db(gain_db)
        return self._until(lambda: self._world.set_amplifier_gain_db(self._world.configured_gain_db))

    def widen_gaps(self, by_m: Annotated[float, Field(ge=-1e-4, le=1e-3)]) -> Heal:
        """Move the specimen's stops away from m1, or closer to m1 [m], as a loose screw or wear would."""
        self._world.widen_gaps(by_m)
        return self._until(lambda: self._world.widen_gaps(0.0))

    def drop_laser(self, for_s: PositiveFloat) -> Heal:
        """Set the output of the m0 sensor to zero for a while, as a vibrometer without light does."""
        self._world.disturb_response(for_s, level=0.0)
        return nothing_to_heal

    def over_range(self, for_s: PositiveFloat) -> Heal:
        """Hold the sensor of m0 at full scale for a while."""
        self._world.disturb_response(for_s, level=1.0)
        return nothing_to_heal

    def disconnect(self, channel: str) -> Heal:
        """Disconnect an input of the converter, such as ``"cDAQ1Mod1/ai2"``."""
        self._world.disconnect(channel)
        return self._until(lambda: self._world.connect(channel))

    def reverse(self, channel: str) -> Heal:
        """Swap the two wires of an input of the converter."""
        self._world.reverse(channel)
        return self._until(lambda: self._world.connect(channel))

    def overrun(self) -> Heal:
        """Make reads fail as if samples in the buffer had been overwritten before they were read."""
        code = DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE.value
        return self._until(self._daq.faults.add(code, *_READS))

    def reserve_device(self) -> Heal:
        """Reserve the converter for another program: running tasks continue, new tasks are refused."""
        code = DAQmxErrors.PAL_RESOURCE_RESERVED.value
        return self._until(self._daq.faults.add(code, *_RESERVING))

    def fail_daq(self, call: str, code: int) -> Heal:
        """Make a DAQmx call fail with a code (``nidaqmx.error_codes``).

        If a call that reads samples fails, all calls that read samples fail: a driver may use any of them.
        """
        calls = _READS if call in _READS else (call,)
        return self._until(self._daq.faults.add(code, *calls))

    def lose_daq_server(self) -> Heal:
        """Stop the DAQ server from answering."""
        return self._until(self._daq.faults.add(None))

    def fill_disk(self, refusals: PositiveInt | None = None) -> Heal:
        """Make writes of recordings fail as on a full disk: ``refusals`` times, or until the fault ends."""
        return self._until(self._disk.fill() if refusals is None else self._disk.fill(refusals))

    def slow_disk(self, delay_s: PositiveFloat) -> Heal:
        """Delay every write of recordings of this process, in wall-clock time [s]."""
        return self._until(self._disk.slow_down(delay_s))


class ScriptedFault(FrozenModel):
    """Start and duration of a fault, and parameters of the method of `RigFaults` that ``fault`` names."""

    at_s: NonNegativeFloat
    """Start of the fault in rig time since switch-on [s]."""
    for_s: PositiveFloat | None = None
    """Duration in rig time [s]; if absent, the fault is permanent or ends by itself."""
    fault: str

    def begin(self, rig: RigFaults) -> Heal:
        """Start the fault; return the function that ends it."""
        start = getattr(rig, self.fault)
        heal: Heal = start(**{name: getattr(self, name) for name in signature(start).parameters})
        return heal


def _script_model(fault: Callable[..., Heal]) -> type[ScriptedFault]:
    """Return the model of a scripted fault; its keys are the parameters of the fault's method."""
    keys = {
        name: (each.annotation, ... if each.default is each.empty else each.default)
        for name, each in signature(fault).parameters.items()
        if name != "self"
    }
    name = fault.__name__
    model: type[ScriptedFault] = create_model(  # type: ignore[call-overload]
        name, __base__=ScriptedFault, __doc__=fault.__doc__, fault=(Literal[name], ...), **keys
    )
    return model


DISK_FAULTS = frozenset({"fill_disk", "slow_disk"})
"""Faults that affect the recording program instead of the rig."""

_SCRIPTED = [
    method
    for name, method in vars(RigFaults).items()
    if not name.startswith("_") and signature(method).return_annotation is Heal
]
if TYPE_CHECKING:
    FaultKind = ScriptedFault
else:
    FaultKind = Annotated[reduce(or_, map(_script_model, _SCRIPTED)), Field(discriminator="fault")]


class FaultScript(FrozenModel):
    """Faults with their start times, in any order."""

    faults: tuple[FaultKind, ...] = ()


def load_fault_script(path: Path | str) -> FaultScript:
    """Return the faults of a TOML file, or of a shipped script by its name (``"night"``).

    Raises ConfigurationError with file, key, given value and allowed values.
    """
    return load_toml(file_path(path, "hardware_configs/faults"), FaultScript)
