"""The finished file can be read with h5py alone."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from vibench.acquisition import Overload, open_recording
from vibench.acquisition.recording import ResultArray, create_recording
from vibench.acquisition.recording._finalise import create_counts, write_chunks

SAMPLES = 120_000


@pytest.fixture
def file(tmp_path, make_header, make_block):
    with create_recording(tmp_path / "a.h5", make_header(expected_samples=SAMPLES)) as writer:
        writer.begin_segment("all")
        writer.log("note", "gap 45 µm")
        writer.append(make_block(0, SAMPLES, overloads=(Overload("m0_velocity", 3, 4),))[1])
    with open_recording(tmp_path / "a.h5") as recording:
        recording.save_results("r", {"x": ResultArray(np.arange(3.0) * 1j)}, {"n": 1})
    with h5py.File(tmp_path / "a.h5", "r") as opened:
        yield opened


def test_a_channel_has_a_unit_a_scale_and_a_time_axis(file, make_block):
    _, block = make_block(0, SAMPLES)
    velocity = file["m0_velocity"]
    assert velocity.attrs["units"] == b"m s-1"
    values = velocity[:] * velocity.attrs["scale_factor"] + velocity.attrs["add_offset"]
    np.testing.assert_allclose(values, 0.125 * block.volts[1], rtol=1e-12, atol=1e-15)
    time = velocity.dims[0][0]
    assert time.name == "/time"
    assert time[-1] * time.attrs["scale_factor"] == pytest.approx((SAMPLES - 1) / 1000.0)
    assert velocity.attrs["_FillValue"].dtype == velocity.dtype


def test_the_file_identifies_its_format(file):
    assert file.attrs["Conventions"] == b"CF-1.11"
    assert file.attrs["format"] == b"vibench-recording"
    assert file.attrs["format_version"] == 1
    assert file.attrs["state"] == b"complete"


def test_the_file_has_the_oldest_hdf5_superblock_version(file):
    with Path(file.filename).open("rb") as raw:
        assert raw.read(9) == b"\x89HDF\r\n\x1a\n\x00"


def test_all_data_types_are_readable_by_old_readers(file):
    kinds = set()

    def look(name, item):
        types = [item.id.get_type()] if isinstance(item, h5py.Dataset) else []
        dimension_scales = {"DIMENSION_LIST", "REFERENCE_LIST"}
        types += [item.attrs.get_id(each).get_type() for each in item.attrs if each not in dimension_scales]
        for each in types:
            kinds.add(each.get_class())
            assert not (each.get_class() == h5py.h5t.STRING and each.is_variable_str()), name

    look("/", file)
    file.visititems(look)
    assert kinds == {h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.STRING}


def test_events_and_overloads_and_segments_are_stored_as_columns(file):
    assert file["events/text"][0].decode() == "gap 45 µm"
    assert file["overloads/first_sample"][:].tolist() == [3]
    assert file["segments/last_sample"][:].tolist() == [SAMPLES - 1]


@pytest.mark.parametrize("samples", [1, 5, 99, 100, 101, 1000])
def test_chunks_compressed_in_threads_equal_the_chunks_that_hdf5_makes(tmp_path, samples):
    counts = np.random.default_rng(samples).integers(-(2**31), 2**31, samples, dtype=np.int32)
    with h5py.File(tmp_path / "chunks.h5", "w") as file:
        ours = create_counts(file, "ours", samples, 100)
        write_chunks(ours, (counts[at : at + 100] for at in range(0, samples, 100)))
        theirs = create_counts(file, "theirs", samples, 100)
        theirs[:] = counts
    with h5py.File(tmp_path / "chunks.h5", "r") as file:
        np.testing.assert_array_equal(file["ours"][:], counts)
        np.testing.assert_array_equal(file["theirs"][:], counts)


def test_the_finished_file_has_no_reserved_space(file):
    raw_bytes = 3 * SAMPLES * 4  # 24 of 32 bits are noise, in two channels
    assert Path(file.filename).stat().st_size < raw_bytes
