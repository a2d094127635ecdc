"""SIGTERM ends a campaign as stopped, also between its check and its first run."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.windows_here import sees_locks

ROOT = Path(__file__).resolve().parents[2]
KILLED = """
import os, signal
from vibench.acquisition.rig import load_rig
from vibench.cli.measure import the_bench
from pathlib import Path

with the_bench(load_rig(Path({rig!r})), "night") as engine:
    os.kill(os.getpid(), signal.SIGTERM)
    print(engine.switch.request.level.value, flush=True)
"""


@pytest.mark.thorough
@sees_locks
@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process at once")
def test_sigterm_between_measurements_stops_the_campaign(tmp_path):
    rig = str(ROOT / "hardware_configs" / "virtual_rig.toml")
    words = [sys.executable, "-c", KILLED.format(rig=rig)]
    ended = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout.split()) == (0, ["abort"]), ended.stderr
