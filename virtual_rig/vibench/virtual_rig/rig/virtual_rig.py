"""The complete virtual rig: a generator on the USB bus, a DAQ server, and the analogue world between them."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Any, Self

from vibench.acquisition import AcquisitionError, ConfigurationError
from vibench.acquisition.instruments import PlugInKind, plug_in, require_plug_in, usb_ids
from vibench.acquisition.recording import DiskTrouble, trouble_disks
from vibench.acquisition.rig import Rig, Role, VirtualConfig

from ..daqmx.devices import catalogue_with
from ..daqmx.rig import OnDemandPace, Pace, WallPace
from ..daqmx.server import LOOPBACK, DaqServer, token_for
from ..generator.afg1022 import AFG1022
from ..generator.scpi_instrument import Quirks, ScpiSocket
from ..generator.terminal_voltage import Terminal
from ..usb.bus import plug_in as connect, unplug, usb_service
from ..usb.usbtmc import UsbTmcInstrument
from ..world.time_grid import FULL_BAND_HZ, relative_clock_ppm
from ..world.world import World, virtual_section
from .fault_script import DISK_FAULTS, FaultScript, PlayedFault, RigFaults, load_fault_script

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
        ``"host:port"`` of the server; port 0 selects a free one. Loopback by default; for other hosts, every
        call needs `token`.
    quirks
        Peculiarities of the generator's firmware. With a load of 50 ohm set at its front panel, the voltage
        at the amplifier is twice the commanded voltage.
    scpi_port
        Port of `socket_resource`; 0 selects a free one.
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
        # Generator and world refer to each other, so the clock looks up ``world`` at each call.
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
        """Advance rig time without sampling; a rig in real time advances by itself."""
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
            f"{virtual.faults}: {' and '.join(sorted(DISK_FAULTS))} need a program that records, and this "
            "program does not. Nothing was started; omit them, or give the script to 'vibench measure'"
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
