"""After a window is killed or frozen, the drive is soon silent and the recording is kept."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from tests.windows_here import sees_locks
from vibench.acquisition import open_recording
from vibench.acquisition.engine import (
    VIEWER_PATIENCE_S,
    EngineState,
    Supervision,
    announced_engines,
    unattended_engine,
)
from vibench.acquisition.recording import EventKind, RecordingState
from vibench.gui.page.app_context import USUAL_PATIENCE_S
from vibench.gui.widgets.notice import RUN

ROOT = Path(__file__).resolve().parents[2]
SILENT_WITHIN_S = {"SIGKILL": 1.0, "SIGSTOP": USUAL_PATIENCE_S + 1.0}
"""Time from the signal to zero drive in real time [s]; the end of a process is seen at once."""
SILENT_V = 0.02
"""Upper bound of a silent recorded drive: noise and the last step of a ramp."""
PATIENCE_S = 60.0
PAUSE = Event()


@contextmanager
def measuring_window(folder, attendance, state, patience_s=USUAL_PATIENCE_S):
    """Run a measuring window in a process, killed at the end."""
    child = Path(__file__).with_name("window_child.py")
    rig = ROOT / "hardware_configs" / "virtual_rig.toml"
    window = subprocess.Popen(
        [sys.executable, str(child), str(folder), str(rig), attendance.value, str(patience_s)],
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


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has neither signal")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.timeout(300)
def test_the_drive_is_silenced_when_the_window_dies_or_freezes(tmp_path, number):
    with measuring_window(tmp_path, Supervision.ATTENDED, tmp_path / "state") as window:
        assert silent_after_s(window, number, tmp_path) < SILENT_WITHIN_S[number.name]


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a stopped window is given four times as long")
@pytest.mark.parametrize(
    ("number", "attended_s"),
    [
        (signal.SIGSTOP, 10.0),
        pytest.param(signal.SIGKILL, 180.0, marks=pytest.mark.slow),
        pytest.param(signal.SIGSTOP, 180.0, marks=pytest.mark.slow),
    ],
)
@pytest.mark.timeout(900)
def test_the_drive_stops_if_the_window_dies_but_not_if_the_computer_is_busy(tmp_path, number, attended_s):
    """The window's heartbeat thread waited up to 1.6 s for Python's global lock."""
    with (
        measuring_window(tmp_path, Supervision.ATTENDED, tmp_path / "state", VIEWER_PATIENCE_S) as window,
        busy_cores(),
    ):
        PAUSE.wait(attended_s)
        assert [each.suffix for each in (tmp_path / "recordings").glob("run.h5*")] == [".part"]
        assert silent_after_s(window, number, tmp_path) < 0.55 + 0.1 + 0.067 + 1.0  # docs/safety.md


@contextmanager
def busy_cores():
    """Run four busy programs per core, each in a session, so that Linux schedules it like the window."""
    others = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"], start_new_session=True)
        for _ in range(4 * os.cpu_count())
    ]
    try:
        yield
    finally:
        for each in others:
            each.kill()
            each.wait()


def silent_after_s(window, number, folder):
    """Send a signal to a measuring window; return the time to silence in the recording [s]."""
    window.send_signal(number)
    signalled_s = time.time()
    path = folder / "recordings" / "run.h5"
    while not path.exists():
        assert time.time() < signalled_s + PATIENCE_S, "the recording was never finished"
        PAUSE.wait(0.01)
    with open_recording(path) as recording:
        assert recording.state is RecordingState.STOPPED
        assert "no viewer has" in recording.reason or "has ended" in recording.reason
        assert np.max(np.abs(recording.read("drive_voltage", recording.samples - 32))) < SILENT_V
        silent_s = next(event.unix_time_s for event in recording.events if event.kind == EventKind.OFF)
    return silent_s - signalled_s


@pytest.mark.thorough
@sees_locks
@pytest.mark.timeout(300)
def test_a_new_window_shows_and_supervises_an_unattended_run(window, qtbot, tmp_path):
    bridge, left = window.context.bridge, tmp_path / "left"
    with measuring_window(left, Supervision.UNATTENDED, os.environ["VIBENCH_STATE_DIR"]):
        window.adopt_left_campaign()
        qtbot.waitUntil(lambda: not window.context.background.is_busy, timeout=100_000)
        assert bridge.engine_pid is None, "it has a window that looks after it"
    # The engine sees at its next poll that the window is gone.
    qtbot.waitUntil(lambda: unattended_engine() is not None, timeout=60_000)
    window.adopt_left_campaign()
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
    qtbot.wait(1000)  # longer than an idle engine takes to end itself
    assert bridge.state is EngineState.READY
    assert [each.pid for each in announced_engines()] == [bridge.engine_pid]
    bridge.close()
    assert announced_engines() == ()
