"""A disk that takes no more: a limit on the size of files, in a process of its own."""

import subprocess
import sys

import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.recording import RecordingState, recover

resource = pytest.importorskip("resource", reason="limits on file size exist on POSIX only")

SCRIPT = """
import resource, sys
import numpy as np
from vibench.acquisition import RecordingError
from vibench.acquisition import Block
from vibench.acquisition.recording import ChannelHeader, RecordingHeader
from vibench.acquisition.recording import Origin, RecordingState
from vibench.acquisition.recording import create_recording

when, path = sys.argv[1:]
channels = tuple(ChannelHeader(role, "ai0", "voltage", "V", 1.0, 5.0, 1e-6) for role in ("drive", "response"))
header = RecordingHeader(channels, 1000.0, 100_000, Origin.SIMULATED)
limit = lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

def refused(action):
    try:
        action()
    except RecordingError as error:
        print(error)
    else:
        sys.exit("nothing was refused")

if when == "start":
    limit(1_000_000)
    refused(lambda: create_recording(path, header))
    sys.exit()

writer = create_recording(path, header)
noise = np.random.default_rng(0).integers(-4_000_000, 4_000_000, (2, 100_000)) * 1e-6
half = writer._places.channels[1] + 50_000 * 4

def record():
    for first in range(0, 100_000, 1000):
        writer.append(Block(first, noise[:, first : first + 1000]))
        if first == 20_000:
            while writer.committed_samples < 20_000:
                writer._committer._thread.join(0.01)
            if when == "running":
                limit(half)
    while writer._committer._thread.is_alive():
        writer._committer._thread.join(0.01)
    writer.log("note", "one more")

if when == "running":
    refused(record)
    limit(resource.RLIM_INFINITY)
    writer.finish(RecordingState.FAILED, "full")
else:
    for first in range(0, 100_000, 1000):
        writer.append(Block(first, noise[:, first : first + 1000]))
    writer._committer.close()
    limit(200_000)
    refused(lambda: writer.finish(RecordingState.COMPLETE))
"""


def child(when, path):
    result = subprocess.run(
        [sys.executable, "-c", SCRIPT, when, str(path)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_a_disk_that_is_full_at_the_start_leaves_no_file(tmp_path):
    said = child("start", tmp_path / "a.h5")
    assert "cannot be prepared" in said or "cannot be created" in said
    assert "Nothing was recorded" in said
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_refuses_while_recording_keeps_what_was_committed(tmp_path):
    said = child("running", tmp_path / "a.h5")
    assert "The disk refused the recording" in said
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.state is RecordingState.FAILED
        assert recording.reason.startswith("full; the disk refused")
        assert 20_000 <= recording.samples <= 50_000
        assert recording.check_seal("whole").state.value == "intact"


def test_a_disk_that_is_full_at_the_end_leaves_a_part_to_recover(tmp_path):
    said = child("end", tmp_path / "a.h5")
    assert "safe in" in said or "recover it" in said
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5.part"]
    with open_recording(recover(tmp_path / "a.h5.part")) as recording:
        assert recording.samples == 100_000
