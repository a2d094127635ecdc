"""The complete virtual rig: generator on the USB bus, DAQ server, analogue world, and scripted faults.

`VirtualRig` assembles the inner packages for a configuration of a rig. `RigFaults` starts faults on demand;
a fault script starts them at given rig times, to rehearse a long campaign (docs/campaigns.md)::

    [[faults]]
    at_s = 120
    fault = "pull_usb_cable"
    for_s = 5
"""

import errno
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum, auto
from functools import partial, reduce
from inspect import signature
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from nidaqmx.error_codes import DAQmxErrors
from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, create_model

from vibench.acquisition import AcquisitionError, ConfigurationError, file_path, load_toml
from vibench.acquisition.instruments import PlugInKind, plug_in, require_plug_in, usb_ids
from vibench.acquisition.recording import DiskTrouble, trouble_disks
from vibench.acquisition.rig import Rig, Role, VirtualConfig
from vibench.sim import FrozenModel

from .daqmx.data_calls import DATA_CALLS
from .daqmx.devices import catalogue_with
from .daqmx.rig import OnDemandPace, Pace, WallPace
from .daqmx.server import LOOPBACK, DaqServer, token_for
from .generator.afg1022 import AFG1022
from .generator.scpi_instrument import Quirks, ScpiSocket
from .generator.terminal_voltage import Terminal
from .usb.bus import plug_in as connect, unplug, usb_service
from .usb.usbtmc import UsbTmcInstrument
from .world.time_grid import FULL_BAND_HZ, relative_clock_ppm
from .world.world import World, virtual_section

Heal = Callable[[], None]
"""Function that ends a fault of the rig."""
# A program accesses the device in these calls: setting the clock of a task, and starting a task.
_RESERVING = ("CfgSampClkTiming", "StartTask")
_READS = tuple(call for call in DATA_CALLS if call.startswith("Read"))


@dataclass(frozen=True)
class PlayedFault:
    """A fault of a script that has started."""

    fault: str
    began_s: float


class RigFaults:
    """Faults of a running virtual rig: each method starts a fault and returns the function that ends it.

    A method whose fault ends by itself returns None. A scripted fault has the name and the parameters of its
    method. The class is thread-safe.
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
        if fault.for_s is not None and heal is not None:
            self._world.at(fault.at_s + fault.for_s, heal)

    def heal(self) -> None:
        """End every fault that has not ended."""
        while self._heals:
            self._heals.pop()()

    def _until(self, heal: Heal) -> Heal:
        self._heals.append(heal)
        return heal

    def _break_cable(self, number: int) -> Heal:
        self._cable.fail(number)
        return self._until(lambda: self._cable.mend(number))

    def pull_usb_cable(self) -> Heal:
        """Disconnect the generator: every transfer fails, and its output continues."""
        return self._break_cable(errno.ENODEV)

    def hang_generator(self) -> Heal:
        """Make the generator stop answering; its output continues."""
        return self._break_cable(errno.ETIMEDOUT)

    def jump_clock(self, by_s: float) -> None:
        """Shift the generator's clock (forwards if positive) [s], and thus the phase of the output."""
        self._generator.jump_clock(by_s)

    def delay_reply(self, delay_s: PositiveFloat) -> None:
        """Delay the generator's next reply."""
        self._generator.delay_next_reply(delay_s)

    def corrupt_reply(self) -> None:
        """Corrupt the generator's next reply."""
        self._generator.corrupt_next_reply()

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

    def drop_laser(self, for_s: PositiveFloat) -> None:
        """Set the output of the m0 sensor to zero for a while, as a vibrometer without light does."""
        self._world.disturb_response(for_s, level=0.0)

    def over_range(self, for_s: PositiveFloat) -> None:
        """Hold the sensor of m0 at full scale for a while."""
        self._world.disturb_response(for_s, level=1.0)

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
        """Reserve the converter for another program: running tasks continue, but new tasks are refused."""
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
    """Start and duration of a fault, and the parameters of the `RigFaults` method that ``fault`` names."""

    at_s: NonNegativeFloat
    """Start of the fault in rig time since switch-on [s]."""
    for_s: PositiveFloat | None = None
    """Duration in rig time [s]; if absent, the fault is permanent or ends by itself."""
    fault: str

    def begin(self, rig: RigFaults) -> Heal | None:
        """Start the fault; return the function that ends it, or None if the fault ends by itself."""
        start = getattr(rig, self.fault)
        heal: Heal | None = start(**{name: getattr(self, name) for name in signature(start).parameters})
        return heal


