"""A script of faults by rig time, to rehearse a long campaign in minutes.

::

    [[faults]]
    at_s = 120
    fault = "pull_usb_cable"
    for_s = 5
"""

from collections.abc import Callable
from dataclasses import dataclass, field
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
"""Ends one fault."""
# Calls at which a program first accesses the device: creating a task's channels, and starting it.
_RESERVING = ("CfgSampClkTiming", "StartTask")
_READS = ("ReadAnalogF64", "ReadBinaryI32", "ReadRaw")


class RigFaults:
    """Faults of a running virtual rig; each acts at once, and calls are thread-safe."""

    def __init__(
        self, world: World, generator: AFG1022, cable: UsbTmcInstrument, daq: DaqServer, disk: DiskTrouble
    ) -> None:
        self._world = world
        self._generator = generator
        self._cable = cable
        self._daq = daq
        self.disk = disk
        """Disk of the recordings of this process."""

    def pull_usb_cable(self) -> None:
        """Disconnect the generator: every transfer fails, and its output continues."""
        self._cable.pull_cable()

    def plug_usb_cable(self) -> None:
        """Reconnect the generator."""
        self._cable.plug_cable()

    def hang_generator(self) -> None:
        """Make the generator unresponsive; its output continues."""
        self._cable.hang()

    def wake_generator(self) -> None:
        """Make the generator responsive again."""
        self._cable.wake()

    def jump_clock(self, by_s: float) -> None:
        """Shift the generator's clock [s], and thus the phase of its output."""
        self._generator.jump_clock(by_s)

    def delay_next_reply(self, delay_s: float) -> None:
        """Delay the generator's next reply."""
        self._generator.delay_next_reply(delay_s)

    def corrupt_next_reply(self) -> None:
        """Corrupt the generator's next reply."""
        self._generator.corrupt_next_reply()

    def stick_output(self) -> None:
        """Weld the generator's output relay: it reports off and stays on."""
        self._generator.weld_output_relay()

    def free_output(self) -> None:
        """Repair the generator's output relay."""
        self._generator.repair_output_relay()

    def turn_amplifier_gain(self, gain_db: float) -> None:
        """Set the amplifier's gain to a value other than the configured one."""
        self._world.set_amplifier_gain_db(gain_db)

    def turn_gain_back(self) -> None:
        """Restore the configured gain of the amplifier."""
        self._world.restore_amplifier_gain()

    def widen_gaps(self, by_m: float) -> None:
        """Move the specimen's stops away from m1, or closer [m], as by a loose screw or wear."""
        self._world.widen_gaps(by_m)

    def drop_laser(self, duration_s: float) -> None:
        """Let the sensor of m0 show nothing for a while, like a vibrometer without light."""
        self._world.disturb_response(duration_s, DROPOUT_LEVEL)

    def over_range(self, duration_s: float) -> None:
        """Hold the sensor of m0 at full scale for a while."""
        self._world.disturb_response(duration_s, OVER_RANGE_LEVEL)

    def disconnect(self, physical_channel: str) -> None:
        """Disconnect an input of the converter, such as ``"cDAQ1Mod1/ai2"``."""
        self._world.disconnect(physical_channel)

    def connect(self, physical_channel: str) -> None:
        """Reconnect an input of the converter."""
        self._world.connect(physical_channel)

    def reverse(self, physical_channel: str) -> None:
        """Swap the two wires of an input of the converter; `connect` restores them."""
        self._world.reverse(physical_channel)

    def overrun(self, from_s: float = 0.0) -> Heal:
        """Overwrite the converter's buffer before it is read, from a rig time on [s]."""
        code = DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE.value
        return self._in_force(*(Fault(call, code, from_s=from_s) for call in _READS))

    def reserve_device(self) -> Heal:
        """Reserve the converter for another program: creating or starting a task fails."""
        code = DAQmxErrors.PAL_RESOURCE_RESERVED.value
        return self._in_force(*(Fault(call, code) for call in _RESERVING))

    def fail_daq(self, call: str, code: int, from_s: float = 0.0) -> Heal:
        """Make a DAQmx call fail with a code (``nidaqmx.error_codes``), from a rig time on.

        A fault of one call that reads samples also applies to the other, because drivers may use either.
        """
        calls = _READS if call in _READS else (call,)
        return self._in_force(*(Fault(each, code, from_s=from_s) for each in calls))

    def lose_daq_server(self, from_s: float = 0.0) -> Heal:
        """Stop the DAQ server from answering, from a rig time on [s]."""
        return self._in_force(ServerGone(from_s=from_s))

    def heal_daq(self) -> None:
        """End every fault of the DAQ server."""
        self._daq.faults.clear()

    def _in_force(self, *rules: Fault | ServerGone) -> Heal:
        for rule in rules:
            self._daq.faults.add(rule)

        def heal() -> None:
            for rule in rules:
                self._daq.faults.remove(rule)

        return heal


