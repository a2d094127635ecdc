"""Other programs read the recorded values from an exported recording."""

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat, wavfile

from vibench.acquisition import Block, open_recording
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    ResultArray,
    create_recording,
)
from vibench.analysis import InvalidRequest
from vibench.analysis.exchange import Format, Results, excerpt, export_samples

RATE_HZ = 51_200.0
ROLES = ("drive_voltage", "m0_velocity")


def test_a_csv_file_contains_every_value_with_its_unit_and_its_time(known, known_values, tmp_path):
    path, _ = export_samples(excerpt(known), Format.CSV, tmp_path / "a.csv")
    with path.open(newline="", encoding="utf-8") as file:
        assert next(csv.reader(file)) == ["time [s]", "drive_voltage [V]", "m0_velocity [m s-1]"]
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 0], np.arange(known.samples) / RATE_HZ, atol=5e-10)
    for column, role in enumerate(ROLES, start=1):
        np.testing.assert_allclose(table[:, column], known_values[role], rtol=1e-9)


def test_an_exported_excerpt_keeps_the_times_of_the_recording(known, known_values, tmp_path):
    chosen = excerpt(known, ("m0_velocity",), 1.0, 1.5)
    path, facts = export_samples(chosen, Format.CSV, tmp_path / "part.csv")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert table.shape == (25_600, 2)
    assert table[0, 0] == 1.0
    np.testing.assert_allclose(table[:, 1], known_values["m0_velocity"][51_200:76_800], rtol=1e-9)
    assert json.loads(facts.read_text("utf-8"))["first_sample"] == 51_200


def test_the_metadata_of_a_csv_export_are_written_to_a_json_file_beside_the_csv_file(known, tmp_path):
    _, facts = export_samples(excerpt(known), Format.CSV, tmp_path / "a.csv")
    said = json.loads(facts.read_text("utf-8"))
    assert facts.name == "a.csv.facts.json"
    assert said["recording_id"] == known.recording_id
    assert said["segments"][0]["numbers"] == {"frequency_hz": 260.0}
    assert said["gaps"] == [{"first_sample": 70_000, "last_sample": 70_009}]
    assert said["events"][-1]["text"] == "gap 45 µm"
    assert said["channels"][1]["scale_factor"] == known.channel("m0_velocity").scale_factor


def test_pyuff_reads_every_value_of_a_universal_file(known, known_values, tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
    path, _ = export_samples(excerpt(known), Format.UFF, tmp_path / "a.uff")
    file = pyuff.UFF(str(path))
    assert file.get_set_types().tolist() == [164, 58, 58]
    units, *sets = file.read_sets()
    assert (units["units_code"], units["length"], units["force"]) == (1, 1.0, 1.0)
    for role, unit, kind, each in zip(ROLES, ("V", "m s-1"), (0, 11), sets, strict=True):
        assert (each["id1"], each["ordinate_axis_units_lab"]) == (role, unit)
        assert (each["func_type"], each["ordinate_spec_data_type"]) == (1, kind)
        assert each["abscissa_axis_units_lab"] == "s"
        np.testing.assert_array_equal(each["data"], known_values[role])


def test_a_universal_file_keeps_all_digits_of_the_rate(known, tmp_path):
    pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
    path, _ = export_samples(excerpt(known, from_s=1.0), Format.UFF, tmp_path / "a.uff")
    first = pyuff.UFF(str(path)).read_sets(1)
    assert first["abscissa_inc"] != 1 / RATE_HZ
    told = ["sample_rate_hz=51200.0", "first_sample=51200", "origin=simulated"]
    assert first["id5"].split() == told


def test_a_matlab_file_holds_a_struct_for_each_channel(known, known_values, tmp_path):
    export_samples(excerpt(known), Format.MAT, tmp_path / "a.mat")
    found = loadmat(tmp_path / "a.mat", squeeze_me=True, simplify_cells=True)
    np.testing.assert_array_equal(found["time_s"], known.time_s())
    for role, unit in zip(ROLES, ("V", "m s-1"), strict=True):
        np.testing.assert_array_equal(found[role]["values"], known_values[role])
        assert found[role]["units"] == unit
        assert found[role]["scale_factor"] == known.channel(role).scale_factor
    assert found["recording"]["sample_rate_hz"] == RATE_HZ
    assert json.loads(found["recording"]["plan_json"])["name"] == "known"


def test_the_segments_in_a_matlab_file_are_indices_into_the_exported_arrays(known, tmp_path):
    export_samples(excerpt(known, from_s=1.0), Format.MAT, tmp_path / "a.mat")
    found = loadmat(tmp_path / "a.mat", squeeze_me=True, simplify_cells=True)
    segments = found["recording"]["segments"]
    assert segments["label"].tolist() == ["dwell", "step"]
    assert segments["first"].tolist() == [1, 70_000 - 51_200 + 1]
    assert segments["last"].tolist() == [70_000 - 51_200, 120_000 - 51_200]


def test_a_wav_file_keeps_the_converter_counts_relative_to_full_scale(known, known_values, tmp_path):
    path, facts = export_samples(excerpt(known), Format.WAV, tmp_path / "a.wav")
    rate, data = wavfile.read(path)
    assert (rate, data.dtype) == (RATE_HZ, np.int32)
    full_scales = [each["full_scale"] for each in json.loads(facts.read_text("utf-8"))["channels"]]
    assert full_scales == [5.0, 0.625]
    for role, full_scale, column in zip(ROLES, full_scales, data.T, strict=True):
        np.testing.assert_array_equal(column / 2.0**31 * full_scale, np.nan_to_num(known_values[role]))


def test_a_sampling_rate_that_a_wav_file_cannot_state_is_refused(known, tmp_path):
    odd = replace(known, sample_rate_hz=51_199.7)
    with pytest.raises(
        InvalidRequest, match=r"51199\.7 samples/s, but the rate of a WAV file is a whole number"
    ):
        export_samples(excerpt(odd), Format.WAV, tmp_path / "a.wav")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("to", "hours", "said"), [(Format.MAT, 1, "2 GiB"), (Format.WAV, 6, "4 GiB")])
