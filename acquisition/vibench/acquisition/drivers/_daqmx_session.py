"""The way to the DAQmx driver: on this computer, or by gRPC, with an end to every wait."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import grpc
from nidaqmx import GrpcSessionOptions
from nidaqmx.system import System

from ..instruments import FoundDevice
from ..rig import TOKEN_KEY, given_token
from ._daqmx_errors import daqmx_call

# Longer than any single read (`daqmx.LONGEST_READ_S` plus its margin): a server that is silent for
# so long is gone, even if its connection still stands.
CALL_DEADLINE_S = 60.0
# A second of four channels at the highest rate is beyond gRPC's default of 4 MB.
_NO_LIMIT = -1
_CHANNEL_OPTIONS = (
    ("grpc.max_receive_message_length", _NO_LIMIT),
    ("grpc.max_send_message_length", _NO_LIMIT),
)


class _Deadline(grpc.UnaryUnaryClientInterceptor):  # type: ignore[misc] # grpc ships without types
    """Ends every call that takes too long, and carries the token; the DAQmx client itself does neither."""

    def intercept_unary_unary(self, continuation: Callable[..., Any], details: Any, request: Any) -> Any:
        # A namedtuple's _replace is public in spite of its underscore.
        carried = ((TOKEN_KEY, given_token()),) if given_token() else ()
        metadata = (*(details.metadata or ()), *carried)
        return continuation(details._replace(timeout=CALL_DEADLINE_S, metadata=metadata), request)


@dataclass(frozen=True)
class DaqmxSession:
    """An address and the connection to it; close it after everything that was opened through it."""

    server: str | None
    """``"host:port"``; None for the driver on this computer."""
    options: GrpcSessionOptions | None
    _channel: grpc.Channel | None

    @property
    def place(self) -> str:
        """Where the driver runs, for errors."""
        return "this computer" if self.server is None else f"the device server at {self.server}"

    def system(self) -> System:
        """Return access to devices and driver version."""
        return System.local() if self.options is None else System.remote(self.options)

    def close(self) -> None:
        """Close the connection. Legal at any time."""
        if self._channel is not None:
            self._channel.close()


def daqmx_session(server: str | None) -> DaqmxSession:
    """Prepare the way to a driver; nothing is contacted before the first call."""
    if server is None:
        return DaqmxSession(None, None, None)
    channel = grpc.insecure_channel(server, options=_CHANNEL_OPTIONS)
    options = GrpcSessionOptions(grpc.intercept_channel(channel, _Deadline()), "")
    return DaqmxSession(server, options, channel)


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
