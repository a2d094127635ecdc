"""Who a converter is: product, serial number and the version of the driver it was reached through."""

from ..instruments import Identity
from ._daqmx_session import DaqmxSession


def daqmx_identity(session: DaqmxSession, device_name: str) -> Identity:
    """Ask the driver about a device by its name, ``"cDAQ1Mod1"``; raises what the DAQmx client raises."""
    system = session.system()
    device = system.devices[device_name]
    product, serial = str(device.product_type), f"{device.serial_num:08X}"
    version = system.driver_version
    driver = f"NI-DAQmx {version.major_version}.{version.minor_version}.{version.update_version}"
    reply = f"{device_name}: {product}, {serial}, {driver}"
    return Identity("National Instruments", product, serial, driver, reply)