def test_data_too_large_for_a_format_are_refused_before_writing(known, tmp_path, to, hours, said):
    samples = round(hours * 3600 * RATE_HZ)
    with pytest.raises(InvalidRequest, match=said):
        export_samples(excerpt(replace(known, samples=samples)), to, tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("to", list(Format))
def test_a_refused_export_overwrites_nothing_and_leaves_no_file(known, tmp_path, to):
    taken = tmp_path / f"a.{to.value}"
    taken.write_text("mine")
    with pytest.raises(InvalidRequest, match="nothing is ever overwritten"):
        export_samples(excerpt(known), to, taken)
    assert [each.read_text() for each in tmp_path.iterdir()] == ["mine"]


def test_the_progress_of_an_export_covers_every_value(known, tmp_path):
    for to in Format:
        heard = []
        chosen = excerpt(known)
        export_samples(chosen, to, tmp_path / f"a.{to.value}", observer=heard.append)
        assert sum(heard) == chosen.values == 2 * known.samples


def test_an_interrupted_export_leaves_no_file(known, tmp_path):
    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_samples(excerpt(known), Format.CSV, tmp_path / "a.csv", observer=interrupt)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def with_results(known_file, tmp_path):
    shutil.copyfile(known_file, tmp_path / "known.h5")
    arrays = {
        "frequency": ResultArray(np.array([1.0, 2.0, 3.0]), "Hz"),
        "time": ResultArray(np.array([0.0, 0.5]), "s"),
        "transmission": ResultArray(np.array([1 + 2j, 3 - 4j, 0.5j]), "1", ("frequency",)),
        "picture": ResultArray(np.arange(6.0).reshape(2, 3), "m s-1", ("time", "frequency")),
    }
    with open_recording(tmp_path / "known.h5") as recording:
        recording.save_results("noise-2", arrays, {"estimator": "h1"})
        yield recording


def test_saved_results_with_the_same_axes_are_exported_as_one_table(with_results, tmp_path):
    chosen = excerpt(with_results)
    *_, picture, lines = export_samples(chosen, Format.CSV, tmp_path / "a.csv", Results.INCLUDED)
    assert (lines.name, picture.name) == ("a.noise-2.frequency.csv", "a.noise-2.time.frequency.csv")
    assert lines.read_text().splitlines() == [
        "frequency [Hz],transmission_real [1],transmission_imag [1]",
        "1,1,2",
        "2,3,-4",
        "3,0,0.5",
    ]
    rows = np.loadtxt(picture, delimiter=",", skiprows=1)
    assert rows[4].tolist() == [0.5, 2.0, 4.0]


def test_saved_results_become_structs_in_matlab(with_results, tmp_path):
    export_samples(excerpt(with_results), Format.MAT, tmp_path / "a.mat", Results.INCLUDED)
    found = loadmat(tmp_path / "a.mat", squeeze_me=True, simplify_cells=True)["results"]["noise_2"]
    assert found["transmission"]["values"].tolist() == [1 + 2j, 3 - 4j, 0.5j]
    assert found["picture"]["units"] == "m s-1"
    assert found["picture"]["axes"].tolist() == ["time", "frequency"]
    assert json.loads(found["settings_json"]) == {"estimator": "h1"}


def test_a_growing_recording_is_exported_up_to_its_committed_samples(tmp_path):
    channel = ChannelHeader("m0_velocity", "dev/ai0", "velocity", "m s-1", 0.125, range_v=5.0)
    header = RecordingHeader((channel,), 1000.0, 5000, Origin.SIMULATED)
    with create_recording(tmp_path / "grows.h5", header) as writer:
        writer.append(Block(0, np.linspace(-1.0, 1.0, 2000)[np.newaxis]))
        while writer.committed_samples < 2000:
            pass  # takes half a second at most
        with open_recording(tmp_path / "grows.h5.part") as recording:
            path, _ = export_samples(excerpt(recording), Format.CSV, tmp_path / "a.csv")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], 0.125 * np.linspace(-1.0, 1.0, 2000), atol=1e-8)
