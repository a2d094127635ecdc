"""What a USB device is to the bus: descriptors, and transfers that succeed or fail like the real ones.

A device may live in this process or behind a network connection; the bus does not know which.
Transfers fail with OSError: ENODEV when the device is gone, EPIPE when it stalls an endpoint, and
TimeoutError (ETIMEDOUT) when it does not answer in time.
"""

from dataclasses import dataclass
from typing import Protocol

BULK_OUT = 0x01
BULK_IN = 0x82


@dataclass(frozen=True)
class Identification:
    """What a device says about itself when the host enumerates it."""

    vendor_id: int
    product_id: int
    maker: str
    product: str
    serial: str
    packet_bytes: int = 64
    """Largest bulk packet; the real instrument's value is unknown."""

    @property
    def resource_name(self) -> str:
        """The VISA address of the device's instrument interface."""
        return f"USB0::0x{self.vendor_id:04X}::0x{self.product_id:04X}::{self.serial}::INSTR"


@dataclass(frozen=True)
class Setup:
    """The setup packet of a control transfer (USB 2.0, 9.3)."""

    request_type: int
    request: int
    value: int
    index: int
    length: int


class UsbDevice(Protocol):
    """A device with one USBTMC interface, at the level of whole transfers."""

    @property
    def identification(self) -> Identification:
        """What the descriptors say."""

    def bulk_out(self, data: bytes) -> None:
        """Take one transfer from the host."""

    def bulk_in(self, length: int, timeout_ms: int) -> bytes:
        """Hand one transfer of at most ``length`` bytes to the host."""

    def control(self, setup: Setup, data: bytes) -> bytes:
        """Carry out a class request; return what the device sends back."""
