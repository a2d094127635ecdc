"""The catalogue of a folder: its contents, updates after changes, and rebuilding."""

import os
import shutil
from dataclasses import replace

import pytest

from vibench.acquisition import Overload, RecordingError, run_campaign
from vibench.acquisition.campaign import Refresh, _catalogue as catalogue_module, list_recordings
from vibench.acquisition.campaign._catalogue import CATALOGUE_NAME, _band
from vibench.acquisition.plan import Campaign, Dwell, Measurement, ResonanceTracking, RunState, SineSweep
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin as RecordingOrigin,
    RecordingHeader,
    RecordingState,
    create_recording,
)
from vibench.acquisition.run.run import Run

DWELL = Measurement(
    name="dwell",
    excitation=Dwell(amplitude_vpp=1.0, frequency_hz=260, settle_s=0.1, duration_s=0.2),
    ramp_s=0.2,
    ramp_step_s=0.02,
)
SWEEP = DWELL.model_copy(
    update={
        "name": "sweep",
        "excitation": SineSweep(amplitude_vpp=0.5, start_hz=300, stop_hz=200, duration_s=0.3, settle_s=0.1),
    }
)


@pytest.fixture(scope="module")
def recorded(new_bench, rig, tmp_path_factory):
    folder, bench = tmp_path_factory.mktemp("recorded"), new_bench(rig)
    run_campaign(bench, Campaign(name="a", measurements=(DWELL,)), folder / "monday")
    run_campaign(bench, Campaign(name="b", measurements=(SWEEP,)), folder / "tuesday" / "late")
    return folder


@pytest.fixture
def folder(recorded, tmp_path):
    """Return copies of the recordings, with their file times, for one test to change."""
    return shutil.copytree(recorded, tmp_path, dirs_exist_ok=True)


@pytest.fixture
def reads(monkeypatch):
    """Return the list of the names of the recordings that were opened."""
    opened = []
    read = catalogue_module.read_entry

    def counted_read(folder, path, size_bytes):
        opened.append(path.name)
        return read(folder, path, size_bytes)

    monkeypatch.setattr(catalogue_module, "read_entry", counted_read)
    return opened


@pytest.mark.thorough
def test_the_catalogue_lists_recordings_in_subfolders_with_their_plan_and_time_and_size(folder):
    dwell, sweep = list_recordings(folder)
    assert (dwell.path, sweep.path) == ("monday/dwell.h5", "tuesday/late/sweep.h5")
    assert (dwell.state, dwell.verdict, dwell.kind) == ("complete", "samples not checked", "dwell")
    assert (sweep.amplitude_vpp, sweep.frequency_low_hz, sweep.frequency_high_hz) == (0.5, 200, 300)
    assert dwell.size_bytes == (folder / dwell.path).stat().st_size
    assert dwell.duration_s == pytest.approx(0.6 + 0.2 + 0.1 + 0.2 + 0.2)
    assert "expected" in dwell.bench_check
    assert dwell.started_utc < sweep.started_utc


def test_a_tracked_resonance_is_listed_with_its_search_range():
    plan = ResonanceTracking(
        amplitude_vpp=1, start_hz=262, low_hz=240, high_hz=290, accelerations_m_per_s2=(0.3,)
    )
    assert _band(plan.model_dump()) == (240, 290)


@pytest.mark.thorough
def test_only_new_and_changed_files_are_read(folder, reads):
    before = list_recordings(folder)
    assert sorted(reads) == ["dwell.h5", "sweep.h5"]
    reads.clear()
    assert list_recordings(folder) == before
    assert reads == []
    (folder / "monday" / "dwell.h5").rename(folder / "moved.h5")
    os.utime(folder / "tuesday" / "late" / "sweep.h5", (1, 1))
    assert [entry.path for entry in list_recordings(folder)] == ["moved.h5", "tuesday/late/sweep.h5"]
    assert sorted(reads) == ["moved.h5", "sweep.h5"]


