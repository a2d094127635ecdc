"""Damaged recordings, and files that declare an implausible size, are refused before reading."""

import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.recording._seal import forget_checks
from vibench.analysis import analyse
from vibench.analysis.dynamics import ChainRequest
from vibench.analysis.dynamics._chain_computing import _base_of
from vibench.analysis.errors import UnusableData
from vibench.analysis.exchange import xarray_dataset
from vibench.analysis.hidden_motion import HiddenViewRequest, hidden_motion, hidden_view

CHUNK, CHUNKS = 51_200, 300
WAVE = np.round(3e5 * np.sin(2 * np.pi * np.arange(CHUNK) / 32)).astype("<i4")


def write_compression_bomb(path):
    """Replace every channel by a compressible sine: 190 kB that declare 15 million samples."""
    packed = zlib.compress(WAVE.view(np.uint8).reshape(CHUNK, 4).T.tobytes(), 9)
    with h5py.File(path, "r+") as file:
        for name in ("seal", "overview", "view"):
            del file[name]
        for role in file.attrs["roles"].decode().split():
            kept = {name: file[role].attrs[name] for name in file[role].attrs if name != "DIMENSION_LIST"}
            del file[role]
            channel = file.create_dataset(
                role, (CHUNK * CHUNKS,), "<i4", chunks=(CHUNK,), compression="gzip", shuffle=True
            )
            for first in range(0, CHUNK * CHUNKS, CHUNK):
                channel.id.write_direct_chunk((first,), packed)
            for name, value in kept.items():
                channel.attrs.create(name, value)
        file.attrs.modify("samples", np.int64(CHUNK * CHUNKS))


def test_a_small_file_that_declares_a_huge_data_size_is_refused(dwell_file, tmp_path):
    path = tmp_path / "packed.h5"
    path.write_bytes(Path(dwell_file("weak")).read_bytes())
    write_compression_bomb(path)
    with (
        open_recording(path) as recording,
        pytest.raises(UnusableData, match="impossible for data of a converter"),
    ):
        analyse(recording)


def test_a_noise_free_sine_is_not_mistaken_for_a_compression_bomb(dwell_file):
    with open_recording(dwell_file("weak")) as recording:
        assert 1 < recording.packing < 8


@pytest.fixture
def damaged(dwell_file, tmp_path):
    """A recording with one sample changed after it was sealed."""
    path = tmp_path / "damaged.h5"
    path.write_bytes(Path(dwell_file("weak")).read_bytes())
    with h5py.File(path, "r+") as file:
        file["base_acceleration"][5000] += 1
    forget_checks()
    return path


def test_a_damaged_recording_cannot_drive_a_chain(damaged):
    with pytest.raises(UnusableData, match="is damaged"):
        _base_of(ChainRequest.model_construct(recording=str(damaged)))


@pytest.mark.parametrize("number_from", [hidden_motion, xarray_dataset])
def test_damaged_recordings_are_not_analysed(damaged, number_from):
    with open_recording(damaged) as recording, pytest.raises(UnusableData, match="is damaged"):
        number_from(recording)


def test_no_hidden_motion_is_shown_for_a_damaged_recording(damaged):
    with pytest.raises(UnusableData, match="is damaged"):
        hidden_view(HiddenViewRequest(damaged, 0.0, 0.5))
