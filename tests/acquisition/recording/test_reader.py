import h5py
import numpy as np
import pytest

from vibench.acquisition import Identity, RecordingError, open_recording
from vibench.acquisition.recording import ResultArray, create_recording

IDENTITY = Identity("TEKTRONIX", "AFG1022", "1234", "V1.2.6", "TEKTRONIX,AFG1022,1234,V1.2.6")
SAMPLES = 2500


@pytest.fixture
def path(tmp_path, make_header, make_block):
    header = make_header(
        instruments={"generator": IDENTITY},
        confirmations={"amplifier_gain": 20.0, "vibrometer_range": "125 mm/s/V"},
        requested_sample_rate_hz=999.0,
    )
    with create_recording(tmp_path / "a.h5", header) as writer:
        writer.append(make_block(0, SAMPLES)[1])
    return tmp_path / "a.h5"


def test_a_recording_contains_all_metadata_known_at_its_start(path, make_channel):
    with open_recording(path) as recording:
        assert recording.channel("m0_velocity") == make_channel("m0_velocity", long_name="m0 velocity")
        assert recording.plan == {"kind": "dwell", "frequency_hz": 260.0}
        assert recording.bench == {"name": "virtual"}
        assert recording.instruments == {"generator": IDENTITY}
        assert recording.confirmations == {"amplifier_gain": 20.0, "vibrometer_range": "125 mm/s/V"}
        assert (recording.sample_rate_hz, recording.requested_sample_rate_hz) == (1000.0, 999.0)
        assert recording.provenance["packages"]["h5py"] == h5py.__version__
        assert recording.origin == "simulated"


def test_an_unstated_converter_step_or_sensitivity_is_read_as_missing(tmp_path, make_header, make_channel):
    bare = make_channel("m0_velocity", volts_per_count=None, sensitivity=None, long_name="velocity of m0")
    with create_recording(tmp_path / "b.h5", make_header(channels=(bare,))):
        pass
    with open_recording(tmp_path / "b.h5") as recording:
        assert recording.channels == (bare,)


def test_a_plan_too_long_for_an_hdf5_attribute_is_stored(tmp_path, make_header):
    long_plan = '{"steps": [' + ",".join(["0.125"] * 50_000) + "]}"
    with create_recording(tmp_path / "b.h5", make_header(plan_json=long_plan)):
        pass
    with open_recording(tmp_path / "b.h5") as recording:
        assert len(recording.plan["steps"]) == 50_000


def test_blocks_read_one_by_one_equal_the_whole_recording(path):
    with open_recording(path) as recording:
        blocks = list(recording.blocks(["m0_velocity", "drive_voltage"], 700))
        assert [block.first_sample for block in blocks] == [0, 700, 1400, 2100]
        whole = np.concatenate([block.values for block in blocks], axis=1)
        np.testing.assert_array_equal(whole[0], recording.read("m0_velocity"))
        np.testing.assert_array_equal(whole[1], recording.read("drive_voltage"))


@pytest.mark.parametrize(("start", "stop"), [(-1, 10), (0, SAMPLES + 1), (20, 10)])
def test_reading_beyond_the_last_sample_is_refused(path, start, stop):
    with open_recording(path) as recording, pytest.raises(RecordingError, match="has samples 0 to 2500"):
        recording.read("m0_velocity", start, stop)


def test_an_unknown_channel_is_refused_with_the_known_channels(path):
    with open_recording(path) as recording, pytest.raises(RecordingError, match="drive_voltage, m0_velocity"):
        recording.read("m2_velocity")


def test_reading_a_closed_recording_is_refused(path):
    recording = open_recording(path)
    recording.close()
    with pytest.raises(RecordingError, match="closed"):
        recording.read("m0_velocity")


def test_a_finished_recording_is_found_by_the_name_of_its_part_file(path):
    with open_recording(path.with_name("a.h5.part")) as recording:
        assert recording.path == path
        assert recording.state == "complete"


def remove(path):
    path.unlink()


def rename_to_part(path):
    path.rename(path.with_name("a.h5.part"))


def make_empty(path):
    path.write_bytes(b"")


def replace_by_text(path):
    path.write_text("time,voltage\n0,1\n" * 1000)


def truncate(path):
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


def replace_by_other_hdf5(path):
    with h5py.File(path, "w") as file:
        file["x"] = 1.0


def set_newer_version(path):
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = 2


def remove_segments(path):
    with h5py.File(path, "r+") as file:
        del file["segments"]


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (remove, "does not exist"),
        (rename_to_part, r"a\.h5\.part does: the recording is still running, or was"),
        (make_empty, "is empty"),
        (replace_by_text, "is not a readable HDF5 file"),
        (replace_by_text, "If another program wrote it, convert it with vibench import"),
        (truncate, "cut short"),
        (replace_by_other_hdf5, "not a recording of vibench"),
        (set_newer_version, "format version 2.*reads version 1.*Update"),
        (remove_segments, "is damaged"),
    ],
)
def test_each_kind_of_unreadable_file_has_a_specific_message(path, damage, sentence):
    damage(path)
    with pytest.raises(RecordingError, match=sentence):
        open_recording(path)


def test_results_are_stored_in_the_recording_beside_the_samples(path):
    frequency = np.linspace(0.0, 500.0, 6)
    response = np.exp(1j * frequency)
    arrays = {
        "H": ResultArray(response, "m s-1 V-1", ("frequency",)),
        "frequency": ResultArray(frequency, "Hz"),
        "is_line": ResultArray(frequency > 100.0, "1", ("frequency",)),
    }
    settings = {"window": "hann", "overlap": 0.5, "lines": [1, 2], "is_robust": True}
    with open_recording(path) as recording:
        before = recording.read_counts("m0_velocity")
        assert recording.save_results("transmission", arrays, settings, ["m0_velocity"]) == "transmission"
        assert recording.save_results("transmission", arrays, {}) == "transmission-2"
        first = recording.results["transmission"]
        np.testing.assert_array_equal(first.arrays["H"].values, response)
        assert first.arrays["H"].unit == "m s-1 V-1"
        assert first.arrays["H"].axes == ("frequency",)
        assert first.settings == settings
        assert list(first.raw_sha256) == ["m0_velocity"]
        assert list(recording.results) == ["transmission", "transmission-2"]
        np.testing.assert_array_equal(recording.read_counts("m0_velocity"), before)
    assert [each.name for each in path.parent.iterdir()] == ["a.h5"]
    with h5py.File(path) as file:
        group = file["results/transmission"]
        assert group["H_real"].dims[0][0].name == "/results/transmission/frequency"
        assert group["settings"].attrs["overlap"] == 0.5


def test_results_of_two_simultaneous_analyses_are_both_stored(path):
    one, other = open_recording(path), open_recording(path)
    with one, other:
        one.save_results("spectrum", {}, {"by": "one"})
        other.save_results("spectrum", {}, {"by": "other"})
    with open_recording(path) as recording:
        assert [each.settings["by"] for each in recording.results.values()] == ["one", "other"]


def test_a_result_with_a_wrong_axis_is_refused(path):
    before = path.read_bytes()
    arrays = {
        "H": ResultArray(np.zeros(5), "1", ("frequency",)),
        "frequency": ResultArray(np.zeros(6), "Hz"),
    }
    with open_recording(path) as recording, pytest.raises(RecordingError, match="Nothing was saved"):
        recording.save_results("transmission", arrays, {})
    assert path.read_bytes() == before
    assert [each.name for each in path.parent.iterdir()] == ["a.h5"]
