"""Programs without vibench read a recording with names, units and axes."""

import re
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import ResultArray

RATE_HZ = 51_200.0
ROLES = ("drive_voltage", "m0_velocity")
UNITS = ("V", "m s-1")


@pytest.fixture(scope="module")
def with_result(known_file, tmp_path_factory):
    path = tmp_path_factory.mktemp("readers") / "known.h5"
    shutil.copyfile(known_file, path)
    frequency = np.arange(1.0, 6.0)
    arrays = {
        "frequency": ResultArray(frequency, "Hz"),
        "transmission": ResultArray(np.exp(1j * frequency), "1", ("frequency",)),
    }
    with open_recording(path) as recording:
        recording.save_results("noise", arrays, {"estimator": "h1"})
    return path


def test_variables_opened_by_xarray_have_names_and_scales_and_dimensions(with_result, known_values):
    xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")
    pytest.importorskip("h5netcdf", reason="pip install vibench[exchange] brings h5netcdf")
    with xarray.open_dataset(with_result, engine="h5netcdf") as data:
        assert set(data.data_vars) == set(ROLES)
        np.testing.assert_allclose(data["time"], np.arange(data.sizes["time"]) / RATE_HZ, rtol=1e-12)
        for role, unit in zip(ROLES, UNITS, strict=True):
            assert data[role].dims == ("time",)
            assert data[role].attrs["units"] == unit
            np.testing.assert_allclose(data[role], known_values[role], rtol=1e-12, atol=1e-15)
        assert data["m0_velocity"].sel(time=slice(1.0, 1.5)).size == 25_601


@pytest.mark.parametrize(
    ("group", "dimension", "names"),
    [
        ("segments", "row", {"first_sample", "last_sample", "is_complete", "label", "numbers_json"}),
        ("events", "row", {"sample", "unix_time_s", "kind", "text"}),
        ("results/noise", "frequency", {"transmission_real", "transmission_imag", "settings_json"}),
    ],
)
def test_xarray_opens_the_groups_of_a_recording(with_result, group, dimension, names):
    xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")
    pytest.importorskip("h5netcdf", reason="pip install vibench[exchange] brings h5netcdf")
    with xarray.open_dataset(with_result, engine="h5netcdf", group=group) as data:
        assert set(data.data_vars) == names
        assert dimension in data.sizes
    if group == "segments":
        assert [bytes(each).decode() for each in data["label"].values] == ["dwell", "step"]


def h5dump(*arguments):
    program = shutil.which("h5dump")
    if program is None:
        pytest.skip("h5dump is not installed: on Debian it comes with hdf5-tools")
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


def test_h5dump_shows_channels_with_their_unit_their_scale_and_their_time_axis(with_result):
    head = h5dump("-A", "-d", "/m0_velocity", with_result)
    assert "H5T_STD_I32LE" in head
    assert re.search(r'ATTRIBUTE "units".*?"m s-1"', head, re.DOTALL)
    assert re.search(r'ATTRIBUTE "scale_factor".*?H5T_IEEE_F64LE', head, re.DOTALL)
    assert re.search(r'ATTRIBUTE "DIMENSION_LIST".*?/time', head, re.DOTALL)


def test_h5dump_shows_the_converter_counts(with_result):
    shown = h5dump("-d", "/drive_voltage", "-s", 69_998, "-c", 4, "-y", "-w", 80, with_result)
    data = re.search(r"DATA \{(.*?)\}", shown, re.DOTALL)[1]
    with open_recording(with_result) as recording:
        counts = recording.read_counts("drive_voltage", 69_998, 70_002)
    assert [int(each) for each in data.replace(",", " ").split()] == counts.tolist()
    assert counts[2:].tolist() == [-(2**31), -(2**31)]


def test_h5py_reads_a_recording_without_vibench(with_result, known_values, tmp_path):
    script = tmp_path / "reader.py"
    script.write_text(
        "import sys, h5py, numpy\n"
        "with h5py.File(sys.argv[1]) as file:\n"
        "    velocity = file['m0_velocity']\n"
        "    scale, offset = velocity.attrs['scale_factor'], velocity.attrs['add_offset']\n"
        "    time = velocity.dims[0][0]\n"
        "    print(repr(float(velocity[5] * scale + offset)), velocity.attrs['units'].decode())\n"
        "    print(repr(float(time[5] * time.attrs['scale_factor'])), 'vibench.acquisition' in sys.modules)\n"
    )
    command = [sys.executable, "-I", str(script), str(with_result)]
    value, unit, *rest = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split(
        None, 2
    )
    assert float(value) == pytest.approx(known_values["m0_velocity"][5], rel=1e-12)
    assert unit == "m"
    assert rest[0].split() == ["s-1", repr(5 / RATE_HZ), "False"]


def test_complex_results_are_two_real_arrays_over_one_axis(with_result):
    with h5py.File(with_result) as file:
        group = file["results/noise"]
        value = group["transmission_real"][:] + 1j * group["transmission_imag"][:]
        axis = group["transmission_real"].dims[0][0]
        np.testing.assert_allclose(value, np.exp(1j * axis[:]))
        assert axis.attrs["units"] == b"Hz"


def test_a_recording_open_in_xarray_is_not_reported_as_truncated(known_file):
    xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")
    with (
        xarray.open_dataset(known_file, engine="h5netcdf"),
        pytest.raises(RecordingError, match="with a different lock"),
    ):
        open_recording(known_file)
    with open_recording(known_file) as recording:
        assert recording.samples > 0
