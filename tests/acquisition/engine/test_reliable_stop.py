"""A stop reaches a living engine despite stalls, other connections, and missing descriptors."""

import json
import os
import shutil
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Event

import pytest

from tests.frozen import frozen
from vibench.acquisition import StopLevel, open_recording
from vibench.acquisition.engine import (
    EngineClient,
    EngineGone,
    EngineSilent,
    EngineState,
    MessageKind,
    StopDelivery,
    Supervision,
    announced_engines,
    start_engine,
    stop_engine,
    the_engine,
)
from vibench.acquisition.engine._client import Announcement
from vibench.acquisition.engine._server import GREETING_S, VIEWERS_MOST, WAITING_MOST
from vibench.acquisition.engine._status import ConnectionRole
from vibench.acquisition.engine._verbs import VERBS
from vibench.acquisition.engine._wire import HEAD, MAGIC, send
from vibench.acquisition.rig import load_rig
from vibench.acquisition.stopping.program import engines_folder
from vibench.sim.operating_system.this import process_start
from vibench.stop_files import stop_path, write_stop_file

from .conftest import campaign, until, until_exists, until_state

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="stalls and descriptors as Linux has them")

PAUSE = Event()
resource = pytest.importorskip("resource", reason="limits of a process as POSIX has them")


@pytest.fixture(scope="module")
def one_state(tmp_path_factory):
    """One state folder for all tests, in which the engine of this module is found."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("state")
        patch.setenv("VIBENCH_STATE_DIR", str(folder))
        yield folder


@pytest.fixture(autouse=True)
def own_state(one_state):
    """Replace the fixture that makes a state folder for each test."""


@pytest.fixture(scope="module")
def process(one_state):
    """An unattended engine with an open bench; starting one takes seconds."""
    with start_engine(Supervision.UNATTENDED) as process:
        process.client.open(load_rig("virtual_rig"))
        until_state(process.client, EngineState.READY)
        yield process


@pytest.fixture
def running(process, tmp_path):
    """The engine in the middle of a long dwell."""
    with suppress(EngineGone):  # the engine may have disconnected this viewer
        process.client.close()
    process.client = EngineClient.attach(process.address, ConnectionRole.ATTENDING)
    process.client.arm(campaign("run"), tmp_path)
    process.client.start()
    until(process.client, lambda status: status.run is not None and status.run.segment == "dwell")
    yield process
    stop_engine(the_engine(None), StopLevel.OFF, "the test has ended")
    with EngineClient.attach(process.address) as visitor:
        until_state(visitor, EngineState.READY)


@contextmanager
def connections(address, count, said=b""):
    """Open connections that send nothing or the beginning of a message."""
    with ExitStack() as all_of_them:
        for _ in range(count):
            each = all_of_them.enter_context(socket.socket())
            each.setblocking(False)
            each.connect_ex((address.host, address.port))
            if said:
                with suppress(OSError):
                    each.send(said)
        yield


@contextmanager
def without_descriptors(process):
    """Leave a process no free file descriptor."""
    before = resource.prlimit(process.pid, resource.RLIMIT_NOFILE)
    highest = max(int(each.name) for each in Path(f"/proc/{process.pid}/fd").iterdir())
    # Descriptors that the process closes from now on can be used again.
    resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (highest + 1, before[1]))
    try:
        yield
    finally:
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, before)


def require_ending(tmp_path, reason):
    until_exists(tmp_path / "run.h5")
    with open_recording(tmp_path / "run.h5") as recording:
        assert recording.reason == reason
        return recording


class TestStalls:
    @pytest.mark.thorough
    def test_a_stop_requested_while_the_engine_stalls_is_carried_out_after_the_stall(self, running, tmp_path):
        with frozen(running.pid):
            told = the_engine(None)
            assert told.pid == running.pid
            assert stop_engine(told, StopLevel.ABORT, "smoke") is StopDelivery.KEPT
            assert [each.pid for each in announced_engines()] == [running.pid]
        require_ending(tmp_path, "smoke")
        assert list(engines_folder().glob("*.stop-*")) == []

    @pytest.mark.thorough
    def test_a_stop_after_a_stall_is_confirmed_by_the_engine(self, running, tmp_path):
        with frozen(running.pid), pytest.raises(EngineSilent, match=r"does not answer within 0\.3 s"):
            EngineClient.attach(running.address, patience_s=0.3)
        assert stop_engine(the_engine(running.pid), "abort", "afterwards") is StopDelivery.TOLD
        require_ending(tmp_path, "afterwards")


class TestConnectionsWithoutToken:
    @pytest.mark.thorough
    def test_two_thousand_idle_connections_do_not_block_a_stop(self, running, tmp_path):
        before = len(list(Path(f"/proc/{running.pid}/fd").iterdir()))
        with connections(running.address, 2000):
            stop_engine(the_engine(None), StopLevel.ABORT, "in spite of all")
            require_ending(tmp_path, "in spite of all")
            now = len(list(Path(f"/proc/{running.pid}/fd").iterdir()))
            assert now <= before + WAITING_MOST + VIEWERS_MOST

    def test_the_declared_size_of_a_message_reserves_no_memory(self, process):
        process.client.status()
        before = resident_bytes(process.pid)
        with connections(process.address, 150, HEAD.pack(MAGIC, 32_000_000, 64_000_000) + bytes(8000)):
            for _ in range(20):
                EngineClient.attach(process.address).close()
            assert resident_bytes(process.pid) - before < 20e6

    @pytest.mark.thorough
    def test_a_slow_connection_has_a_single_deadline_for_its_whole_message(self, process):
        at = process.address
        with socket.create_connection((at.host, at.port)) as slow:
            slow.sendall(HEAD.pack(MAGIC, 900, 0))
            began_s = time.monotonic()
            slow.settimeout(0.05)
            while time.monotonic() < began_s + 2 * GREETING_S:
                with suppress(BrokenPipeError):
                    slow.send(b" ")
                try:
                    if slow.recv(1) == b"":
                        break
                except TimeoutError:
                    continue
                except ConnectionResetError:
                    break
            assert GREETING_S * 0.9 < time.monotonic() - began_s < GREETING_S * 1.5

    def test_the_least_active_viewer_is_disconnected_when_too_many_viewers_are_connected(self, process):
        with ExitStack() as viewers:
            attached = [
                viewers.enter_context(EngineClient.attach(process.address)) for _ in range(VIEWERS_MOST + 3)
            ]
            attached[-1].status()
            process.client.status()  # the attending viewer stays; visitors are disconnected first
            with pytest.raises(EngineGone):
                attached[0].status()


@pytest.mark.thorough
def test_a_frozen_viewer_does_not_block_the_engine(running):
    with EngineClient.attach(running.address) as silent:
        # requests much data and reads nothing
        for _ in range(20):
            send(silent._connection, VERBS["look"].message(most=500_000))
        before = running.client.status().samples
        until(running.client, lambda status: status.samples > before + 100_000)


class TestMissingDescriptors:
    @pytest.mark.thorough
    def test_a_stop_works_without_free_file_descriptors(self, running, tmp_path):
        with without_descriptors(running):
            stop_engine(the_engine(None), StopLevel.ABORT, "no descriptors")
            require_ending(tmp_path, "no descriptors")

    @pytest.mark.thorough
    def test_a_stop_file_ends_the_run_without_free_file_descriptors(self, running, tmp_path):
        with without_descriptors(running):
            write_stop_file(
                stop_path(str(engines_folder()), running.pid, process_start(running.pid), "abort"), "put down"
            )
            until_exists(tmp_path / "run.h5")


class TestRemovedFolder:
    def test_the_engine_reports_a_removed_folder_and_continues(self, running, tmp_path):
        shutil.rmtree(tmp_path)
        told = until_state(running.client, EngineState.READY).messages[-1]
        assert told.kind is MessageKind.FAULT
        assert "was removed" in told.what + told.done + told.next_step


def resident_bytes(pid):
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class TestAnnouncements:
    @pytest.mark.thorough
    def test_an_announcement_whose_process_number_was_reused_is_ignored(self, process):
        told = the_engine(process.pid)
        with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
            taken = told.model_copy(update={"pid": other.pid, "process_start": "1"})
            path = engines_folder() / f"{other.pid}.json"
            path.write_text(taken.model_dump_json())
            assert [each.pid for each in announced_engines()] == [process.pid]
            path.unlink()
            other.stdin.close()

    @pytest.mark.thorough
    def test_announcements_of_another_computer_are_kept(self, process):
        told = the_engine(process.pid)
        path = engines_folder() / "4.json"
        path.write_text(told.model_copy(update={"pid": 4, "computer": "elsewhere"}).model_dump_json())
        assert [each.pid for each in announced_engines()] == [process.pid]
        assert Announcement.model_validate(json.loads(path.read_text())).computer == "elsewhere"
        path.unlink()