def _script_model(fault: Callable[..., Heal | None]) -> type[ScriptedFault]:
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
"""Faults that affect the program that records instead of the rig."""

_SCRIPTED = [
    method
    for name, method in vars(RigFaults).items()
    if not name.startswith("_") and name not in ("play", "heal")
]
if TYPE_CHECKING:
    FaultKind = ScriptedFault
else:
    FaultKind = Annotated[reduce(or_, map(_script_model, _SCRIPTED)), Field(discriminator="fault")]


class FaultScript(FrozenModel):
    """Faults, with their start times, in any order."""

    faults: tuple[FaultKind, ...] = ()


def load_fault_script(path: Path | str) -> FaultScript:
    """Return the faults of a TOML file, or of a shipped script by its name (``"night"``).

    Raises ConfigurationError with file, key, given value and allowed values.
    """
    return load_toml(file_path(path, "hardware_configs/faults"), FaultScript)


_USB_RESOURCE_FIELDS = 5
REFUSED_S = 1.0
"""Rig time added by each repeated disk failure [s], so that the fault can end while a program retries."""


class DiskFaults(Enum):
    """Whether a script may cause disk faults."""

    PLAYED = auto()
    """Allowed: this process records, so disk faults of the script act on its recording."""
    REFUSED = auto()
    """Not allowed: another process records, and this process cannot cause faults of that process's disk."""


class VirtualRig:
    """All simulated instruments of a rig, available within the ``with`` statement.

    In this process, pyvisa finds the generator at ``visa_resource``, and nidaqmx finds the converter at
    ``daq_address``. Programs of other processes find both at ``daq_address``: the generator after
    ``plug_in_remote(daq_address)`` or, without this call, at ``socket_resource``.

    Parameters
    ----------
    rig
        A rig with a ``[virtual]`` section.
    address
        ``"host:port"`` of the server; port 0 selects a free port. The default is loopback; for other hosts,
        every call needs `token`.
    quirks
        Peculiarities of the generator's firmware. With a load of 50 ohm set at its front panel, the voltage
        at the amplifier is twice the commanded voltage.
    scpi_port
        Port of `socket_resource`; 0 selects a free port.
    disk
        Whether a fault script may affect recordings of this process.
    """

    def __init__(
        self,
        rig: Rig,
        address: str = LOOPBACK,
        *,
        quirks: Quirks = Quirks(),  # noqa: B008 - frozen
        scpi_port: int = 0,
        disk: DiskFaults = DiskFaults.PLAYED,
    ) -> None:
        virtual = virtual_section(rig)
        self._script = _script(virtual, disk)
        self.rig = rig
        self._address = address
        self._scpi_port = scpi_port
        self.token = token_for(address)
        """Token that calls from other computers need; None on loopback."""
        self._pace: Pace = WallPace(virtual.speed) if virtual.pace == "wall" else OnDemandPace()
        # Generator and world need each other, so the generator's clock looks ``world`` up at each call.
        simulated, ids, serial = _simulated_generator(rig.generator.resource)
        self.generator = simulated(
            lambda: self.world.time_s,
            serial=serial,
            quirks=quirks,
            terminal=Terminal(
                load_ohm=rig.generator.connected_ohm,
                clock_error_ppm=relative_clock_ppm(virtual.generator_clock_ppm, virtual.converter_clock_ppm),
                noise_v_per_rt_hz=virtual.generator_noise_v / FULL_BAND_HZ**0.5,
                seed=virtual.seed,
            ),
        )
        self.controller = _controller(rig, lambda: self.world.time_s)
        """The simulated controller of a fast loop; None if the rig has no fast loop."""
        self.world = World(rig, self.generator, loop=self.controller.cables if self.controller else None)
        self._usb = UsbTmcInstrument(self.generator, usb_ids=ids)
        self.visa_resource = self._usb.identification.resource_name
        """VISA resource name of the generator."""
        self._running: _Running | None = None

    @property
    def daq_address(self) -> str:
        """``"host:port"`` of the DAQ server, which also serves the generator's USB cable."""
        return self._running_state.daq.address

    @property
    def socket_resource(self) -> str:
        """VISA name of the generator for programs without access to the simulated USB bus."""
        return self._running_state.socket.resource_name

    @property
    def controller_resource(self) -> str:
        """VISA name of the real-time controller's socket; empty if the rig has no controller."""
        socket = self._running_state.controller
        return "" if socket is None else socket.resource_name

    @property
    def faults(self) -> RigFaults:
        """Object that starts faults on demand."""
        return self._running_state.faults

    @property
    def played_faults(self) -> tuple[PlayedFault, ...]:
        """Faults of the configuration's script that have started so far."""
        return tuple(self._running_state.faults.played)

    def aim(self, role: Role) -> None:
        """Move the vibrometer's beam to the mass of ``role``, such as ``m2_velocity``."""
        self.world.aim(role)

    def let_pass(self, duration_s: float) -> None:
        """Advance rig time without sampling; a rig that runs in real time advances by itself."""
        if isinstance(self._pace, OnDemandPace):
            self._running_state.daq.let_pass(duration_s)

    def __enter__(self) -> Self:
        """Switch everything on; if a part fails, switch everything off again."""
        with ExitStack() as starting:
            connect(self._usb)
            starting.callback(unplug, self._usb)
            daq = starting.enter_context(
                DaqServer(
                    self.world,
                    self._pace,
                    self._address,
                    catalogue=catalogue_with(self.rig.daq.product, self.rig.daq.device),
                    handlers=(usb_service(self._usb),),
                    token=self.token,
                )
            )
            socket = starting.enter_context(self._socket())
            controller = (
                None if self.controller is None else starting.enter_context(ScpiSocket(self.controller))
            )
            disk = DiskTrouble(lambda: self.let_pass(REFUSED_S))
            starting.enter_context(trouble_disks(disk))
            faults = RigFaults(self.world, self.generator, self._usb, daq, disk)
            faults.play(self._script)
            self._running = _Running(daq, socket, controller, faults, starting.pop_all())
        return self

    def __exit__(self, *_: object) -> None:
        running, self._running = self._running, None
        if running is not None:
            running.closing.close()

    def _socket(self) -> ScpiSocket:
        try:
            return ScpiSocket(self.generator, self._scpi_port)
        except (OSError, OverflowError) as error:
            raise ConfigurationError(
                f"port {self._scpi_port} cannot be used ({error}); give another port, or 0 for a free port"
            ) from error

    @property
    def _running_state(self) -> "_Running":
        if self._running is None:
            raise AcquisitionError(
                "The virtual rig is switched off: enter it with 'with VirtualRig(rig) as ...'"
            )
        return self._running


