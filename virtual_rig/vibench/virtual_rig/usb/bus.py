"""A USB bus in memory; any program that uses pyvisa-py or PyUSB finds its devices.

For a generator in another process, one call is enough, before or after pyvisa opens its resource manager::

    from vibench.virtual_rig import plug_in_remote
    plug_in_remote("127.0.0.1:31763")

This needs no libusb. While this module's bus is installed, PyUSB sees it *instead of* the machine's own
USB devices; only a new process sees the machine's devices again.
"""

import errno
import importlib
import itertools
import json
import os
import struct
import sys
import threading
from array import array
from collections.abc import Callable
from dataclasses import astuple, dataclass
from types import SimpleNamespace

import grpc
import usb.backend
import usb.backend.libusb1
import usb.core
import usb.util

from vibench.acquisition import ConfigurationError, InstrumentLost
from vibench.acquisition.rig import TOKEN_KEY, token_from_env

from .usbtmc import BULK_IN, BULK_OUT, NEVER_MS, Identification, UsbTmcInstrument

# A USB cable through the network: a device served over gRPC, and a proxy of this device on a bus. Methods
# take and return bytes; numbers are big-endian. A response begins with the errno of the transfer (zero:
# success): a disconnected cable, or a timeout, then looks the same on both ends.

SERVICE = "vibench.virtual.UsbDevice"
CONNECT_TIMEOUT_S = 5.0
NETWORK_MARGIN_S = 30.0
"""Time after the transfer's own timeout at which the device counts as lost [s]."""

_ERRNO = struct.Struct(">i")
_READ = struct.Struct(">II")
_CONTROL = struct.Struct(">BHH")

_Method = Callable[[bytes], bytes]


def usb_service(device: UsbTmcInstrument) -> grpc.GenericRpcHandler:
    """Return the handler that serves one device on a ``grpc.Server``."""

    def bulk_out(request: bytes) -> bytes:
        device.bulk_out(request)
        return b""

    methods: dict[str, _Method] = {
        "Identify": lambda _: json.dumps(astuple(device.identification)).encode(),
        "BulkOut": bulk_out,
        "BulkIn": lambda request: device.bulk_in(*_READ.unpack(request)),
        "Control": lambda request: device.control(*_CONTROL.unpack(request)),
    }
    handlers = {
        name: grpc.unary_unary_rpc_method_handler(_handler(name, act)) for name, act in methods.items()
    }
    return grpc.method_handlers_generic_handler(SERVICE, handlers)


def _handler(name: str, act: _Method) -> Callable[[bytes, grpc.ServicerContext], bytes]:
    """Return a handler that puts the error number of the transfer before the response."""

    def serve(request: bytes, context: grpc.ServicerContext) -> bytes:
        try:
            return _ERRNO.pack(0) + act(request)
        except struct.error as error:
            context.set_code(grpc.StatusCode.INVALID_ARGUMENT)
            context.set_details(
                f"{name} was called with {len(request)} bytes that do not match its parameters ({error}); "
                "nothing reached the device"
            )
            return b""
        except OSError as error:
            return _ERRNO.pack(error.errno or errno.EIO)

    return serve


