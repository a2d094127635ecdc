"""A program killed while it prepares a recording leaves no .part file that cannot be opened."""

import multiprocessing
import os

import h5py

from vibench.acquisition import open_recording
from vibench.acquisition.recording import RecordingState, _preallocate as preallocate_module, create_recording


def _die_before(step, path, header):
    """Begin a recording, and end the process without cleaning up at ``step`` of the preparation."""
    setattr(preallocate_module, step, lambda *_: os._exit(9))
    create_recording(path, header)


def test_a_kill_during_preparation_leaves_only_a_tmp_file(tmp_path, make_header):
    path = tmp_path / "run.h5"
    child = multiprocessing.get_context("spawn").Process(
        target=_die_before, args=("_claim", path, make_header())
    )
    child.start()
    child.join()
    assert child.exitcode == 9
    assert [each.name for each in tmp_path.iterdir()] == ["run.h5.tmp"]
    create_recording(tmp_path / "run.2.h5", make_header()).finish(RecordingState.STOPPED)
    with open_recording(tmp_path / "run.2.h5") as recording:
        assert recording.samples == 0


def test_a_prepared_part_file_can_be_opened(tmp_path, make_header):
    writer = create_recording(tmp_path / "run.h5", make_header())
    with h5py.File(tmp_path / "run.h5.part", "r", locking=False) as file:
        assert file["n_valid"][0] == 0
    writer.finish(RecordingState.STOPPED)
    assert [each.name for each in tmp_path.iterdir()] == ["run.h5"]
