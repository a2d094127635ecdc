"""A simulated full or slow disk affects a recording like a real one."""

import errno
import time

import pytest

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import (
    DiskTrouble,
    RecordingState,
    create_recording,
    recover,
    trouble_disks,
)


@pytest.fixture
def trouble():
    trouble = DiskTrouble()
    with trouble_disks(trouble):
        yield trouble


def test_a_simulated_full_disk_refuses_writes_at_once_and_notifies_the_rig():
    told = []
    trouble = DiskTrouble(lambda: told.append(len(told)))
    for _ in range(2):
        heal = trouble.fill()
        before = len(told)
        for refusals in range(3):
            with pytest.raises(OSError, match="No space left"):
                trouble.apply()
            assert len(told) - before == refusals
        heal()
        trouble.apply()


def append_until_committed(writer, make_block, first, samples):
    for begin in range(first, first + samples, 100):
        writer.append(make_block(begin, 100)[1])
    while writer.committed_samples < first + samples:
        writer._committer._thread.join(0.01)


def test_a_full_disk_refuses_a_new_recording_and_leaves_no_file(tmp_path, make_header, trouble):
    trouble.fill()
    with pytest.raises(RecordingError, match="Nothing was recorded; make room"):
        create_recording(tmp_path / "a.h5", make_header())
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_ends_the_recording_and_committed_samples_are_kept(
    tmp_path, make_header, make_block, trouble
):
    writer = create_recording(tmp_path / "a.h5", make_header())
    append_until_committed(writer, make_block, 0, 1000)
    heal = trouble.fill()
    writer.append(make_block(1000, 100)[1])
    writer._committer._thread.join(10)
    with pytest.raises(RecordingError, match="No space left"):
        writer.log("note", "one more")
    heal()
    writer.finish(RecordingState.FAILED, "full")
    with open_recording(tmp_path / "a.h5") as recording:
        assert (recording.state, recording.samples) == (RecordingState.FAILED, 1000)


def test_a_part_file_of_a_full_disk_can_be_recovered_later(tmp_path, make_header, make_block, trouble):
    writer = create_recording(tmp_path / "a.h5", make_header())
    append_until_committed(writer, make_block, 0, 500)
    heal = trouble.fill()
    with pytest.raises(RecordingError):
        writer.finish(RecordingState.COMPLETE)
    heal()
    with open_recording(recover(tmp_path / "a.h5.part")) as recording:
        assert recording.samples == 500


def test_a_commit_succeeds_after_the_disk_has_refused_two_commits(trouble):
    trouble.fill(2)
    for _ in range(2):
        with pytest.raises(OSError, match="No space") as refusal:
            trouble.apply()
        assert refusal.value.errno == errno.ENOSPC
    trouble.apply()


def test_a_slow_disk_delays_the_writing_but_not_the_sampling(tmp_path, make_header, make_block, trouble):
    heal = trouble.slow_down(0.2)
    writer = create_recording(tmp_path / "a.h5", make_header())
    began_s = time.monotonic()
    for first in range(0, 1000, 100):
        writer.append(make_block(first, 100)[1])
    assert time.monotonic() - began_s < 0.2
    heal()
    writer.finish(RecordingState.COMPLETE)
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.samples == 1000


def test_a_simulated_slow_disk_is_slow(trouble):
    heal = trouble.slow_down(0.1)
    began_s = time.monotonic()
    trouble.apply()
    assert time.monotonic() - began_s >= 0.1
    heal()
    began_s = time.monotonic()
    trouble.apply()
    assert time.monotonic() - began_s < 0.1


def test_simulated_disk_faults_end_when_the_rig_is_closed(tmp_path, make_header):
    with trouble_disks(DiskTrouble()) as _:
        pass
    trouble = DiskTrouble()
    with trouble_disks(trouble):
        trouble.fill()
    create_recording(tmp_path / "a.h5", make_header()).finish(RecordingState.COMPLETE)
