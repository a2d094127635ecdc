"""A window that is killed or frozen during a run: silence soon after, and the recording kept."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from threading import Event

import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.engine import EngineState, Supervision, announced_engines
from vibench.acquisition.recording import RecordingState
from vibench.gui.page._app_context import USUAL_PATIENCE_S
from vibench.gui.widgets import RUN

ROOT = Path(__file__).resolve().parents[2]
SILENT_WITHIN_S = {"SIGKILL": 1.0, "SIGSTOP": USUAL_PATIENCE_S + 1.0}
"""From the signal to zero drive, on the wall's clock: the end of a process is known at once."""
PATIENCE_S = 60.0
PAUSE = Event()


@contextmanager
def measuring_window(folder, attendance, state):
    """A process whose window measures, until killed at the end."""
    child = Path(__file__).with_name("window_child.py")
    rig = ROOT / "hardware_configs" / "virtual_rig.toml"
    window = subprocess.Popen(
        [sys.executable, str(child), str(folder), str(rig), attendance.value],
        env={**os.environ, "PYTHONPATH": str(ROOT), "VIBENCH_STATE_DIR": str(state)},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert window.stdout.readline() == "running\n"
        yield window
    finally:
        window.kill()
        window.wait()
        window.stdout.close()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has neither signal")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.timeout(300)
def test_a_window_that_dies_or_freezes_leaves_silence(tmp_path, number):
    with measuring_window(tmp_path, Supervision.ATTENDED, tmp_path / "state") as window:
        window.send_signal(number)
        signalled_s = time.time()
        path = tmp_path / "recordings" / "run.h5"
        while not path.exists():
            assert time.time() < signalled_s + PATIENCE_S, "the recording was never finished"
            PAUSE.wait(0.01)
    with open_recording(path) as recording:
        assert recording.state is RecordingState.STOPPED
        assert "nobody has looked" in recording.reason or "has ended" in recording.reason
        # Noted when the last, verified setting of the ramp has been made; the tests of the engine look at
        # the drive itself.
        silent_s = next(event.unix_time_s for event in recording.events if event.kind == "silence")
        assert recording.samples > 0
    assert silent_s - signalled_s < SILENT_WITHIN_S[number.name]


@pytest.mark.timeout(300)
def test_what_was_left_alone_is_shown_by_the_next_window_which_then_looks_after_it(window, qtbot, tmp_path):
    bridge, left = window.context.bridge, tmp_path / "left"
    with measuring_window(left, Supervision.UNATTENDED, os.environ["VIBENCH_STATE_DIR"]):
        window.look_for_left_campaign()
        qtbot.waitUntil(lambda: not window.context.background.is_busy, timeout=100_000)
        assert bridge.engine_pid is None, "it has a window that looks after it"
    window.look_for_left_campaign()
    qtbot.waitUntil(lambda: bridge.state is EngineState.RUNNING, timeout=100_000)
    assert window.page is window.pages[RUN]
    assert "trial" in window.strip.notices[-1].what
    assert window.context.selection.campaign == bridge.campaign
    assert bridge.may_leave
    qtbot.waitUntil(lambda: bridge.view is not None and bridge.view.next_sample > 0, timeout=10_000)
    window.user_actions.abort()
    qtbot.waitUntil(lambda: bridge.state is EngineState.READY, timeout=10_000)
    with open_recording(left / "recordings" / "run.h5") as recording:
        assert recording.state is RecordingState.STOPPED
    qtbot.wait(1000)  # as long as its engine would take to see that it has nothing more to do alone
    assert bridge.state is EngineState.READY
    assert [each.pid for each in announced_engines()] == [bridge.engine_pid]
    bridge.close()
    assert announced_engines() == ()