class RemoteUsbDevice:
    """A device in another process; raises InstrumentLost if no device is served at the address."""

    def __init__(self, address: str) -> None:
        self._channel = grpc.insecure_channel(address)
        self._metadata = ((TOKEN_KEY, token_from_env()),)
        try:
            answer = self._method("Identify")(b"", timeout=CONNECT_TIMEOUT_S, metadata=self._metadata)
        except grpc.RpcError as error:
            self._channel.close()
            message = (
                f"No virtual rig serves a USB device at {address!r} ({error.code().name}): "
                "start it with 'vibench serve-rig', or give the address it prints."
            )
            raise InstrumentLost(message) from error
        self.identification = Identification(*json.loads(answer[_ERRNO.size :]))
        """The device's descriptors at the time of the connection."""

    def bulk_out(self, data: bytes) -> None:
        """Send one transfer to the device."""
        self._call("BulkOut", data)

    def bulk_in(self, length: int, timeout_ms: int) -> bytes:
        """Receive one transfer from the device."""
        return self._call("BulkIn", _READ.pack(length, timeout_ms), timeout_ms)

    def control(self, request: int, value: int, length: int) -> bytes:
        """Execute a class request of the device."""
        return self._call("Control", _CONTROL.pack(request, value, length))

    def close(self) -> None:
        """Close the connection; later transfers fail with ENODEV. Allowed at any time."""
        self._channel.close()

    def _method(self, name: str) -> grpc.UnaryUnaryMultiCallable:
        return self._channel.unary_unary(f"/{SERVICE}/{name}")

    def _call(self, name: str, request: bytes, timeout_ms: int = 0) -> bytes:
        """Call a method of the device; a lost server or connection counts as a disconnected device."""
        deadline_s = None if timeout_ms == NEVER_MS else timeout_ms / 1e3 + NETWORK_MARGIN_S
        try:
            answer = self._method(name)(request, timeout=deadline_s, metadata=self._metadata)
        except (grpc.RpcError, ValueError) as error:  # ValueError: the gRPC channel was closed on this side
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV)) from error
        (number,) = _ERRNO.unpack_from(answer)
        if number:
            raise OSError(number, os.strerror(number))
        return bytes(answer[_ERRNO.size :])


UsbDevice = UsbTmcInstrument | RemoteUsbDevice
"""A device with one USBTMC interface, simulated at the level of whole transfers."""
_GET_DESCRIPTOR = 6
_REQUEST_TYPE_MASK = 0x60


@dataclass(frozen=True, eq=False)
class _Port:
    device: UsbDevice
    address: int


@dataclass(eq=False)
class _Handle:
    port: _Port


