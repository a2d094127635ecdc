"""Faults of the virtual rig, on demand or at the rig times of a script, to rehearse a long campaign.

::

    [[faults]]
    at_s = 120
    fault = "pull_usb_cable"
    for_s = 5
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from nidaqmx.error_codes import DAQmxErrors
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from vibench.acquisition import load_toml, named
from vibench.acquisition.recording import DiskTrouble
from vibench.sim import FrozenModel

from ..daqmx.errors import Fault, ServerGone
from ..daqmx.server import DaqServer
from ..generator.afg1022 import AFG1022
from ..usb.usbtmc import UsbTmcInstrument
from ..world.world import World

DROPOUT_LEVEL = 0.0
OVER_RANGE_LEVEL = 1.0
Heal = Callable[[], None]
"""Function that ends one fault."""
# Calls at which a program first accesses the device: setting a task's clock, and starting the task.
_RESERVING = ("CfgSampClkTiming", "StartTask")
_READS = ("ReadAnalogF64", "ReadBinaryI32", "ReadRaw")


@dataclass(frozen=True)
class PlayedFault:
    """A fault that has started."""

    fault: str
    began_s: float


def nothing_to_heal() -> None:
    """Do nothing, because the fault ends by itself."""


class RigFaults:
    """Faults of a running virtual rig: each method starts a fault and returns a function to end it.

    The methods have the names and parameters of scripted faults. Thread-safe.
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
        """Faults of scripts that have started."""

    def play(self, script: "FaultScript") -> None:
        """Schedule every fault of a script at its rig time."""
        for fault in script.faults:
            self._world.at(fault.at_s, partial(self._start, fault))

    def _start(self, fault: "FaultKind") -> None:
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
        """Make the generator unresponsive; its output continues."""
        self._cable.hang()
        return self._until(self._cable.wake)

    def jump_clock(self, by_s: float) -> Heal:
        """Shift the generator's clock [s], and thus the phase of its output."""
        self._generator.jump_clock(by_s)
        return nothing_to_heal

    def delay_reply(self, delay_s: float) -> Heal:
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

    def turn_amplifier_gain(self, gain_db: float) -> Heal:
        """Set the amplifier's gain to a value other than the configured one."""
        self._world.set_amplifier_gain_db(gain_db)
        return self._until(self._world.restore_amplifier_gain)

    def widen_gaps(self, by_m: float) -> Heal:
        """Move the specimen's stops away from m1, or closer [m], as by a loose screw or wear."""
        self._world.widen_gaps(by_m)
        return self._until(lambda: self._world.widen_gaps(0.0))

    def drop_laser(self, for_s: float) -> Heal:
        """Set the output of the m0 sensor to zero for a while, like a vibrometer without light."""
        self._world.disturb_response(for_s, DROPOUT_LEVEL)
        return nothing_to_heal

    def over_range(self, for_s: float) -> Heal:
        """Hold the sensor of m0 at full scale for a while."""
        self._world.disturb_response(for_s, OVER_RANGE_LEVEL)
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
        """Make reads fail as if the converter's buffer had been overwritten before it was read."""
        code = DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE.value
        return self._in_force(*(Fault(call, code) for call in _READS))

    def reserve_device(self) -> Heal:
        """Reserve the converter for another program: running tasks continue, new tasks are refused."""
        code = DAQmxErrors.PAL_RESOURCE_RESERVED.value
        return self._in_force(*(Fault(call, code) for call in _RESERVING))

    def fail_daq(self, call: str, code: int) -> Heal:
        """Make a DAQmx call fail with a code (``nidaqmx.error_codes``).

        A fault of one call that reads samples applies to all such calls, because a driver may use any one.
        """
        calls = _READS if call in _READS else (call,)
        return self._in_force(*(Fault(each, code) for each in calls))

    def lose_daq_server(self) -> Heal:
        """Stop the DAQ server from answering."""
        return self._in_force(ServerGone())

    def fill_disk(self, refusals: int | None = None) -> Heal:
        """Make writes of recordings fail as on a full disk, ``refusals`` times or until the fault ends."""
        return self._until(self._disk.fill() if refusals is None else self._disk.fill(refusals))

    def slow_disk(self, delay_s: float) -> Heal:
        """Delay every write of recordings of this process, in wall-clock time [s]."""
        return self._until(self._disk.slow_down(delay_s))

    def _in_force(self, *rules: Fault | ServerGone) -> Heal:
        for rule in rules:
            self._daq.faults.add(rule)

        def heal() -> None:
            for rule in rules:
                self._daq.faults.remove(rule)

        return self._until(heal)


