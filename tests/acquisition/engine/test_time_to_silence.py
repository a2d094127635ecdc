"""Times to silence of docs/safety.md, measured in real time at the terminal for a few cases."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="stalls and limits as Linux has them")


def run_benchmark(*options, name="time_to_silence.py"):
    script = str(ROOT / "benchmarks" / name)
    return subprocess.run(
        [sys.executable, script, *options], capture_output=True, text=True, check=False, env={**os.environ}
    )


@pytest.mark.thorough
def test_two_cases_of_the_safety_table_meet_their_times_to_silence():
    told = run_benchmark("--cells", "0.007", "--seed", "7")
    assert told.returncode == 0, told.stdout + told.stderr
    assert told.stdout.count(" s\n") == 2


@pytest.mark.thorough
def test_a_stopped_or_killed_run_falls_silent_and_saved_cases_are_not_repeated(tmp_path):
    stops, kills = tmp_path / "stops.jsonl", tmp_path / "kills.jsonl"
    for options in (["--save", stops, "--seed", "3"], ["--save", kills, "--dead-man"]):
        told = run_benchmark(*map(str, options), "--count", "2", name="stops_from_outside.py")
        assert told.returncode == 0, told.stdout + told.stderr
        assert told.stdout.count(" s of ") == 2
    again = run_benchmark("--save", str(stops), "--seed", "3", "--count", "2", name="stops_from_outside.py")
    assert again.stdout == ""


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_all_cases_in_a_quarter_of_the_safety_table_are_silent_in_time():
    told = run_benchmark("--cells", "0.25", "--seed", "8")
    assert told.returncode == 0, told.stdout + told.stderr


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_running_engine_is_found_in_each_of_600_tries():
    told = run_benchmark("--tries", "600", "--commands", "12")
    assert told.returncode == 0, told.stdout + told.stderr