class UsbBus(usb.backend.IBackend):  # type: ignore[misc] # PyUSB has no types
    """A PyUSB backend (``usb.backend.IBackend``), whose devices are objects of this process."""

    def __init__(self) -> None:
        self._ports: list[_Port] = []
        self._owners: dict[_Port, _Handle] = {}
        self._addresses = itertools.count(1)
        self._lock = threading.RLock()

    def plug_in(self, device: UsbDevice) -> None:
        """Connect a device; its vendor, product and serial must be unique on the bus."""
        name = device.identification.resource_name
        with self._lock:
            if any(port.device.identification.resource_name == name for port in self._ports):
                message = (
                    f"{name} is already on the virtual USB bus: unplug it first, or give another serial."
                )
                raise ConfigurationError(message)
            self._ports.append(_Port(device, next(self._addresses)))

    def unplug(self, device: UsbDevice) -> None:
        """Disconnect a device, so that programs get ENODEV; do nothing if it is not connected."""
        with self._lock:
            self._ports = [port for port in self._ports if port.device is not device]

    # Enumeration and descriptors

    def enumerate_devices(self) -> list[_Port]:
        """Return all devices connected to the virtual bus."""
        with self._lock:
            return list(self._ports)

    def get_device_descriptor(self, dev: _Port) -> SimpleNamespace:
        """Return the USB descriptor of a device."""
        return SimpleNamespace(
            bLength=_DEVICE_BYTES,
            bDescriptorType=usb.util.DESC_TYPE_DEVICE,
            bcdUSB=0x0200,
            bDeviceClass=0,
            bDeviceSubClass=0,
            bDeviceProtocol=0,
            bMaxPacketSize0=_CONTROL_PACKET_BYTES,
            idVendor=dev.device.identification.vendor_id,
            idProduct=dev.device.identification.product_id,
            bcdDevice=0x0100,
            iManufacturer=_MAKER,
            iProduct=_PRODUCT,
            iSerialNumber=_SERIAL,
            bNumConfigurations=1,
            address=dev.address,
            bus=1,
            port_number=dev.address,
            port_numbers=(dev.address,),
            speed=_HIGH_SPEED,
        )

    def get_configuration_descriptor(self, dev: _Port, config: int) -> SimpleNamespace:  # noqa: ARG002
        """Return a configuration; IndexError for a number past the last."""
        if config != 0:
            raise IndexError(config)
        return SimpleNamespace(
            bLength=_CONFIGURATION_BYTES,
            bDescriptorType=usb.util.DESC_TYPE_CONFIG,
            wTotalLength=_CONFIGURATION_BYTES + _INTERFACE_BYTES + _ENDPOINT_BYTES * len(_ENDPOINTS),
            bNumInterfaces=1,
            bConfigurationValue=1,
            iConfiguration=0,
            bmAttributes=_SELF_POWERED,
            bMaxPower=1,
            extra_descriptors=array("B"),
        )

    def get_interface_descriptor(self, dev: _Port, intf: int, alt: int, config: int) -> SimpleNamespace:  # noqa: ARG002
        """Return an interface; IndexError for a number past the last."""
        if (intf, alt) != (0, 0):
            raise IndexError((intf, alt))
        return SimpleNamespace(
            bLength=_INTERFACE_BYTES,
            bDescriptorType=usb.util.DESC_TYPE_INTERFACE,
            bInterfaceNumber=0,
            bAlternateSetting=0,
            bNumEndpoints=len(_ENDPOINTS),
            bInterfaceClass=_TMC_CLASS,
            bInterfaceSubClass=_TMC_SUBCLASS,
            bInterfaceProtocol=_USB488_PROTOCOL,
            iInterface=0,
            extra_descriptors=array("B"),
        )

    def get_endpoint_descriptor(
        self,
        dev: _Port,
        ep: int,
        intf: int,  # noqa: ARG002 - there is one
        alt: int,  # noqa: ARG002 - there is one
        config: int,  # noqa: ARG002 - there is one
    ) -> SimpleNamespace:
        """Return the endpoint bulk-OUT or bulk-IN (table 9-13); IndexError for a number past the last."""
        return SimpleNamespace(
            bLength=_ENDPOINT_BYTES,
            bDescriptorType=usb.util.DESC_TYPE_ENDPOINT,
            bEndpointAddress=_ENDPOINTS[ep],
            bmAttributes=usb.util.ENDPOINT_TYPE_BULK,
            wMaxPacketSize=dev.device.identification.packet_bytes,
            bInterval=0,
            bRefresh=0,
            bSynchAddress=0,
            extra_descriptors=array("B"),
        )

    # Opening and claiming

    def open_device(self, dev: _Port) -> _Handle:
        """Open a device that is still connected."""
        handle = _Handle(dev)
        self._present(handle)
        return handle

    def close_device(self, dev_handle: _Handle) -> None:
        """Close a device and release its interface."""
        self.release_interface(dev_handle, 0)

    def set_configuration(self, dev_handle: _Handle, config_value: int) -> None:  # noqa: ARG002 - there is one
        """Accept the only USB configuration of the device."""
        self._present(dev_handle)

    def get_configuration(self, dev_handle: _Handle) -> int:
        """Return the only USB configuration of the device."""
        self._present(dev_handle)
        return 1

    def claim_interface(self, dev_handle: _Handle, intf: int) -> None:  # noqa: ARG002 - there is one
        """Claim the interface exclusively; EBUSY if another handle has claimed it, as with libusb."""
        self._present(dev_handle)
        with self._lock:
            if self._owners.setdefault(dev_handle.port, dev_handle) is not dev_handle:
                raise usb.core.USBError("Resource busy", errno=errno.EBUSY)

    def release_interface(self, dev_handle: _Handle, intf: int) -> None:  # noqa: ARG002 - there is one
        """Release the claimed interface of the device."""
        with self._lock:
            if self._owners.get(dev_handle.port) is dev_handle:
                del self._owners[dev_handle.port]

    # Transfers

    def bulk_write(self, dev_handle: _Handle, ep: int, intf: int, data: array, timeout: int) -> int:  # type: ignore[type-arg]  # noqa: ARG002
        """Send one transfer; return the number of bytes sent."""
        device = self._present(dev_handle)
        with _usb_errors():
            device.bulk_out(data.tobytes())
        return len(data) * data.itemsize

    def bulk_read(self, dev_handle: _Handle, ep: int, intf: int, buff: array, timeout: int) -> int:  # type: ignore[type-arg]  # noqa: ARG002
        """Fill the buffer from one transfer; return the number of bytes received."""
        device = self._present(dev_handle)
        with _usb_errors():
            return _fill(buff, device.bulk_in(len(buff), timeout))

    def ctrl_transfer(
        self,
        dev_handle: _Handle,
        bmRequestType: int,
        bRequest: int,
        wValue: int,
        wIndex: int,  # noqa: ARG002 - there is one interface
        data: array,  # type: ignore[type-arg]
        timeout: int,  # noqa: ARG002 - control transfers are instantaneous
    ) -> int:
        """Answer requests for string descriptors, and pass class requests to the device."""
        device = self._present(dev_handle)
        incoming = usb.util.ctrl_direction(bmRequestType) == usb.util.CTRL_IN
        if bmRequestType & _REQUEST_TYPE_MASK == usb.util.CTRL_TYPE_STANDARD:
            # PyUSB requests only strings, by GET_DESCRIPTOR (USB 2.0, 9.4.3). Other requests stall.
            kind, index = divmod(wValue, 256)
            found = device.identification
            texts = {_MAKER: found.maker, _PRODUCT: found.product, _SERIAL: found.serial}
            bodies = {0: _ENGLISH} | {number: text.encode("utf-16-le") for number, text in texts.items()}
            if bRequest != _GET_DESCRIPTOR or kind != usb.util.DESC_TYPE_STRING or index not in bodies:
                raise usb.core.USBError("Pipe error", errno=errno.EPIPE)
            return _fill(data, (bytes([len(bodies[index]) + 2, kind]) + bodies[index])[: len(data)])
        with _usb_errors():
            reply = device.control(bRequest, wValue, len(data))  # no class request of pyvisa carries data
        return _fill(data, reply) if incoming else len(data)

    def _present(self, handle: _Handle) -> UsbDevice:
        """Return the device of a handle; ENODEV if it was disconnected."""
        with self._lock:
            if handle.port not in self._ports:
                raise usb.core.USBError("No such device (it may have been disconnected)", errno=errno.ENODEV)
        return handle.port.device


