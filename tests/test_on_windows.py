"""Commands of a laboratory on Windows, run without the functions missing on Windows."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.windows_here import POSIX_ONLY
from vibench.acquisition import open_recording

ROOT = Path(__file__).resolve().parent.parent
CAMPAIGN = """
name = "short"
[[measurements]]
name = "dwell"
ramp_s = 0.2
ramp_step_s = 0.05
excitation = { kind = "dwell", amplitude_vpp = 0.1, frequency_hz = 200, settle_s = 0.3, duration_s = 2.0 }
"""
STUDY = """
amplitudes_m = [1e-6]
frequencies_hz = [200, 230]
duration_s = 0.5
window_s = 0.2
"""
LOCKS = """
from tests.windows_here import become_windows
become_windows()
from pathlib import Path
from vibench.acquisition.bench import BenchLock
from vibench.acquisition.errors import InstrumentBusy
from vibench.acquisition.recording._disk import PositionedFile, is_being_recorded
from vibench.acquisition.rig import load_rig

rig = load_rig(Path("hardware_configs/lab_rig.toml"))
held = BenchLock.of(rig)
try:
    BenchLock.of(rig)
except InstrumentBusy as error:
    print(error)
held.close()
BenchLock.of(rig).close()

path = Path({folder!r}) / "some.bin"
path.write_bytes(bytes(8))
file = PositionedFile(path)
file.write(2, b"abc")
file.sync()
print(is_being_recorded(path), path.read_bytes())
file.close()
print(is_being_recorded(path))
"""


def call(*words, folder=ROOT, fails=False):
    found = subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False, timeout=280
    )
    assert (found.returncode != 0) is fails, found.stderr
    return found


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8", newline="\r\n")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8", newline="\r\n")
    return tmp_path


def test_posix_functions_that_the_windows_tests_remove_exist_on_this_system():
    # A misspelt name, or one removed from Python, would test nothing.
    program = f"import os; print(sum(hasattr(os, each) for each in {POSIX_ONLY!r}))"
    assert int(call("-c", program).stdout) > 25


@pytest.mark.thorough
def test_windows_locks_mark_a_bench_and_a_recording_as_in_use(here):
    said = call("-c", LOCKS.format(folder=str(here))).stdout.splitlines()
    assert "is in use by process" in said[0]
    assert said[1:] == ["True b'\\x00\\x00abc\\x00\\x00\\x00'", "False"]


@pytest.mark.thorough
@pytest.mark.timeout(300)
def test_a_campaign_is_measured_verified_and_analysed_on_windows(here):
    rig = str(ROOT / "hardware_configs" / "virtual_rig.toml")
    measure = ("-m", "tests.windows_here", "measure", "campaign.toml", "--bench", rig, "--out", "a folder")
    call(*measure, folder=here)
    (path,) = (here / "a folder").glob("*.h5")
    with open_recording(path) as recording:
        assert recording.state.value == "complete"
        assert recording.check_seal("whole").state.value == "intact"
    found = call("-m", "tests.windows_here", "analyse", str(path), "--json", folder=here)
    assert "response" in json.dumps(json.loads(found.stdout))
    call("-m", "tests.windows_here", "verify", "a folder", folder=here)
    call(*measure, folder=here, fails=True)


@pytest.mark.thorough
@pytest.mark.timeout(300)
def test_a_study_is_solved_on_windows_by_spawned_processes(here):
    call("-m", "tests.windows_here", "study", "study.toml", "--out", "a.h5", "--workers", "1", folder=here)
    again = call("-m", "tests.windows_here", "study", "study.toml", "--out", "a.h5", "--resume", folder=here)
    assert "2 of 2 points, 0 failed (complete)" in again.stdout