class ScriptedFault(FrozenModel):
    """Start and duration of a fault; a subclass has the parameters of the method that its ``fault`` names."""

    at_s: NonNegativeFloat
    """Rig time since switch-on [s]."""
    for_s: PositiveFloat | None = None
    """Duration in rig time [s]; absent: permanent, or ending by itself."""
    fault: str

    def begin(self, rig: RigFaults) -> Heal:
        """Start the fault; return the function that ends it."""
        parameters = {name: getattr(self, name) for name in type(self).__annotations__ if name != "fault"}
        heal: Heal = getattr(rig, self.fault)(**parameters)
        return heal


class SimpleFault(ScriptedFault):
    """A fault without parameters."""

    fault: Literal[
        "pull_usb_cable",
        "hang_generator",
        "stick_output",
        "corrupt_reply",
        "overrun",
        "reserve_device",
        "lose_daq_server",
    ]


class DelayReply(ScriptedFault):
    """One reply of the generator comes late."""

    fault: Literal["delay_reply"]
    delay_s: PositiveFloat


class JumpClock(ScriptedFault):
    """The generator's clock jumps, and with it the phase of its output."""

    fault: Literal["jump_clock"]
    by_s: float
    """Positive: forwards [s]."""


class Disturbed(ScriptedFault):
    """The sensor of m0 shows nothing, like a vibrometer without light, or stays at full scale."""

    fault: Literal["drop_laser", "over_range"]
    for_s: PositiveFloat


class TurnGain(ScriptedFault):
    """The amplifier's gain is changed."""

    fault: Literal["turn_amplifier_gain"]
    gain_db: float = Field(ge=-60, le=60)


class WidenGaps(ScriptedFault):
    """Both stops of the specimen move away from m1, or towards it."""

    fault: Literal["widen_gaps"]
    by_m: float = Field(ge=-1e-4, le=1e-3)
    """Change of the configured gaps [m]."""


class Disconnect(ScriptedFault):
    """An input of the converter is disconnected."""

    fault: Literal["disconnect"]
    channel: str
    """Name of the input, such as ``"cDAQ1Mod1/ai2"``."""


class FailDaq(ScriptedFault):
    """A call of the DAQmx driver fails with a code."""

    fault: Literal["fail_daq"]
    call: str
    code: int


class FillDisk(ScriptedFault):
    """The disk of the recording program is full."""

    fault: Literal["fill_disk"]
    refusals: PositiveInt | None = None
    """Number of failing writes; absent: until the fault ends."""


class SlowDisk(ScriptedFault):
    """Every write to the disk is slow."""

    fault: Literal["slow_disk"]
    delay_s: PositiveFloat
    """Delay in wall-clock time, as for any disk [s]."""


DISK_FAULTS = frozenset({"fill_disk", "slow_disk"})
"""Faults of the recording program, not of the rig."""

FaultKind = Annotated[
    SimpleFault
    | DelayReply
    | JumpClock
    | Disturbed
    | TurnGain
    | WidenGaps
    | Disconnect
    | FailDaq
    | FillDisk
    | SlowDisk,
    Field(discriminator="fault"),
]


class FaultScript(FrozenModel):
    """Faults and their times, in any order."""

    faults: tuple[FaultKind, ...] = ()


def load_fault_script(path: Path | str) -> FaultScript:
    """Return the faults of a TOML file, or of a shipped script by its name (``"night"``).

    Raises ConfigurationError with file, key, what was given and what is allowed.
    """
    return load_toml(named(path, "hardware_configs/faults"), FaultScript)