def _fill(buffer: array, data: bytes) -> int:  # type: ignore[type-arg]
    buffer[: len(data)] = array("B", data)
    return len(data)


class _usb_errors:  # noqa: N801 - reads as a verb where it is used
    """Context that converts a device's OSError to the errors of PyUSB's own backends.

    A generator function would not work: from Python 3.13 on, its frame keeps a failed session's handle.
    """

    def __enter__(self) -> None:
        """Do nothing."""

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        match error:
            case TimeoutError():
                raise usb.core.USBTimeoutError("Operation timed out", errno=errno.ETIMEDOUT) from error
            case OSError():
                raise usb.core.USBError(error.strerror, errno=error.errno) from error


_BUS = UsbBus()


def plug_in(device: UsbDevice) -> None:
    """Connect a device to the virtual bus, which PyUSB, and thus pyvisa-py, uses from then on.

    Without libusb, pyvisa-py registers no USB sessions at its first import; in that case this function
    registers them.
    """
    _BUS.plug_in(device)
    usb.backend.libusb1.get_backend = lambda find_library=None: _BUS  # noqa: ARG005 - PyUSB's signature
    if "pyvisa_py" in sys.modules and "pyvisa_py.usb" not in sys.modules:
        importlib.import_module("pyvisa_py.usb")


def unplug(device: UsbDevice) -> None:
    """Disconnect a device from the virtual bus; do nothing if the device is not connected."""
    _BUS.unplug(device)


def plug_in_remote(address: str) -> RemoteUsbDevice:
    """Connect the generator of a rig in another process to this process's bus.

    ``address`` is ``"host:port"`` of the rig's server. Raises InstrumentLost when no rig answers there.
    """
    device = RemoteUsbDevice(address)
    plug_in(device)
    return device


_TMC_CLASS, _TMC_SUBCLASS, _USB488_PROTOCOL = 0xFE, 3, 1
_MAKER, _PRODUCT, _SERIAL = 1, 2, 3
_ENGLISH = (0x0409).to_bytes(2, "little")
_HIGH_SPEED = 3
_CONTROL_PACKET_BYTES = 64
_DEVICE_BYTES, _CONFIGURATION_BYTES, _INTERFACE_BYTES, _ENDPOINT_BYTES = 18, 9, 9, 7
_SELF_POWERED = 0xC0
_ENDPOINTS = (BULK_OUT, BULK_IN)
