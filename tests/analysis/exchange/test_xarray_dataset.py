"""A recording as an xarray Dataset."""

import json

import numpy as np
import pytest

from vibench.analysis.exchange import xarray_dataset

xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")


def test_a_dataset_holds_the_values_and_units_and_times_of_the_recording(known, known_values):
    data = xarray_dataset(known)
    assert list(data.data_vars) == list(known.roles)
    for role in known.roles:
        np.testing.assert_array_equal(data[role], known_values[role])
        assert data[role].attrs["units"] == known.channel(role).unit
    np.testing.assert_array_equal(data["time"], known.time_s())
    assert data.attrs["recording_id"] == known.recording_id


def test_samples_of_a_dataset_can_be_chosen_by_their_segment(known):
    data = xarray_dataset(known, ("m0_velocity",), from_s=1.0)
    said = json.loads(data.attrs["segments_json"])
    assert [each["label"] for each in said] == ["dwell", "step"]
    assert said[1]["frequency_hz"] == 270.0
    dwell = data.isel(time=data["segment"].values == 0)
    assert dwell.sizes["time"] == 70_000 - 51_200
    assert float(dwell["time"][0]) == 1.0
