import h5py
import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.recording import (
    BIN_SAMPLES,
    CHUNK_SAMPLES,
    MISSING_COUNT,
    OverviewSums,
    create_recording,
)
from vibench.acquisition.recording._overview import extremes

SAMPLES = 2 * CHUNK_SAMPLES + 1000


@pytest.fixture
def sample_file(tmp_path, make_header, make_block):
    counts, block = make_block(0, SAMPLES)
    with create_recording(tmp_path / "a.h5", make_header(expected_samples=SAMPLES)) as writer:
        writer.append(block)
    return tmp_path / "a.h5", counts


def test_overview_bins_store_the_minimum_and_maximum_of_their_samples(sample_file):
    path, counts = sample_file
    with open_recording(path) as recording:
        for row, role in zip(counts, recording.roles, strict=True):
            overview = recording.read_overview(role)
            assert overview.low.size == overview.high.size == -(-SAMPLES // BIN_SAMPLES)
            for number in (0, 1, 399, 400, overview.low.size - 1):
                part = row[number * BIN_SAMPLES : (number + 1) * BIN_SAMPLES]
                assert (overview.low[number], overview.high[number]) == (part.min(), part.max())


def test_h5py_alone_reads_the_overview_with_its_scale_and_its_axis(sample_file):
    path, counts = sample_file
    with h5py.File(path, "r") as file:
        low = file["overview/m0_velocity_low"]
        assert low.attrs["scale_factor"] == file["m0_velocity"].attrs["scale_factor"]
        assert low.attrs["units"] == b"m s-1"
        assert low[:].min() == counts[1].min()
        axis = file["overview/bin"]
        assert low.dims[0][0].name == "/overview/bin"
        assert axis[3] * axis.attrs["scale_factor"] == pytest.approx(3 * BIN_SAMPLES / 1000.0)
        assert file["overview"].attrs["samples_per_bin"] == BIN_SAMPLES


def test_an_overview_curve_is_nan_in_bins_whose_samples_were_lost(tmp_path, make_header, make_block):
    _, before = make_block(0, BIN_SAMPLES)
    _, after = make_block(3 * BIN_SAMPLES + 5, 1000)
    with create_recording(tmp_path / "a.h5", make_header()) as writer:
        writer.append(before)
        writer.append(after)
    with h5py.File(tmp_path / "a.h5", "r") as file:
        values = file["view/m0_velocity/values"][:]
        assert np.flatnonzero(np.isnan(values)).tolist() == [2, 3, 4, 5]
        assert file["view/m0_velocity/time"] == file["view/drive_voltage/time"]
        assert file["view/m0_velocity/time"].shape == values.shape


def test_overview_extremes_exclude_lost_samples():
    counts = np.arange(4 * BIN_SAMPLES, dtype=np.int32)
    counts[5:9] = MISSING_COUNT
    counts[BIN_SAMPLES : 2 * BIN_SAMPLES] = MISSING_COUNT
    found = extremes(counts)
    assert found.low.tolist() == [0, MISSING_COUNT, 2 * BIN_SAMPLES, 3 * BIN_SAMPLES]
    assert found.high.tolist() == [BIN_SAMPLES - 1, MISSING_COUNT, 3 * BIN_SAMPLES - 1, 4 * BIN_SAMPLES - 1]


def test_an_overview_made_in_pieces_equals_an_overview_made_at_once():
    counts = np.random.default_rng(1).integers(-1000, 1000, 10 * BIN_SAMPLES + 7, dtype=np.int32)
    sums = OverviewSums()
    for first in range(0, counts.size, 3 * BIN_SAMPLES):
        sums.add(counts[first : first + 3 * BIN_SAMPLES])
    assert np.array_equal(sums.overview().low, extremes(counts).low)
    assert np.array_equal(sums.overview().high, extremes(counts).high)


def test_a_recording_without_samples_has_an_empty_overview(tmp_path, make_header):
    with create_recording(tmp_path / "a.h5", make_header()):
        pass
    with open_recording(tmp_path / "a.h5") as recording:
        assert recording.read_overview("m0_velocity").low.size == 0
    with h5py.File(tmp_path / "a.h5", "r") as file:
        assert "default" not in file.attrs


def test_the_overview_of_a_file_that_has_no_overview_is_none(sample_file):
    path, _ = sample_file
    with h5py.File(path, "r+") as file:
        del file["overview"]
    with open_recording(path) as recording:
        assert recording.read_overview("m0_velocity") is None


def test_a_recording_in_progress_has_no_overview(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header(expected_samples=1000)) as writer:
        writer.append(make_block(0, 500)[1])
        with open_recording(tmp_path / "a.h5.part") as recording:
            assert recording.read_overview("m0_velocity") is None
