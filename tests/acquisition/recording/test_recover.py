import shutil
import threading

import h5py
import numpy as np
import pytest

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import RecordingState, RecordingWriter, create_recording, part_of, recover
from vibench.acquisition.recording._disk import PositionedFile
from vibench.acquisition.recording._preallocate import preallocate


@pytest.fixture
def abandoned(tmp_path, make_header, make_block):
    """Return a function that leaves a recording as a killed program does: an open segment, no end."""

    def make(folder):
        path = folder / "a.h5"
        writer = create_recording(path, make_header())
        writer.begin_segment("steady", frequency_hz=260.0)
        counts, block = make_block(0, 500)
        writer.append(block)
        writer._committer.close()
        writer._disk.close()
        return part_of(path), counts

    return make


def test_an_abandoned_recording_is_finished_with_all_its_samples(tmp_path, abandoned):
    part, counts = abandoned(tmp_path)
    with open_recording(part) as recording:
        assert recording.state is RecordingState.INTERRUPTED
    assert recover(part) == tmp_path / "a.h5"
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.state is RecordingState.INTERRUPTED
        assert "before it could record how" in recording.reason
        np.testing.assert_array_equal(recording.read_counts("m0_velocity"), counts[1])
        (segment,) = recording.segments
        assert (segment.start, segment.stop, segment.is_complete) == (0, 500, False)
        assert [(event.kind, event.sample) for event in recording.events] == [("interrupted", 500)]
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]


@pytest.mark.parametrize("state", [each for each in RecordingState if each is not RecordingState.RECORDING])
def test_a_program_killed_while_writing_the_state_leaves_an_unfinished_recording(tmp_path, abandoned, state):
    part, counts = abandoned(tmp_path)
    with h5py.File(part, "r+") as file:
        file["state"][0] = state.value[:6].encode() + b"recording"[6:]
    with open_recording(part) as recording:
        assert recording.state is RecordingState.INTERRUPTED
    with open_recording(recover(part)) as recording:
        assert recording.state is RecordingState.INTERRUPTED
        np.testing.assert_array_equal(recording.read_counts("m0_velocity"), counts[1])
        assert [event.kind for event in recording.events] == ["interrupted"]


def test_recovery_finishes_a_recording_without_starting_a_thread(tmp_path, abandoned, monkeypatch):
    part, counts = abandoned(tmp_path)

    def refuse(_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with open_recording(recover(part)) as recording:
        np.testing.assert_array_equal(recording.read_counts("m0_velocity"), counts[1])


def test_recovery_replaces_an_incomplete_copy(tmp_path, abandoned):
    abandoned(tmp_path)
    (tmp_path / "a.h5.tmp").write_bytes(b"half a copy")
    assert recover(tmp_path / "a.h5") == tmp_path / "a.h5"  # the final name is accepted too
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]


def test_recovery_keeps_a_finished_copy_and_removes_the_part_file(tmp_path, abandoned):
    part, _ = abandoned(tmp_path)
    saved = tmp_path / "saved"
    shutil.copyfile(part, saved)
    recover(part)
    finished = (tmp_path / "a.h5").read_bytes()
    shutil.copyfile(saved, part)
    recover(part)
    assert (tmp_path / "a.h5").read_bytes() == finished
    assert not part.exists()


def test_recovery_does_not_overwrite_another_recording_of_the_same_name(tmp_path, abandoned):
    (tmp_path / "other").mkdir()
    part, _ = abandoned(tmp_path)
    other, _ = abandoned(tmp_path / "other")
    shutil.move(recover(other), tmp_path / "a.h5")
    with pytest.raises(RecordingError, match="are different recordings"):
        recover(part)
    assert part.exists()


def test_a_running_recording_is_not_recovered(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.append(make_block(0, 500)[1])
        with pytest.raises(RecordingError, match="still being recorded"):
            recover(tmp_path / "a.h5.part")
        writer.append(make_block(500, 500)[1])
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.samples == 1000
        assert recording.state is RecordingState.COMPLETE


def test_a_running_recording_can_be_read_by_h5py_alone(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.append(make_block(0, 500)[1])
        with h5py.File(tmp_path / "a.h5.part", "r") as file:
            assert file["m0_velocity"].attrs["units"] == b"m s-1"
        with open_recording(tmp_path / "a.h5.part") as recording:
            assert recording.state is RecordingState.RECORDING


def test_recovery_reports_that_there_is_nothing_to_recover(tmp_path):
    with pytest.raises(RecordingError, match=r"nothing to recover; give the path of a \.h5\.part"):
        recover(tmp_path / "a.h5")
    (tmp_path / "a.h5").touch()
    with pytest.raises(RecordingError, match=r"nothing to recover; analyse a\.h5, which exists"):
        recover(tmp_path / "a.h5")


def test_a_recording_in_progress_shows_its_committed_samples(tmp_path, make_header, make_block):
    path = tmp_path / "a.h5"
    places = preallocate(path, part_of(path), make_header())
    writer = RecordingWriter(
        path, make_header(), places, PositionedFile(part_of(path)), commit_interval_s=0.0
    )
    seen = []
    for first in range(0, 2000, 500):
        writer.append(make_block(first, 500)[1])
        with open_recording(part_of(path)) as recording:
            seen.append(recording.samples)
            assert len(recording.read("m0_velocity")) == recording.samples
    writer._committer.close()
    with open_recording(part_of(path)) as recording:
        seen.append(recording.samples)
    assert seen == sorted(seen)
    assert seen[-1] == 2000
    assert writer.finish(RecordingState.STOPPED).exists()
