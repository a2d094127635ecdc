"""A recording as an xarray Dataset."""

import json

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.analysis import InvalidRequest
from vibench.analysis.exchange import xarray_dataset

xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")


def test_a_dataset_holds_the_values_units_and_times_of_the_recording(known, known_values):
    data = xarray_dataset(known)
    assert list(data.data_vars) == list(known.roles)
    for role in known.roles:
        np.testing.assert_array_equal(data[role], known_values[role])
        assert data[role].attrs["units"] == known.channel(role).unit
    np.testing.assert_array_equal(data["time"], known.time_s())
    assert data.attrs["recording_id"] == known.recording_id


def test_a_dataset_is_what_xarray_itself_reads_from_the_file(known_file):
    pytest.importorskip("h5netcdf", reason="pip install vibench[exchange] brings h5netcdf")
    with open_recording(known_file) as recording:
        ours = xarray_dataset(recording)
    with xarray.open_dataset(known_file, engine="h5netcdf") as theirs:
        for role in ours.data_vars:
            np.testing.assert_allclose(ours[role], theirs[role], rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(ours["time"], theirs["time"], rtol=1e-12)


def test_samples_are_chosen_by_their_segment(known):
    data = xarray_dataset(known, ("m0_velocity",), from_s=1.0)
    said = json.loads(data.attrs["segments_json"])
    assert [each["label"] for each in said] == ["dwell", "step"]
    assert said[1]["frequency_hz"] == 270.0
    dwell = data.isel(time=data["segment"].values == 0)
    assert dwell.sizes["time"] == 70_000 - 51_200
    assert float(dwell["time"][0]) == 1.0


def test_a_stretch_outside_the_recording_is_refused(known):
    with pytest.raises(InvalidRequest, match="goes from 0 to"):
        xarray_dataset(known, to_s=1e6)
