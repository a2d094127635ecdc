"""A USB cable through the network: a device served over gRPC, and the proxy that a bus holds instead of it.

Generic methods, bytes in and bytes out; every number is big-endian. An answer begins with the errno of
the transfer (zero: it worked), so that a pulled cable or a timeout looks the same on both ends.
"""

import errno
import os
import struct
from collections.abc import Callable

import grpc

from vibench.acquisition import InstrumentLost
from vibench.acquisition.rig import TOKEN_KEY, given_token

from .usbtmc import Identification, Setup, UsbDevice

SERVICE = "vibench.virtual.UsbDevice"
CONNECT_TIMEOUT_S = 5.0
NETWORK_MARGIN_S = 30.0
"""How much longer than the transfer's own timeout the network may take before the device counts as gone."""
_NEVER_MS = 2**32 - 1

_ERRNO = struct.Struct(">i")
_READ = struct.Struct(">II")
_SETUP = struct.Struct(">BBHHH")
_IDENTIFICATION = struct.Struct(">HHI")
_TEXT_SEPARATOR = "\0"

_Method = Callable[[bytes], bytes]


def usb_service(device: UsbDevice) -> grpc.GenericRpcHandler:
    """Return the handler that serves one device; add it to any ``grpc.Server``, beside other services."""

    def identify(_: bytes) -> bytes:
        found = device.identification
        texts = _TEXT_SEPARATOR.join((found.maker, found.product, found.serial)).encode()
        return _IDENTIFICATION.pack(found.vendor_id, found.product_id, found.packet_bytes) + texts

    def bulk_out(request: bytes) -> bytes:
        device.bulk_out(request)
        return b""

    def control(request: bytes) -> bytes:
        setup = Setup(*_SETUP.unpack_from(request))
        return device.control(setup, request[_SETUP.size :])

    methods: dict[str, _Method] = {
        "Identify": identify,
        "BulkOut": bulk_out,
        "BulkIn": lambda request: device.bulk_in(*_READ.unpack(request)),
        "Control": control,
    }
    handlers = {
        name: grpc.unary_unary_rpc_method_handler(_served(name, act)) for name, act in methods.items()
    }
    return grpc.method_handlers_generic_handler(SERVICE, handlers)


def _served(name: str, act: _Method) -> Callable[[bytes, grpc.ServicerContext], bytes]:
    """Put the outcome of a transfer in front of its answer."""

    def serve(request: bytes, context: grpc.ServicerContext) -> bytes:
        try:
            return _ERRNO.pack(0) + act(request)
        except struct.error as error:
            context.set_code(grpc.StatusCode.INVALID_ARGUMENT)
            context.set_details(
                f"{name} was called with {len(request)} bytes, which are not its numbers ({error}); nothing "
                "reached the device"
            )
            return b""
        except OSError as error:
            return _ERRNO.pack(error.errno or errno.EIO)

    return serve


class RemoteUsbDevice:
    """A device in another process; raises InstrumentLost when nobody serves one at the address."""

    def __init__(self, address: str) -> None:
        self._channel = grpc.insecure_channel(address)
        self._metadata = ((TOKEN_KEY, given_token()),)
        self._methods: dict[str, grpc.UnaryUnaryMultiCallable] = {}
        try:
            answer = self._method("Identify")(b"", timeout=CONNECT_TIMEOUT_S, metadata=self._metadata)
        except grpc.RpcError as error:
            self._channel.close()
            message = (
                f"No virtual rig serves a USB device at {address!r} ({error.code().name}): "
                "start it with 'vibench serve-rig', or give the address it prints."
            )
            raise InstrumentLost(message) from error
        body = answer[_ERRNO.size :]
        vendor_id, product_id, packet_bytes = _IDENTIFICATION.unpack_from(body)
        maker, product, serial = body[_IDENTIFICATION.size :].decode().split(_TEXT_SEPARATOR)
        self._identification = Identification(vendor_id, product_id, maker, product, serial, packet_bytes)

    @property
    def identification(self) -> Identification:
        """What the descriptors say, as of the connection."""
        return self._identification

    def bulk_out(self, data: bytes) -> None:
        """Send one transfer."""
        self._call("BulkOut", data)

    def bulk_in(self, length: int, timeout_ms: int) -> bytes:
        """Receive one transfer."""
        return self._call("BulkIn", _READ.pack(length, timeout_ms), timeout_ms)

    def control(self, setup: Setup, data: bytes) -> bytes:
        """Carry out a class request."""
        packed = _SETUP.pack(setup.request_type, setup.request, setup.value, setup.index, setup.length)
        return self._call("Control", packed + data)

    def close(self) -> None:
        """Close the connection; every later transfer fails with ENODEV. Legal at any time."""
        self._channel.close()

    def _method(self, name: str) -> grpc.UnaryUnaryMultiCallable:
        if name not in self._methods:
            self._methods[name] = self._channel.unary_unary(f"/{SERVICE}/{name}")
        return self._methods[name]

    def _call(self, name: str, request: bytes, timeout_ms: int = 0) -> bytes:
        """Call a method; a dead server or connection is a device that is gone."""
        deadline_s = None if timeout_ms == _NEVER_MS else timeout_ms / 1e3 + NETWORK_MARGIN_S
        try:
            answer = self._method(name)(request, timeout=deadline_s, metadata=self._metadata)
        except (grpc.RpcError, ValueError) as error:  # ValueError: the channel was closed on this side
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV)) from error
        (number,) = _ERRNO.unpack_from(answer)
        if number:
            raise OSError(number, os.strerror(number))
        return bytes(answer[_ERRNO.size :])
