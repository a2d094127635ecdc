"""Which converters a DAQmx driver knows, for whoever writes a hardware configuration."""

from ..instruments import FoundDevice
from ._daqmx_errors import daqmx_call
from ._daqmx_session import daqmx_session


def list_daqmx_devices(server: str | None) -> tuple[FoundDevice, ...]:
    """List the devices of the driver on this computer, or of a device server at ``"host:port"``.

    Raises
    ------
    InstrumentLost
        When the server does not answer.
    InstrumentError
        When this computer has no driver.

    """
    session = daqmx_session(server)
    try:
        with daqmx_call(f"listing the devices of {session.place}"):
            return tuple(
                FoundDevice(
                    name=device.name,
                    product=device.product_type,
                    serial=f"{device.serial_num:08X}",
                    inputs=tuple(channel.name for channel in device.ai_physical_chans),
                    outputs=tuple(channel.name for channel in device.ao_physical_chans),
                )
                for device in session.system().devices
            )
    finally:
        session.close()
