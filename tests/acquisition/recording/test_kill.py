"""The promise: a recording survives ``kill -9`` at any moment, minus at most the last second."""

import importlib.util
import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import RecordingState, open_recording, recover

CHILD = Path(__file__).with_name("recording_child.py")
SPEC = importlib.util.spec_from_file_location("recording_child", CHILD)
child = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(child)

PROMISE_S = 1.0
ENDLESS_BLOCKS = 200_000
"""Several times what the quickest disk takes before the kill."""
QUICK, MANY = 3, 25


def killed_recording(folder, blocks, phase, delay_s):
    """Record in another process, kill it ``delay_s`` after the phase began; its words and the moment."""
    words = folder / "words"
    with words.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, str(CHILD), str(folder / "a.h5"), str(blocks)], stdout=out
        )
        deadline_s = time.monotonic() + 60.0
        while phase not in words.read_bytes() and process.poll() is None:
            assert time.monotonic() < deadline_s
        try:
            process.wait(timeout=delay_s)
        except subprocess.TimeoutExpired:
            process.kill()
        killed_s = time.monotonic()
        process.wait()
    # The last line may be cut by the kill, or say that finishing began.
    pairs = [line.split() for line in words.read_text().splitlines()[:-1]]
    acknowledged = [(float(time_s), int(samples)) for time_s, samples in pairs]
    return acknowledged, killed_s


def require_truth(recording):
    for row, role in enumerate(recording.roles):
        np.testing.assert_array_equal(recording.read_counts(role), child.truth(0, recording.samples, row))


def check_kill_while_recording(folder, delay_s):
    acknowledged, killed_s = killed_recording(folder, ENDLESS_BLOCKS, b"\n", delay_s)
    promised = max((samples for time_s, samples in acknowledged if time_s <= killed_s - PROMISE_S), default=0)
    part = folder / "a.h5.part"
    with open_recording(part) as recording:
        assert recording.state is RecordingState.INTERRUPTED
        assert promised <= recording.samples <= acknowledged[-1][1] + 2 * child.BLOCK
        committed = recording.samples
        require_truth(recording)
    final = recover(part)
    assert not part.exists()
    with open_recording(final) as recording:
        assert recording.state is RecordingState.INTERRUPTED
        assert recording.samples == committed
        assert recording.events[-1].kind == "interrupted"
        require_truth(recording)


def check_kill_while_finishing(folder, delay_s):
    blocks = 4000
    killed_recording(folder, blocks, b"finishing", delay_s)
    part, final = folder / "a.h5.part", folder / "a.h5"
    if part.exists():
        with open_recording(part) as recording:
            promised_state = recording.state
            # Killed before the last commit, its samples may be short of the end: the state says so.
            if promised_state is RecordingState.COMPLETE:
                assert recording.samples == blocks * child.BLOCK
        recover(part)
    else:
        promised_state = RecordingState.COMPLETE
    assert sorted(each.name for each in folder.iterdir()) == ["a.h5", "words"]
    with open_recording(final) as recording:
        assert recording.state is promised_state
        require_truth(recording)
        assert all(recording.is_intact(role) for role in recording.roles)


@pytest.mark.parametrize("seed", range(QUICK))
def test_a_killed_recording_opens_and_misses_at_most_the_last_second(tmp_path, seed):
    check_kill_while_recording(tmp_path, random.Random(seed).uniform(0.0, 1.6))


@pytest.mark.parametrize("seed", range(QUICK))
def test_a_recording_killed_while_it_is_finished_loses_nothing(tmp_path, seed):
    check_kill_while_finishing(tmp_path, random.Random(seed).uniform(0.0, 0.25))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 100 + MANY))
def test_many_killed_recordings_open_and_miss_at_most_the_last_second(tmp_path, seed):
    check_kill_while_recording(tmp_path, random.Random(seed).uniform(0.0, 3.0))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 100 + MANY))
def test_many_recordings_killed_while_finished_lose_nothing(tmp_path, seed):
    check_kill_while_finishing(tmp_path, random.Random(seed).uniform(0.0, 0.4))