@pytest.mark.thorough
def test_a_lost_catalogue_is_rebuilt_from_the_files(folder, reads):
    before = list_recordings(folder)
    (folder / CATALOGUE_NAME).unlink()
    assert list_recordings(folder) == before
    reads.clear()
    assert list_recordings(folder, Refresh.ALL) == before
    assert sorted(reads) == ["dwell.h5", "sweep.h5"]


@pytest.mark.thorough
def test_the_verdict_on_a_recording_states_how_the_recording_ended_and_any_overload(bench, folder):
    loud = folder / "loud.h5"
    read = bench.digitizer.read

    def near_full_scale(samples):
        block = read(samples)
        overload = Overload("m0_velocity", block.first_sample, block.first_sample + 1)
        return replace(block, overloads=(overload,))

    bench.digitizer.read = near_full_scale
    with Run(bench, DWELL, loud) as run:
        for progress in run:
            if progress.state is RunState.RECORDING:
                run.cancel("seen enough")
    entry = next(entry for entry in list_recordings(folder) if entry.path == "loud.h5")
    assert entry.verdict == "stopped; near full scale: m0_velocity"
    assert entry.reason == "seen enough"


@pytest.mark.thorough
def test_running_recordings_are_listed_and_abandoned_recordings_are_marked_as_interrupted(bench, folder):
    with Run(bench, DWELL, folder / "now.h5") as run:
        next(iter(run))
        running = next(entry for entry in list_recordings(folder) if entry.path == "now.h5.part")
    assert running.state == "recording"
    assert "now.h5.part" not in [entry.path for entry in list_recordings(folder)]


@pytest.mark.thorough
def test_a_file_that_is_not_a_recording_is_listed_as_unreadable(folder):
    (folder / "junk.h5").write_bytes(b"no HDF5")
    entry = next(entry for entry in list_recordings(folder) if entry.path == "junk.h5")
    assert entry.state == "unreadable"
    assert "junk.h5" in entry.reason


@pytest.mark.thorough
def test_a_foreign_file_named_like_the_catalogue_is_kept_until_a_rebuild(folder):
    (folder / CATALOGUE_NAME).write_text("my notes " * 200)
    with pytest.raises(RecordingError, match="is not a catalogue"):
        list_recordings(folder)
    assert (folder / CATALOGUE_NAME).read_text().startswith("my notes")
    assert len(list_recordings(folder, Refresh.ALL)) == 2


@pytest.mark.thorough
def test_a_write_protected_folder_can_be_listed(folder, monkeypatch):
    # For a directory in place of the database SQLite reports the same error as for a read-only folder.
    (folder / CATALOGUE_NAME).mkdir()
    assert len(list_recordings(folder)) == 2


def test_a_missing_folder_is_refused_with_advice(tmp_path):
    with pytest.raises(RecordingError, match="give the folder that contains the recordings"):
        list_recordings(tmp_path / "nowhere")


@pytest.mark.thorough
def test_a_copy_of_a_recording_is_listed_as_a_copy(folder):
    shutil.copy(folder / "monday" / "dwell.h5", folder / "again.h5")
    by_path = {each.path: each.verdict for each in list_recordings(folder)}
    assert by_path["monday/dwell.h5"] == "samples not checked; has the same samples as again.h5"
    assert by_path["again.h5"] == by_path["tuesday/late/sweep.h5"] == "samples not checked"


def test_recordings_without_samples_are_not_reported_as_copies(tmp_path):
    for name in "ab":
        channels = (ChannelHeader("m0_velocity", "dev/ai0", "velocity", "m s-1", 1.0, 10.0),)
        header = RecordingHeader(
            channels,
            5120.0,
            100,
            RecordingOrigin.SIMULATED,
            DWELL.model_dump_json(),
            '{"name": "a"}',
        )
        with create_recording(tmp_path / f"{name}.h5", header) as writer:
            writer.finish(RecordingState.STOPPED, "before the first sample")
    assert [each.verdict for each in list_recordings(tmp_path)] == ["stopped"] * 2
