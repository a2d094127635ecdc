"""A window that is killed or frozen during a run: silence soon after, and the recording kept."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Event

import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.recording import RecordingState
from vibench.gui.page._app_context import USUAL_PATIENCE_S

ROOT = Path(__file__).resolve().parents[2]
SILENT_WITHIN_S = {"SIGKILL": 1.0, "SIGSTOP": USUAL_PATIENCE_S + 1.0}
"""From the signal to zero drive, on the wall's clock: the end of a process is known at once."""
PATIENCE_S = 60.0
PAUSE = Event()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has neither signal")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.timeout(300)
def test_a_window_that_dies_or_freezes_leaves_silence(tmp_path, number):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "VIBENCH_STATE_DIR": str(tmp_path / "state")}
    rig = ROOT / "hardware_configs" / "virtual_rig.toml"
    window = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("window_child.py")), str(tmp_path), str(rig)],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert window.stdout.readline() == "running\n"
        window.send_signal(number)
        signalled_s = time.time()
        path = tmp_path / "recordings" / "run.h5"
        while not path.exists():
            assert time.time() < signalled_s + PATIENCE_S, "the recording was never finished"
            PAUSE.wait(0.01)
    finally:
        window.kill()
        window.wait()
        window.stdout.close()
    with open_recording(path) as recording:
        assert recording.state is RecordingState.STOPPED
        assert "nobody has looked" in recording.reason or "has ended" in recording.reason
        # Noted when the last, verified setting of the ramp has been made; the tests of the engine look at
        # the drive itself.
        silent_s = next(event.unix_time_s for event in recording.events if event.kind == "silence")
        assert recording.samples > 0
    assert silent_s - signalled_s < SILENT_WITHIN_S[number.name]
