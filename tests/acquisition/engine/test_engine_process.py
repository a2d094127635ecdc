"""A real engine process on the virtual rig: runs, stops, refusals, and lost viewers."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from threading import Event

import numpy as np
import pytest

from tests.frozen import frozen
from vibench.acquisition import (
    CheckRule,
    LimitExceeded,
    RecordingError,
    StopLevel,
    open_recording,
)
from vibench.acquisition.bench import BenchLock
from vibench.acquisition.engine import (
    DRIVING,
    CampaignRequest,
    EngineClient,
    EngineGone,
    EngineState,
    MessageKind,
    Supervision,
    start_engine,
)
from vibench.acquisition.engine._client import EngineAddress
from vibench.acquisition.engine._status import ConnectionRole
from vibench.acquisition.engine._wire import EngineError
from vibench.acquisition.errors import InstrumentBusy
from vibench.acquisition.plan import Campaign
from vibench.acquisition.recording import RecordingState
from vibench.virtual_rig import VirtualRig

from .conftest import campaign, open_rig, until, until_exists, until_state

SILENT_V = 0.02
"""Upper bound of a silent recorded drive: noise and the last step of a ramp."""


def on_server(rig, virtual):
    """Return the rig as a real one, whose instruments are those of another virtual rig."""
    return rig.model_copy(
        update={
            "virtual": None,
            "daq": rig.daq.model_copy(update={"server": virtual.daq_address}),
            "generator": rig.generator.model_copy(update={"resource": virtual.socket_resource}),
        }
    )


def start_run(client, rig, tmp_path, *names):
    open_rig(client, rig)
    client.arm(campaign(*names or ("run",)), tmp_path)
    client.start()
    return until(client, lambda status: status.run is not None and status.run.segment == "dwell")


def stop_events(path, reason):
    """Return the events of a recording, which must end silent and state the reason."""
    until_exists(path)
    with open_recording(path) as recording:
        assert recording.state is RecordingState.STOPPED
        assert re.search(reason, recording.reason), recording.reason
        assert np.max(np.abs(recording.read("drive_voltage", recording.samples - 32))) < SILENT_V
        return [(event.kind, event.text) for event in recording.events]


class TestRuns:
    @pytest.mark.thorough
    def test_opening_checking_arming_running_and_closing_a_bench_succeed(self, client, shipped_rig, tmp_path):
        assert client.status().state is EngineState.CLOSED
        bench = open_rig(client, shipped_rig).bench
        assert bench.is_simulated
        assert bench.identities["generator"].startswith("TEKTRONIX,AFG1022")
        client.check(tmp_path)
        checked = until_state(client, EngineState.READY)
        assert checked.check.verdict == "ok"
        for is_new in (False, True):
            client.check(tmp_path, new_reference=is_new)
            compared = [each.name for each in until_state(client, EngineState.READY).check.findings]
            assert any("since last time" in name for name in compared) is not is_new
        plan = client.arm(campaign("run", duration_s=3.0), tmp_path / "new")
        titles = ["What", "Level", "Closest limit", "Duration", "Saved in", "Without a viewer"]
        assert [line.partition(":")[0] for line in plan.lines] == titles
        # The quantity that is closest to its limit has one of these units.
        assert any(f"{unit} in run" in plan.lines[2] for unit in (" m", " m/s", " m/s2", " N", " A", " V"))
        assert re.fullmatch(
            r"Without a viewer: aborted after [\d.]+ s, or after [\d.]+ s if the window hangs", plan.lines[5]
        )
        assert until_state(client, EngineState.ARMED).armed.expires_in_s > 50
        assert not (tmp_path / "new").exists()
        client.start()
        ended = until(client, lambda status: status.state is EngineState.READY)
        assert [row.state for row in ended.rows] == ["recorded"]
        with open_recording(tmp_path / "new" / "run.h5") as recording:
            assert recording.state is RecordingState.COMPLETE
        client.close_bench()
        until_state(client, EngineState.CLOSED)

    @pytest.mark.thorough
    def test_the_newest_samples_match_the_recording(self, client, shipped_rig, tmp_path):
        start_run(client, shipped_rig, tmp_path)
        newest_samples = client.look(most=10_000)
        client.stop(StopLevel.ABORT)
        until_state(client, EngineState.READY)
        assert newest_samples.volts.shape == (4, 10_000)
        with open_recording(tmp_path / "run.h5") as recording:
            first, last = newest_samples.first_sample, newest_samples.first_sample + 10_000
            recorded = recording.read("m0_velocity", first, last)
            per_volt = recording.channel("m0_velocity").physical_per_volt
        np.testing.assert_allclose(newest_samples.volts[3] * per_volt, recorded, rtol=1e-5, atol=1e-8)

    @pytest.mark.thorough
    def test_a_mark_is_stored_with_its_sample_number(self, client, shipped_rig, tmp_path):
        before = start_run(client, shipped_rig, tmp_path).samples
        client.mark("the sphere was heard")
        client.stop(StopLevel.ABORT)
        until_state(client, EngineState.READY)
        with open_recording(tmp_path / "run.h5") as recording:
            marks = [event for event in recording.events if event.kind == "mark"]
            assert [mark.text for mark in marks] == ["the sphere was heard"]
            assert before <= marks[0].sample <= recording.samples

    @pytest.mark.thorough
    def test_a_held_run_continues_after_resume(self, client, shipped_rig, tmp_path):
        start_run(client, shipped_rig, tmp_path)
        client.stop(StopLevel.HOLD)
        until_state(client, EngineState.HELD)
        client.resume()
        until_state(client, EngineState.RUNNING)

    @pytest.mark.thorough
    def test_a_stop_ends_the_whole_campaign_and_not_only_a_measurement(self, client, shipped_rig, tmp_path):
        start_run(client, shipped_rig, tmp_path, "first", "second")
        client.stop(StopLevel.RAMP, "enough for today")
        rows = until_state(client, EngineState.READY).rows
        assert [row.state for row in rows] == ["stopped", "queued"]
        assert client.status().rows == rows  # rows are sent once, and remain known
        assert ("end", "enough for today") in stop_events(tmp_path / "first.h5", "enough for today")


class TestStoppedChecks:
    def test_any_client_can_stop_a_check(self, client, shipped_rig, tmp_path):
        open_rig(client, shipped_rig)
        client.check(tmp_path)
        client.stop(StopLevel.ABORT, "smoke in the laboratory")
        status = until_state(client, EngineState.READY)
        assert status.check is None
        assert "the bench check was stopped: smoke in the laboratory" in status.messages[-1].what

    def test_a_check_is_stopped_if_its_viewer_has_gone(self, client, shared_engine, real_time_rig, tmp_path):
        open_rig(client, real_time_rig)
        client.check(tmp_path)
        with EngineClient.attach(shared_engine.address) as visitor:
            status = until_state(visitor, EngineState.READY)
        assert status.check is None
        assert [message.what.partition(":")[0] for message in status.messages][-2:] == [
            "The viewer was lost",
            "the bench check was stopped",
        ]

    def test_a_campaign_does_not_start_if_its_check_was_stopped(self, client, shipped_rig, tmp_path):
        open_rig(client, shipped_rig)
        orders = CampaignRequest(campaign=campaign("run"), folder=tmp_path, check=CheckRule.NOW)
        client.arm_request(orders)
        client.start()
        client.stop(StopLevel.RAMP, "not yet")
        status = until_state(client, EngineState.READY)
        assert [row.state for row in status.rows] == ["queued"]
        assert "the bench check was stopped: not yet" in status.messages[-1].what
        assert list(tmp_path.glob("run*")) == []


class TestRefusals:
    def test_requests_not_allowed_in_a_state_are_refused_with_a_readable_message(self, client, tmp_path):
        with pytest.raises(EngineError, match=r"is closed and cannot start now; it must be armed first"):
            client.start()
        with pytest.raises(EngineError, match="cannot mark now"):
            client.mark("too early")
        client.stop(StopLevel.OFF)
        client.disarm()

    def test_arming_a_plan_beyond_a_limit_is_refused(self, client, shipped_rig, tmp_path):
        open_rig(client, shipped_rig)
        low = campaign("low").measurements[0]
        hard = low.excitation.model_copy(update={"amplitude_vpp": 10.0, "frequency_hz": 20.0})
        plan = Campaign(name="hard", measurements=(low.model_copy(update={"excitation": hard}),))
        with pytest.raises(LimitExceeded, match="the stroke"):
            client.arm(plan, tmp_path)
        assert client.status().state is EngineState.READY

    def test_arming_a_plan_that_would_overwrite_a_file_is_refused(self, client, shipped_rig, tmp_path):
        (tmp_path / "run.h5").write_bytes(b"precious")
        open_rig(client, shipped_rig)
        with pytest.raises(RecordingError, match="nothing is ever overwritten"):
            client.arm(campaign("run"), tmp_path)

    def test_a_connection_without_a_token_is_refused(self, shared_engine):
        address = shared_engine.address
        with pytest.raises(EngineError, match="the connection was closed"):
            EngineClient.attach(address.model_copy(update={"token": "guessed"}))

    def test_the_engine_listens_only_on_loopback(self, shared_engine):
        address = shared_engine.address
        assert address.host == "127.0.0.1"
        others = [info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
        for host in {other for other in others if not other.startswith("127.")}:
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((host, address.port), 1.0)

    @pytest.mark.thorough
    @pytest.mark.parametrize(
        "said", [b"GET / HTTP/1.1\r\n\r\n", b"VBE1\xff\xff\xff\xff\xff\xff\xff\xff", b"\0" * 64]
    )
    def test_an_invalid_message_closes_only_the_connection_that_sent_it(self, client, shared_engine, said):
        at = shared_engine.address
        with socket.create_connection((at.host, at.port), 5.0) as stranger:
            stranger.sendall(said)
            with suppress(ConnectionResetError):
                assert stranger.recv(1) == b""
        assert client.status().state is EngineState.CLOSED

    @pytest.mark.skipif(
        sys.platform != "win32" and not hasattr(os, "pwrite"),
        reason="run as Windows here, this process has other locks than its engines",
    )
    @pytest.mark.thorough
    def test_an_engine_cannot_open_a_bench_used_by_another_process(self, engine, shipped_rig):
        with VirtualRig(shipped_rig) as virtual:
            served = on_server(shipped_rig, virtual)
            mine = BenchLock.of(served)
            client = engine().client
            client.open(served)
            fault = until_state(client, EngineState.FAULT).messages[-1]
            assert fault.kind is MessageKind.FAULT
            assert fault.code == InstrumentBusy.__name__
            assert str(os.getpid()) in fault.what
            mine.close()


@pytest.mark.thorough
def test_arming_a_long_campaign_may_exceed_the_answer_timeout(shared_engine, client, shipped_rig, tmp_path):
    """Arming sixty sweeps on a busy computer may exceed the usual answer timeout of five seconds."""
    open_rig(client, shipped_rig)
    sweeps = [
        {
            "name": f"s{number}",
            "excitation": {
                "kind": "sine_sweep", "amplitude_vpp": 0.5, "start_hz": 20 + number, "stop_hz": 600,
                "duration_s": 40,
            },
        }
        for number in range(60)
    ]  # fmt: skip
    many = Campaign.model_validate({"name": "many", "measurements": sweeps})
    with EngineClient.attach(shared_engine.address, ConnectionRole.ATTENDING, patience_s=0.3) as hasty:
        begun_s = time.monotonic()
        plan = hasty.arm(many, tmp_path)
        assert time.monotonic() - begun_s > 0.3
        assert "60 recordings" in plan.lines[0]
        hasty.disarm()


class TestMissingViewers:
    @pytest.mark.thorough
    def test_an_attended_run_is_aborted_when_its_viewer_stops_sending_requests(
        self, client, shipped_rig, tmp_path
    ):
        start_run(client, shipped_rig, tmp_path)
        events = stop_events(
            tmp_path / "run.h5", r"no viewer has sent a request for \d+\.\d s"
        )  # the viewer sends no requests meanwhile
        assert any(kind == "silence" and text.startswith("abort: 0.0") for kind, text in events)
        messages = until_state(client, EngineState.READY).messages
        told = [message for message in messages if message.what.startswith("The viewer was lost")][-1]
        assert told.kind.value == "fault"
        assert "unattended" in told.next_step

    @pytest.mark.thorough
    def test_a_drive_far_from_its_limits_gets_a_longer_viewer_timeout(self, client, shipped_rig, tmp_path):
        """A drive near its limits gets half a second only."""
        open_rig(client, shipped_rig)
        quiet, loud = campaign("run"), campaign("run").model_dump()
        plan = client.arm_request(CampaignRequest(campaign=quiet, folder=tmp_path, longest_patience_s=3.0))
        assert 1.0 < plan.patience_s <= 3.0
        loud["measurements"][0]["excitation"]["amplitude_vpp"] = 9.9
        loud = CampaignRequest(campaign=loud, folder=tmp_path, longest_patience_s=3.0)
        assert client.arm_request(loud).patience_s < 0.6
        client.arm_request(CampaignRequest(campaign=quiet, folder=tmp_path, longest_patience_s=3.0))
        client.start()
        samples = until(client, lambda status: status.run is not None).samples
        Event().wait(0.9)
        assert client.status().state in DRIVING
        until(client, lambda status: status.samples > samples + 50_000)

    @pytest.mark.thorough
    def test_an_unattended_campaign_continues_without_its_window(self, engine, real_time_rig, tmp_path):
        """The engine is attended but this campaign is not; the engine ends after the campaign."""
        process = engine()
        process.client.open(real_time_rig)
        until_state(process.client, EngineState.READY)
        alone = campaign("run", duration_s=3.0)
        process.client.arm_request(
            CampaignRequest(campaign=alone, folder=tmp_path, attendance=Supervision.UNATTENDED)
        )
        process.client.start()
        until(process.client, lambda status: status.run is not None)
        process.leave()
        until_exists(tmp_path / "run.h5")
        with open_recording(tmp_path / "run.h5") as recording:
            assert recording.state is RecordingState.COMPLETE
        assert process._process.wait(20) == 0

    @pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
    @pytest.mark.thorough
    def test_a_run_continues_after_its_engine_was_frozen(self, client, shared_engine, shipped_rig, tmp_path):
        before = start_run(client, shipped_rig, tmp_path).samples
        with frozen(shared_engine.pid):
            Event().wait(1.2)
        until(client, lambda status: status.samples > before + 100_000)

    @pytest.mark.thorough
    def test_an_unattended_run_completes_without_requests(self, engine, real_time_rig, tmp_path):
        process = engine(Supervision.UNATTENDED)
        client = process.client
        open_rig(client, real_time_rig)
        client.arm(campaign("run", duration_s=3.0), tmp_path)
        client.start()
        path = tmp_path / "run.h5"
        until_exists(path)
        with open_recording(path) as recording:
            assert recording.state is RecordingState.COMPLETE


class TestEndOfTheEngine:
    @pytest.mark.thorough
    def test_an_unattended_engine_without_requests_ends_after_a_timeout(self):
        arguments = ["--attendance", "unattended", "--forgotten-s", "1"]
        with subprocess.Popen(
            [sys.executable, "-m", "vibench.acquisition.engine", *arguments],
            stdout=subprocess.PIPE,
            text=True,
        ) as engine:
            address = EngineAddress.model_validate_json(engine.stdout.readline())
            with EngineClient.attach(address, ConnectionRole.ATTENDING) as viewer:
                asked_until_s = time.monotonic() + 2.0
                until(viewer, lambda status: time.monotonic() > asked_until_s)
            assert engine.wait(20) == 0

    @pytest.mark.thorough
    def test_sigterm_ramps_down_the_run_and_ends_the_engine(self, shipped_rig, tmp_path):
        with start_engine() as process:
            start_run(process.client, shipped_rig, tmp_path)
            os.kill(process.pid, signal.SIGTERM)
            stop_events(tmp_path / "run.h5", "SIGTERM")
            process._process.wait(20)
        assert not process.is_alive

    @pytest.mark.thorough
    def test_leaving_the_with_block_of_an_engine_ends_its_run(self, shipped_rig, tmp_path):
        with start_engine() as process:
            start_run(process.client, shipped_rig, tmp_path)
        assert not process.is_alive
        stop_events(tmp_path / "run.h5", "a request ended the engine")

    @pytest.mark.thorough
    def test_a_client_of_a_killed_engine_gets_an_error(self, engine, shipped_rig, tmp_path):
        process = engine()
        start_run(process.client, shipped_rig, tmp_path)
        process._process.kill()
        with pytest.raises(EngineGone, match="switch the amplifier off"):
            until(process.client, lambda status: False)
