"""An unread log in a pipe or on a blocked terminal does not block a stop."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from threading import Event

import pytest

CAMPAIGN = """
name = "night"
[[measurements]]
name = "dwell"
excitation = {kind = "dwell", amplitude_vpp = 1.0, frequency_hz = 260, settle_s = 0.2, duration_s = 900}
"""


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="pipes whose room is told, as Linux has them")
def test_a_run_can_be_stopped_even_if_nothing_reads_its_log(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    (tmp_path / "night.toml").write_text(CAMPAIGN)
    kept, written = os.pipe()
    fcntl.fcntl(written, fcntl.F_SETPIPE_SZ, 4096)
    os.set_blocking(written, False)
    with suppress(BlockingIOError):
        while True:
            os.write(written, b"." * 512)
    os.set_blocking(written, True)
    words = ["--log-level", "debug", "measure", "night.toml", "--out", "out", "--check", "waived"]
    environment = {**os.environ, "VIBENCH_STATE_DIR": str(tmp_path / "state")}
    with subprocess.Popen(
        [sys.executable, "-m", "vibench.cli", *words], cwd=tmp_path, env=environment, stderr=written,
        stdout=subprocess.DEVNULL,
    ) as run:  # fmt: skip
        part = tmp_path / "out" / "dwell.h5.part"
        give_up_s = time.monotonic() + 60
        while not part.exists():
            assert run.poll() is None
            assert time.monotonic() < give_up_s
            Event().wait(0.02)
        run.send_signal(signal.SIGTERM)
        try:
            assert run.wait(60) == 3
        finally:
            run.kill()
    os.close(written)
    os.close(kept)