def nothing_to_heal() -> None:
    """Do nothing, because the fault ends by itself."""


class ScriptedFault(FrozenModel):
    """Start and duration of a fault."""

    at_s: NonNegativeFloat
    """Rig time since switch-on [s]."""
    for_s: PositiveFloat | None = None
    """Duration in rig time [s]; absent: permanent, or ending by itself."""


class PullUsbCable(ScriptedFault):
    """The generator's cable is disconnected: it cannot be reached, and its output continues."""

    fault: Literal["pull_usb_cable"]

    def begin(self, rig: RigFaults) -> Heal:
        """Disconnect the cable."""
        rig.pull_usb_cable()
        return rig.plug_usb_cable


class HangGenerator(ScriptedFault):
    """The generator does not respond, and its output continues."""

    fault: Literal["hang_generator"]

    def begin(self, rig: RigFaults) -> Heal:
        """Make it unresponsive."""
        rig.hang_generator()
        return rig.wake_generator


class StickOutput(ScriptedFault):
    """The generator's output relay sticks: it reports off and stays on."""

    fault: Literal["stick_output"]

    def begin(self, rig: RigFaults) -> Heal:
        """Block the relay."""
        rig.stick_output()
        return rig.free_output


class DelayReply(ScriptedFault):
    """One reply of the generator comes late."""

    fault: Literal["delay_reply"]
    delay_s: PositiveFloat

    def begin(self, rig: RigFaults) -> Heal:
        """Delay the next reply."""
        rig.delay_next_reply(self.delay_s)
        return nothing_to_heal


class CorruptReply(ScriptedFault):
    """One reply of the generator is unreadable."""

    fault: Literal["corrupt_reply"]

    def begin(self, rig: RigFaults) -> Heal:
        """Corrupt the next reply."""
        rig.corrupt_next_reply()
        return nothing_to_heal


class JumpClock(ScriptedFault):
    """The generator's clock jumps, and with it the phase of its output."""

    fault: Literal["jump_clock"]
    by_s: float
    """Positive: forwards [s]."""

    def begin(self, rig: RigFaults) -> Heal:
        """Shift the clock."""
        rig.jump_clock(self.by_s)
        return nothing_to_heal


class DropLaser(ScriptedFault):
    """The sensor of m0 shows nothing, like a vibrometer without light."""

    fault: Literal["drop_laser"]
    for_s: PositiveFloat

    def begin(self, rig: RigFaults) -> Heal:
        """Block the laser."""
        rig.drop_laser(self.for_s)
        return nothing_to_heal


class OverRange(ScriptedFault):
    """The sensor of m0 stays at full scale."""

    fault: Literal["over_range"]
    for_s: PositiveFloat

    def begin(self, rig: RigFaults) -> Heal:
        """Hold it at full scale."""
        rig.over_range(self.for_s)
        return nothing_to_heal


class TurnGain(ScriptedFault):
    """The amplifier's gain is changed."""

    fault: Literal["turn_amplifier_gain"]
    gain_db: float = Field(ge=-60, le=60)

    def begin(self, rig: RigFaults) -> Heal:
        """Change the gain; healing restores the configured one."""
        rig.turn_amplifier_gain(self.gain_db)
        return rig.turn_gain_back


