"""A rig that is reachable from other computers refuses clients without its token."""

import grpc
import nidaqmx
import pytest
from nidaqmx import GrpcSessionOptions

from tests.changed import changed
from vibench.acquisition import InstrumentLost, open_bench
from vibench.acquisition.rig import TOKEN_VARIABLE, CalibrationRule, confirm_simulated, load_rig
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.daqmx.server import token_for
from vibench.virtual_rig.usb.bus import RemoteUsbDevice


@pytest.fixture
def served_rig(pytestconfig):
    rig = load_rig("virtual_rig")
    resource = "USB0::0x0699::0x0353::TOKEN::INSTR"
    rig = changed(rig, generator={"resource": resource})
    with VirtualRig(rig, "0.0.0.0:0") as virtual:
        yield virtual, virtual.daq_address.replace("0.0.0.0", "127.0.0.1")


def remote_rig(virtual, address):
    return changed(virtual.rig, virtual=None, daq={"server": address})


def bench_on(rig):
    return open_bench(rig, confirm=confirm_simulated, calibration=CalibrationRule.WAIVED)


def test_loopback_needs_no_token_but_every_other_address_needs_a_token():
    assert token_for("127.0.0.1:31763") is None
    assert token_for("localhost:0") is None
    assert token_for("0.0.0.0:31763") != token_for("192.168.0.7:31763")


def test_a_client_without_a_token_reaches_neither_the_converter_nor_the_usb_cable(served_rig):
    _, address = served_rig
    with (
        grpc.insecure_channel(address) as channel,
        pytest.raises(nidaqmx.errors.RpcError, match=r"UNAUTHENTICATED|served with a token"),
    ):
        nidaqmx.Task(grpc_options=GrpcSessionOptions(channel, ""))
    with pytest.raises(InstrumentLost, match="UNAUTHENTICATED"):
        RemoteUsbDevice(address)


def test_a_bench_with_the_token_is_accepted(served_rig, monkeypatch):
    virtual, address = served_rig
    monkeypatch.setenv(TOKEN_VARIABLE, virtual.token)
    with bench_on(remote_rig(virtual, address)) as bench:
        assert bench.digitizer.identity.model == "NI 9234"
    remote = RemoteUsbDevice(address)
    assert remote.identification.product == "AFG1022"
    remote.close()


def test_a_wrong_token_is_refused(served_rig, monkeypatch):
    virtual, address = served_rig
    monkeypatch.setenv(TOKEN_VARIABLE, virtual.token[:-1])
    with pytest.raises(InstrumentLost, match="UNAUTHENTICATED"):
        RemoteUsbDevice(address)
