"""The keep-alive process alone sends requests for a window; it reports when the window is blocked."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from threading import Event
from time import monotonic

import pytest

from vibench.acquisition.engine import DRIVING, VIEWER_PATIENCE_S, Attendant, EngineClient, EngineState
from vibench.acquisition.engine._status import hung_patience_s
from vibench.sim.operating_system.this import process_start

from .conftest import campaign, open_rig, until, until_state

PROGRAM = """
import sys
from threading import Event, Thread
from vibench.acquisition.engine import Attendant
from vibench.acquisition.engine._client import EngineAddress
attendant, hanging = Attendant(EngineAddress.model_validate_json(sys.argv[1])), Event()
print(attendant.pid, flush=True)
Thread(target=lambda: (sys.stdin.readline(), hanging.set()), daemon=True).start()
while not hanging.wait(0.03):
    attendant.live()
Event().wait()
"""


def start_run(process, rig, folder):
    """Start a run and return a client that watches it without attending."""
    client = process.client
    client.open(rig)
    until_state(client, EngineState.READY)
    client.arm(campaign("attended"), folder)
    client.start()
    until(client, lambda status: status.run is not None)  # `samples` may still be those of an earlier run
    return EngineClient.attach(process.address)


@contextmanager
def watched_program(process):
    """Run a program that can be made to block; yields it and the number of its keep-alive process."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, process.address.model_dump_json()],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        try:
            yield program, int(program.stdout.readline())
        finally:
            program.kill()


@pytest.mark.parametrize(("granted_s", "hung_s"), [(0.5, 2.0), (2.0, 8.0), (4.0, 10.0), (10.0, 10.0)])
def test_a_blocked_window_gets_four_times_its_timeout_but_at_most_10_s(granted_s, hung_s):
    assert hung_patience_s(granted_s) == hung_s


@pytest.mark.thorough
def test_the_keep_alive_process_reports_a_blocked_window_and_ends_the_run(
    client, shared_engine, shipped_rig, tmp_path
):
    process = shared_engine
    with watched_program(process) as (program, _), start_run(process, shipped_rig, tmp_path) as visitor:
        Event().wait(2.0)
        assert visitor.status().state in DRIVING
        hung_s = monotonic()
        print(file=program.stdin, flush=True)
        status = until_state(visitor, EngineState.READY)
    assert "is blocked" in status.rows[0].reason
    assert monotonic() - hung_s > hung_patience_s(VIEWER_PATIENCE_S)


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a stopped program hangs")
def test_the_keep_alive_process_sends_no_request_while_its_window_is_suspended(
    client, shared_engine, shipped_rig, tmp_path
):
    process = shared_engine
    with watched_program(process) as (program, _), start_run(process, shipped_rig, tmp_path) as visitor:
        os.kill(program.pid, signal.SIGSTOP)
        status = until_state(visitor, EngineState.READY)
    assert "no viewer has" in status.rows[0].reason
    assert "is blocked" not in status.rows[0].reason


def test_a_window_blocked_earlier_does_not_end_a_new_run(client, shared_engine, shipped_rig, tmp_path):
    open_rig(client, shipped_rig)
    client.heartbeat(60.0)
    client.arm(campaign("attended"), tmp_path)
    client.start()
    assert until(client, lambda status: status.run is not None).state in DRIVING


@pytest.mark.thorough
def test_the_keep_alive_process_ends_when_its_program_is_killed(client, shared_engine, shipped_rig, tmp_path):
    process = shared_engine
    with watched_program(process) as (program, pid), start_run(process, shipped_rig, tmp_path) as visitor:
        program.kill()
        status = until_state(visitor, EngineState.READY)
    assert "no viewer has" in status.rows[0].reason
    clock = Event()
    for _ in range(500):
        if process_start(pid) is None:  # true even before the operating system has removed the process
            break
        clock.wait(0.02)
    assert process_start(pid) is None


@pytest.mark.thorough
def test_a_killed_keep_alive_process_is_replaced(shared_engine):
    attendant, clock = Attendant(shared_engine.address), Event()
    first = attendant.pid
    os.kill(first, signal.SIGTERM)
    for _ in range(200):
        attendant.live()
        if attendant.pid != first:
            break
        clock.wait(0.05)
    assert attendant.pid != first
    attendant.close()
    attendant.close()