class WidenGaps(ScriptedFault):
    """Both stops of the specimen move away from m1, or towards it."""

    fault: Literal["widen_gaps"]
    by_m: float = Field(ge=-1e-4, le=1e-3)
    """Change of the configured gaps [m]."""

    def begin(self, rig: RigFaults) -> Heal:
        """Move the stops; healing restores them."""
        rig.widen_gaps(self.by_m)
        return lambda: rig.widen_gaps(0.0)


class Disconnect(ScriptedFault):
    """An input of the converter is disconnected."""

    fault: Literal["disconnect"]
    channel: str
    """``"cDAQ1Mod1/ai2"``."""

    def begin(self, rig: RigFaults) -> Heal:
        """Disconnect it; healing reconnects it."""
        rig.disconnect(self.channel)
        return lambda: rig.connect(self.channel)


class Overrun(ScriptedFault):
    """The converter's buffer is overwritten before it is read."""

    fault: Literal["overrun"]

    def begin(self, rig: RigFaults) -> Heal:
        """Lose samples at every read."""
        return rig.overrun()


class ReserveDevice(ScriptedFault):
    """Another program reserves the converter: running tasks continue, new ones are refused."""

    fault: Literal["reserve_device"]

    def begin(self, rig: RigFaults) -> Heal:
        """Reserve it."""
        return rig.reserve_device()


class FailDaq(ScriptedFault):
    """A call of the DAQmx driver fails with a code."""

    fault: Literal["fail_daq"]
    call: str
    code: int

    def begin(self, rig: RigFaults) -> Heal:
        """Make the call fail."""
        return rig.fail_daq(self.call, self.code)


class LoseDaqServer(ScriptedFault):
    """The gRPC server of the converter does not answer."""

    fault: Literal["lose_daq_server"]

    def begin(self, rig: RigFaults) -> Heal:
        """Stop answering."""
        return rig.lose_daq_server()


class FillDisk(ScriptedFault):
    """The disk of the recording program is full."""

    fault: Literal["fill_disk"]
    refusals: PositiveInt | None = None
    """Number of failing writes; absent: until healed."""

    def begin(self, rig: RigFaults) -> Heal:
        """Fill the disk."""
        return rig.disk.fill() if self.refusals is None else rig.disk.fill(self.refusals)


class SlowDisk(ScriptedFault):
    """Every write to the disk is slow."""

    fault: Literal["slow_disk"]
    delay_s: PositiveFloat
    """Delay in wall-clock time, as for any disk [s]."""

    def begin(self, rig: RigFaults) -> Heal:
        """Slow down the disk."""
        return rig.disk.slow_down(self.delay_s)


DISK_FAULTS = frozenset({"fill_disk", "slow_disk"})
"""Faults of the recording program, not of the rig."""

FaultKind = Annotated[
    PullUsbCable
    | HangGenerator
    | StickOutput
    | DelayReply
    | CorruptReply
    | JumpClock
    | DropLaser
    | OverRange
    | TurnGain
    | WidenGaps
    | Disconnect
    | Overrun
    | ReserveDevice
    | FailDaq
    | LoseDaqServer
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


@dataclass(frozen=True)
class PlayedFault:
    """A fault that has started."""

    fault: str
    began_s: float


@dataclass
class FaultPlay:
    """Plays a script on a rig: each fault at its rig time."""

    world: World
    rig: RigFaults
    played: list[PlayedFault] = field(default_factory=list)

    def begin(self, script: FaultScript) -> None:
        """Schedule every fault of the script."""
        for fault in script.faults:
            self.world.at(fault.at_s, lambda fault=fault: self._start(fault))  # type: ignore[misc]

    def _start(self, fault: FaultKind) -> None:
        heal = fault.begin(self.rig)
        self.played.append(PlayedFault(fault.fault, self.world.time_s))
        if fault.for_s is not None:
            self.world.at(fault.at_s + fault.for_s, heal)
