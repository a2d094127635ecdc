"""What can go wrong with a rig, on demand, in one place: for tests, for training, for a bench check."""

from collections.abc import Callable

from nidaqmx.error_codes import DAQmxErrors

from vibench.acquisition.recording import DiskTrouble

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
        """Let another program hold the converter: whoever sets up or starts a task is refused."""
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
