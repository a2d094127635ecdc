"""A script of faults by rig time, so that a whole night can be rehearsed in minutes.

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
"""Takes one fault back."""
# Where a program first asks the driver for the device: setting it up, and starting on it.
_RESERVING = ("CfgSampClkTiming", "StartTask")
_READS = ("ReadAnalogF64", "ReadBinaryI32", "ReadRaw")


class RigFaults:
    """Faults of a running virtual rig; each takes effect at once and may be called from any thread."""

    def __init__(
        self, world: World, generator: AFG1022, cable: UsbTmcInstrument, daq: DaqServer, disk: DiskTrouble
    ) -> None:
        """Take the parts that can fail."""
        self._world = world
        self._generator = generator
        self._cable = cable
        self._daq = daq
        self.disk = disk
        """Of the recordings that this process makes."""

    def pull_usb_cable(self) -> None:
        """Lose the generator: every transfer fails, and it plays on."""
        self._cable.pull_cable()

    def plug_usb_cable(self) -> None:
        """Put the generator's cable back."""
        self._cable.plug_cable()

    def hang_generator(self) -> None:
        """Let the generator answer nobody; it plays on."""
        self._cable.hang()

    def wake_generator(self) -> None:
        """Let the generator answer again."""
        self._cable.wake()

    def jump_clock(self, by_s: float) -> None:
        """Let the generator's clock jump [s]: what plays jumps in phase."""
        self._generator.jump_clock(by_s)

    def delay_next_reply(self, delay_s: float) -> None:
        """Let the generator's next reply come late."""
        self._generator.delay_next_reply(delay_s)

    def corrupt_next_reply(self) -> None:
        """Let the generator's next reply be unreadable."""
        self._generator.corrupt_next_reply()

    def stick_output(self) -> None:
        """Weld the generator's output relay: it reports off and stays on."""
        self._generator.weld_output_relay()

    def free_output(self) -> None:
        """Repair the generator's output relay."""
        self._generator.repair_output_relay()

    def turn_amplifier_gain(self, gain_db: float) -> None:
        """Turn the amplifier's knob to something else than the configuration says."""
        self._world.set_amplifier_gain_db(gain_db)

    def turn_gain_back(self) -> None:
        """Turn the amplifier's knob to what the configuration says."""
        self._world.restore_amplifier_gain()

    def widen_gaps(self, by_m: float) -> None:
        """Let the specimen's stops stand further from m1, or nearer [m]: a screw is loose, a stop worn."""
        self._world.widen_gaps(by_m)

    def drop_laser(self, duration_s: float) -> None:
        """Take the light from the vibrometer: it shows nothing for a while."""
        self._world.disturb_vibrometer(duration_s, DROPOUT_LEVEL)

    def over_range(self, duration_s: float) -> None:
        """Let the vibrometer sit at its full scale for a while."""
        self._world.disturb_vibrometer(duration_s, OVER_RANGE_LEVEL)

    def disconnect(self, physical_channel: str) -> None:
        """Pull the cable out of an input of the converter, ``"cDAQ1Mod1/ai2"`` for example."""
        self._world.disconnect(physical_channel)

    def connect(self, physical_channel: str) -> None:
        """Plug the cable of an input of the converter in again."""
        self._world.connect(physical_channel)

    def reverse(self, physical_channel: str) -> None:
        """Swap the two wires of an input of the converter; `connect` puts them right."""
        self._world.reverse(physical_channel)

    def overrun(self, from_s: float = 0.0) -> Heal:
        """Let the converter's buffer be overwritten before it is read, from a rig time on [s]."""
        code = DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE.value
        return self._in_force(*(Fault(call, code, from_s=from_s) for call in _READS))

    def reserve_device(self) -> Heal:
        """Let another program hold the converter: anyone who sets up or starts a task is refused."""
        code = DAQmxErrors.PAL_RESOURCE_RESERVED.value
        return self._in_force(*(Fault(call, code) for call in _RESERVING))

    def fail_daq(self, call: str, code: int, from_s: float = 0.0) -> Heal:
        """Let a call of the DAQmx driver fail with a code (``nidaqmx.error_codes``), from a rig time on.

        A fault of one call that reads samples is a fault of the other: which one a driver uses is its affair.
        """
        calls = _READS if call in _READS else (call,)
        return self._in_force(*(Fault(each, code, from_s=from_s) for each in calls))

    def lose_daq_server(self, from_s: float = 0.0) -> Heal:
        """Let the DAQ server answer nobody any more, from a rig time on [s]."""
        return self._in_force(ServerGone(from_s=from_s))

    def heal_daq(self) -> None:
        """Take back every fault of the DAQ server."""
        self._daq.faults.clear()

    def _in_force(self, *rules: Fault | ServerGone) -> Heal:
        for rule in rules:
            self._daq.faults.add(rule)

        def heal() -> None:
            for rule in rules:
                self._daq.faults.remove(rule)

        return heal


def nothing_to_heal() -> None:
    """Take back what is over by itself."""


class ScriptedFault(FrozenModel):
    """When a fault begins, and for how long it lasts."""

    at_s: NonNegativeFloat
    """Rig time since the rig was switched on [s]."""
    for_s: PositiveFloat | None = None
    """Rig time after which it heals [s]; absent: never, or by itself."""


class PullUsbCable(ScriptedFault):
    """The generator's cable is out: it cannot be reached, and plays on."""

    fault: Literal["pull_usb_cable"]

    def begin(self, rig: RigFaults) -> Heal:
        """Pull it."""
        rig.pull_usb_cable()
        return rig.plug_usb_cable


