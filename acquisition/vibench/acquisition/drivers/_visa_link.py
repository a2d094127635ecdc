"""Functions that open and list VISA resources, and explain why a resource cannot be opened."""

import os
import warnings
from pathlib import Path
from typing import cast

import pyvisa
from pyvisa.resources import MessageBasedResource

from ..errors import InstrumentBusy, InstrumentError, InstrumentLost
from ..host.shipped import shipped
from ..instruments import usb_ids

# Time limit of a reply [s]. The slowest known reply is the read-back of 8192 points.
TIMEOUT_S = 3.0
UDEV_RULES = "hardware_configs/70-vibench.rules"
USB_DEVICES = Path("/sys/bus/usb/devices")
USB_NODES = Path("/dev/bus/usb")
_MS_PER_S = 1000.0


Link = MessageBasedResource
"""An open VISA session with an instrument."""


def open_link(resource: str, visa_library: str, timeout_s: float = TIMEOUT_S) -> Link:
    """Open a VISA resource for messages that end in a newline.

    Raises InstrumentLost when no such instrument answers; InstrumentBusy when another program uses it;
    InstrumentError when the VISA library itself cannot be used.
    """
    manager = _manager(visa_library)
    try:
        link = manager.open_resource(resource, open_timeout=int(timeout_s * _MS_PER_S))
    except pyvisa.VisaIOError as error:
        if error.error_code == pyvisa.constants.StatusCode.error_resource_busy:
            raise InstrumentBusy(
                f"{resource} is in use by another program; close that program and open the bench again"
            ) from error
        raise _absent(resource, error) from error
    except MemoryError:  # the caller releases its memory reserve
        raise
    except Exception as error:  # pyvisa-py reports absent devices as bare Exception, ValueError or OSError
        raise _absent(resource, error) from error
    message_link = cast("Link", link)
    message_link.timeout = timeout_s * _MS_PER_S
    message_link.write_termination = "\n"
    if resource.upper().endswith("::SOCKET"):  # a serial stream does not show where a reply ends, USB does
        message_link.read_termination = "\n"
    return message_link


def list_visa_resources(visa_library: str = "@py") -> tuple[str, ...]:
    """Return the resource names of everything that the VISA library finds now.

    pyvisa-py writes USB numbers in decimal: ``USB0::1689::851::C010101::0::INSTR`` is an AFG1022.
    """
    with warnings.catch_warnings():
        # While searching the network, pyvisa-py warns of missing packages and leaves a socket open.
        warnings.simplefilter("ignore", UserWarning)
        warnings.simplefilter("ignore", ResourceWarning)
        return tuple(_manager(visa_library).list_resources("?*"))


def _manager(visa_library: str) -> pyvisa.ResourceManager:
    # One manager for each library lasts as long as the process: pyvisa shares it, and closing it would close
    # every open session.
    try:
        return pyvisa.ResourceManager(visa_library)
    except (OSError, ValueError) as error:
        raise InstrumentError(
            f"the VISA library {visa_library or 'of the system'} cannot be loaded ({error}); "
            'install it, or set generator.visa_library = "@py"'
        ) from error


def _absent(resource: str, error: Exception) -> InstrumentLost:
    # A list of other devices would help, but a network search takes seconds, too long in an emergency.
    if _is_locked_out(resource):
        return InstrumentLost(
            f"{resource} is on the USB bus, but this user account may not use it ({error}). Copy "
            f"{shipped(UDEV_RULES)} to /etc/udev/rules.d, run 'udevadm control --reload' as root, and plug "
            "it in again"
        )
    return InstrumentLost(
        f"no instrument answers at {resource} ({error}). Check its power and cable, and generator.resource "
        "in the hardware configuration; `vibench bench list` lists the instruments found"
    )


def _is_locked_out(resource: str) -> bool:
    """Whether Linux lists a USB device that this account may not write to; libusb reports it as absent."""
    wanted = usb_ids(resource)
    for device in USB_DEVICES.glob("*"):
        try:
            found = tuple(int((device / each).read_text(), 16) for each in ("idVendor", "idProduct"))
            bus, number = (int((device / each).read_text()) for each in ("busnum", "devnum"))
        except (OSError, ValueError):  # this is a port of a hub, or a device that was just unplugged
            continue
        if found == wanted and not os.access(USB_NODES / f"{bus:03d}" / f"{number:03d}", os.W_OK):
            return True
    return False
