"""List of the instruments that this computer can find, with remarks on searches that failed."""

from dataclasses import dataclass

from .. import drivers
from ..errors import InstrumentError
from ..instruments import FoundDevice
from ..rig import Rig
from .bench import simulated_rig


@dataclass(frozen=True)
class InstrumentList:
    """Instruments that a search has found."""

    visa_resources: tuple[str, ...]
    """Names for ``generator.resource``. USB numbers in them may be decimal: 1689::851 is an AFG1022."""
    daq_devices: tuple[FoundDevice, ...]
    remarks: tuple[str, ...]
    """Reasons why a search by VISA or DAQmx failed."""


def list_instruments(visa_library: str = "@py", server: str | None = None) -> InstrumentList:
    """Return the instruments found by VISA and DAQmx; the error of a failed search becomes a remark.

    Parameters
    ----------
    visa_library
        ``"@py"`` for pyvisa-py, empty for the system's VISA.
    server
        Address of a DAQmx device server, ``"host:port"``; None for the driver on this computer.
    """
    remarks: list[str] = []
    resources: tuple[str, ...] = ()
    devices: tuple[FoundDevice, ...] = ()
    try:
        resources = drivers.list_visa_resources(visa_library)
    except InstrumentError as error:
        remarks.append(str(error))
    try:
        devices = drivers.list_daqmx_devices(server)
    except InstrumentError as error:
        remarks.append(str(error))
    return InstrumentList(resources, devices, tuple(remarks))


def list_rig_instruments(rig: Rig) -> InstrumentList:
    """List the instruments that VISA and DAQmx find for a rig; a virtual rig is started for the search."""
    if rig.virtual is None:
        return list_instruments(rig.generator.visa_library, rig.daq.server)
    with simulated_rig(rig) as virtual:
        return list_instruments(rig.generator.visa_library, virtual.daq_address)