class HangGenerator(ScriptedFault):
    """The generator answers nobody, and plays on."""

    fault: Literal["hang_generator"]

    def begin(self, rig: RigFaults) -> Heal:
        """Hang."""
        rig.hang_generator()
        return rig.wake_generator


class StickOutput(ScriptedFault):
    """The generator's output relay sticks: it reports off and stays on."""

    fault: Literal["stick_output"]

    def begin(self, rig: RigFaults) -> Heal:
        """Weld it."""
        rig.stick_output()
        return rig.free_output


class DelayReply(ScriptedFault):
    """One reply of the generator comes late."""

    fault: Literal["delay_reply"]
    delay_s: PositiveFloat

    def begin(self, rig: RigFaults) -> Heal:
        """Delay the next one."""
        rig.delay_next_reply(self.delay_s)
        return nothing_to_heal


class CorruptReply(ScriptedFault):
    """One reply of the generator is unreadable."""

    fault: Literal["corrupt_reply"]

    def begin(self, rig: RigFaults) -> Heal:
        """Spoil the next one."""
        rig.corrupt_next_reply()
        return nothing_to_heal


class JumpClock(ScriptedFault):
    """The generator's clock jumps: whatever plays jumps in phase."""

    fault: Literal["jump_clock"]
    by_s: float
    """Forwards when positive [s]."""

    def begin(self, rig: RigFaults) -> Heal:
        """Jump."""
        rig.jump_clock(self.by_s)
        return nothing_to_heal


class DropLaser(ScriptedFault):
    """The vibrometer has no light and shows nothing."""

    fault: Literal["drop_laser"]
    for_s: PositiveFloat

    def begin(self, rig: RigFaults) -> Heal:
        """Take the light."""
        rig.drop_laser(self.for_s)
        return nothing_to_heal


class OverRange(ScriptedFault):
    """The vibrometer sits at its full scale."""

    fault: Literal["over_range"]
    for_s: PositiveFloat

    def begin(self, rig: RigFaults) -> Heal:
        """Go there."""
        rig.over_range(self.for_s)
        return nothing_to_heal


class TurnGain(ScriptedFault):
    """Somebody turns the amplifier's knob."""

    fault: Literal["turn_amplifier_gain"]
    gain_db: float = Field(ge=-60, le=60)

    def begin(self, rig: RigFaults) -> Heal:
        """Turn it; healing turns it back to where the configuration has it."""
        rig.turn_amplifier_gain(self.gain_db)
        return rig.turn_gain_back


class WidenGaps(ScriptedFault):
    """Both stops of the specimen move away from m1, or towards it."""

    fault: Literal["widen_gaps"]
    by_m: float = Field(ge=-1e-4, le=1e-3)
    """Against what the configuration says [m]."""

    def begin(self, rig: RigFaults) -> Heal:
        """Move them; healing puts them back."""
        rig.widen_gaps(self.by_m)
        return lambda: rig.widen_gaps(0.0)


class Disconnect(ScriptedFault):
    """A cable falls out of an input of the converter."""

    fault: Literal["disconnect"]
    channel: str
    """``"cDAQ1Mod1/ai2"``."""

    def begin(self, rig: RigFaults) -> Heal:
        """Pull it; healing plugs it in."""
        rig.disconnect(self.channel)
        return lambda: rig.connect(self.channel)


class Overrun(ScriptedFault):
    """The converter's buffer is overwritten before it is read."""

    fault: Literal["overrun"]

    def begin(self, rig: RigFaults) -> Heal:
        """Lose samples at every read."""
        return rig.overrun()


class ReserveDevice(ScriptedFault):
    """Another program takes the converter: tasks that run go on, new ones are refused."""

    fault: Literal["reserve_device"]

    def begin(self, rig: RigFaults) -> Heal:
        """Take it."""
        return rig.reserve_device()


class FailDaq(ScriptedFault):
    """A call of the DAQmx driver fails with a code."""

    fault: Literal["fail_daq"]
    call: str
    code: int

    def begin(self, rig: RigFaults) -> Heal:
        """Fail it."""
        return rig.fail_daq(self.call, self.code)


class LoseDaqServer(ScriptedFault):
    """The gRPC server of the converter answers nobody."""

    fault: Literal["lose_daq_server"]

    def begin(self, rig: RigFaults) -> Heal:
        """Go."""
        return rig.lose_daq_server()


class FillDisk(ScriptedFault):
    """The disk of the recording program is full."""

    fault: Literal["fill_disk"]
    refusals: PositiveInt | None = None
    """How often it refuses before there is room again; absent: until healed."""

    def begin(self, rig: RigFaults) -> Heal:
        """Fill it."""
        return rig.disk.fill() if self.refusals is None else rig.disk.fill(self.refusals)


class SlowDisk(ScriptedFault):
    """Every write to the disk takes long."""

    fault: Literal["slow_disk"]
    delay_s: PositiveFloat
    """On the wall's clock, since a disk knows no other [s]."""

    def begin(self, rig: RigFaults) -> Heal:
        """Slow it down."""
        return rig.disk.slow_down(self.delay_s)


DISK_FAULTS = frozenset({"fill_disk", "slow_disk"})
"""What befalls the program that records, not the rig."""

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
    """What goes wrong, and when; in any order."""

    faults: tuple[FaultKind, ...] = ()


def load_fault_script(path: Path | str) -> FaultScript:
    """Read a script of faults: a TOML file, or by its name (``"night"``) one that comes with vibench.

    Raises
    ------
    ConfigurationError
        With file, key, what was given and what is allowed.
    """
    return load_toml(named(path, "hardware_configs/faults"), FaultScript)


@dataclass(frozen=True)
class PlayedFault:
    """One fault that has started."""

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
