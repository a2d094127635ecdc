"""A simulated USB generator behind a gRPC server, opened by a remote client."""

import errno
from concurrent.futures import ThreadPoolExecutor

import grpc
import pytest

from vibench.acquisition import InstrumentLost
from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.usb.bus import RemoteUsbDevice, usb_service
from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument


class Rig:
    """A generator behind a gRPC server on a free port."""

    def __init__(self):
        self.generator = AFG1022(lambda: 0.0)
        self.cable = UsbTmcInstrument(self.generator)
        self.server = grpc.server(ThreadPoolExecutor(max_workers=4))
        self.server.add_generic_rpc_handlers((usb_service(self.cable),))
        self.address = f"127.0.0.1:{self.server.add_insecure_port('127.0.0.1:0')}"
        self.server.start()

    def close(self):
        self.server.stop(grace=None).wait()


@pytest.fixture
def rig():
    one = Rig()
    yield one
    one.close()


@pytest.fixture
def proxy(rig):
    device = RemoteUsbDevice(rig.address)
    yield device
    device.close()


def test_the_usb_proxy_has_the_descriptors_of_the_device(rig, proxy):
    assert proxy.identification == rig.cable.identification


def test_the_usb_proxy_passes_bulk_and_control_transfers_unchanged(rig, proxy):
    proxy.bulk_out(bytes([1, 1, 254, 0, 5, 0, 0, 0, 1, 0, 0, 0]) + b"*OPC?\0\0\0")
    proxy.bulk_out(bytes([2, 2, 253, 0, 64, 0, 0, 0, 0, 0, 0, 0]))
    assert proxy.bulk_in(64, 1000)[12:14] == b"1\n"
    assert proxy.control(3, 5, 2) == bytes([0x81, 0])


def test_the_usb_proxy_raises_the_errors_of_a_timeout_and_of_a_stall(proxy):
    with pytest.raises(TimeoutError):
        proxy.bulk_in(64, 1000)
    with pytest.raises(BrokenPipeError):
        proxy.bulk_out(b"")
    proxy.bulk_out(bytes([1, 1, 254, 0, 4, 0, 0, 0, 1, 0, 0, 0]) + b"*CLS")


def test_a_pulled_cable_and_a_dead_server_raise_the_error_no_such_device(rig, proxy):
    rig.cable.fail(errno.ENODEV)
    with pytest.raises(OSError, match="No such device") as pulled:
        proxy.bulk_out(bytes(12))
    rig.cable.mend(errno.ENODEV)
    rig.close()
    with pytest.raises(OSError, match="No such device") as dead:
        proxy.bulk_out(bytes(12))
    assert pulled.value.errno == dead.value.errno == errno.ENODEV


def test_a_connection_that_the_client_closed_raises_the_error_no_such_device(proxy):
    proxy.close()
    with pytest.raises(OSError, match="No such device") as error:
        proxy.bulk_in(64, 1000)
    assert error.value.errno == errno.ENODEV


def test_an_address_where_no_rig_answers_is_named_in_the_error():
    with pytest.raises(InstrumentLost, match=r"127\.0\.0\.1:1.*vibench serve-rig"):
        RemoteUsbDevice("127.0.0.1:1")


@pytest.mark.parametrize("method", ["BulkIn", "Control"])
def test_a_frame_that_is_too_short_is_refused_with_a_readable_message(rig, method):
    with grpc.insecure_channel(rig.address) as channel:
        call = channel.unary_unary(f"/vibench.virtual.UsbDevice/{method}")
        with pytest.raises(grpc.RpcError) as refused:
            call(b"", timeout=5)
    assert refused.value.code() is grpc.StatusCode.INVALID_ARGUMENT
    assert f"{method} was called with 0 bytes" in refused.value.details()
