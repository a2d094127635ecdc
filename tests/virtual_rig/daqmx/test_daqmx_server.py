"""The simulated DAQ as a server: shared port, disconnected clients, restarts, and closing."""

import threading

import numpy as np
import pytest
from nidaqmx import Task
from nidaqmx.constants import WAIT_INFINITELY
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError

from vibench.acquisition import ConfigurationError
from vibench.virtual_rig.daqmx.server import DaqServer

PATIENCE_S = 20.0


def restart(daq):
    """Remove the server for a moment; its tasks end with the next call."""
    daq.server.faults.add(None)()


def test_messages_of_many_megabytes_are_accepted_by_the_server(daq):
    task = daq.inputs("Dev1/ai1:2", 100e3)
    assert np.shape(task.read(400_000)) == (2, 400_000)


def test_a_restart_of_the_server_ends_a_blocked_read(connect):
    daq = connect()
    task = Task(grpc_options=daq.options)
    task.ai_channels.add_ai_voltage_chan("Dev1/ai1")
    task.timing.cfg_samp_clk_timing(1000)
    task.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev1/PFI0")
    task.start()
    ends = []

    def read_for_ever():
        try:
            task.read(10, timeout=WAIT_INFINITELY)
        except DaqError as error:
            ends.append(error.error_code)

    reader = threading.Thread(target=read_for_ever)
    reader.start()
    restart(daq)
    daq.task()
    reader.join(PATIENCE_S)
    assert not reader.is_alive()
    # The restart may come during the read or just before it; both are allowed.
    assert ends[0] in (DAQmxErrors.RUNTIME_ABORTED_ROUTING, DAQmxErrors.INVALID_TASK)
    task._close_on_exit, task._handle = False, None


def test_closing_ends_every_thread_of_the_server(connect):
    before = {thread.name for thread in threading.enumerate()}
    daq = connect()
    Task(grpc_options=daq.options).close()
    daq.server.close()
    daq.server.close()
    after = {thread.name for thread in threading.enumerate()}
    assert not [name for name in after - before if name.startswith(("daqmx", "rig clock"))]


def test_an_address_in_use_is_refused_with_a_readable_message(daq):
    with pytest.raises(ConfigurationError, match=f"{daq.server.address}.*port 0"):
        DaqServer(daq.world, address=daq.server.address)


def test_the_simulated_daq_listens_on_loopback_by_default(daq):
    assert daq.server.address.startswith("127.0.0.1:")


@pytest.mark.parametrize("address", ["nonsense", "127.0.0.1:99999", "127.0.0.1:-5", ":80", "127.0.0.1:"])
def test_invalid_addresses_are_refused_before_listening(connect, address):
    with pytest.raises(ConfigurationError, match="Give HOST:PORT"):
        connect(address=address)