@dataclass(frozen=True)
class _Running:
    daq: DaqServer
    socket: ScpiSocket
    controller: ScpiSocket | None
    faults: RigFaults
    closing: ExitStack


def _controller(rig: Rig, clock: Callable[[], float]) -> Any:
    """Return the simulated controller: a `ScpiDevice` with a `ClosedLoop` as ``cables``, or None."""
    if rig.controller is None:
        return None
    simulated = plug_in(PlugInKind.VIRTUAL_INSTRUMENT, "controller")
    return simulated(rig.controller, virtual_section(rig).grid_rate_hz, clock)


def _script(virtual: VirtualConfig, disk: DiskFaults) -> FaultScript:
    if virtual.faults is None:
        return FaultScript()
    script = load_fault_script(Path(virtual.faults))
    if disk is DiskFaults.REFUSED and any(each.fault in DISK_FAULTS for each in script.faults):
        raise ConfigurationError(
            f"{virtual.faults}: {' and '.join(sorted(DISK_FAULTS))} need a program that records. Nothing was "
            "started; omit these faults, or give the script to 'vibench measure'"
        )
    return script


def _simulated_generator(resource: str) -> tuple[type[AFG1022], tuple[int, int], str]:
    """Return class, USB numbers and serial number of ``USB0::0x0699::0x0353::<serial>::INSTR``."""
    ids, fields = usb_ids(resource), resource.split("::")
    if ids is None or len(fields) < _USB_RESOURCE_FIELDS:
        raise ConfigurationError(
            f"generator.resource = {resource!r}: the virtual generator is a USB device; "
            "give USB0::0x0699::0x0353::<serial>::INSTR (AFG1022) or "
            "USB0::0x0957::0x2C07::<serial>::INSTR (33522B)"
        )
    kind, vendor = PlugInKind.VIRTUAL_INSTRUMENT, f"{ids[0]:#06x}"
    require_plug_in(kind, vendor, f"generator.resource = {resource!r}: ")
    return plug_in(kind, vendor), ids, fields[3]
