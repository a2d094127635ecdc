"""Results as labelled Datasets: units from names, bounds beside values, one mechanism for all of them."""

import dataclasses
import importlib
import inspect
import pkgutil

import numpy as np
import pytest

from vibench import analysis
from vibench.analysis import (
    chaos,
    dynamics,
    frequency_response,
    hidden_motion,
    kinds,
    model,
    model_updating,
    recordings,
    results as results_room,
    sine,
    transmissibility,
    uncertainty,
)
from vibench.analysis.tables import Labelled, holds_array, unit_of

xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")
NOT_ROOMS_OF_RESULTS = {"exchange", "figures", "paper_figures", "simulation"}
"""What goes into files, into pictures, and through the process that simulates."""
NOT_RESULTS = {
    "SpectralAverages",
    "FittedShaker",
    "SimulatedChannels",
    "StretchDraws",
    "Quantity",
    "SimilarityCurve",
    "ConvertedSignal",
    "DensityPicture",
    "OverviewLevel",
    "Thumbnail",
}
"""Working values behind a result, which holds what they say."""


@pytest.fixture(scope="module")
def response():
    base = np.random.default_rng(3).standard_normal(40 * 1024)
    return transmissibility(base, 2.0 * base, 1024.0, segment_samples=1024)


def test_a_response_lies_over_its_frequencies_with_its_bounds(response):
    data = response.to_xarray()
    assert dict(data.sizes) == {"frequency_hz": response.frequency_hz.size}
    assert data["frequency_hz"].attrs["units"] == "Hz"
    assert data["sd_phase_rad"].attrs["units"] == "rad"
    np.testing.assert_array_equal(data["magnitude_upper"], response.magnitude_upper)
    assert float(data["magnitude"].sel(frequency_hz=100.0, method="nearest")) == pytest.approx(2.0)
    assert float(data["settings_sample_rate_hz"]) == 1024.0
    assert data.attrs["settings_estimator"] == response.settings.estimator.value


def test_a_dataset_survives_a_file(response, tmp_path):
    pytest.importorskip("h5netcdf", reason="pip install vibench[exchange] brings h5netcdf")
    data = response.to_xarray().drop_vars("value")  # netCDF has no complex numbers
    data.to_netcdf(tmp_path / "response.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "response.nc", engine="h5netcdf") as kept:
        xarray.testing.assert_identical(kept.load(), data)


@dataclasses.dataclass(frozen=True, eq=False)
class Part(Labelled):
    time_s: np.ndarray
    force_n_per_m: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Whole(Labelled):
    frequency_hz: np.ndarray
    states: np.ndarray
    part: Part
    parts: tuple[Part, ...]
    label: str
    gap_m: float
    nothing: None = None


def test_parts_keep_their_names_axes_and_units():
    part = Part(np.arange(2.0), np.ones(2))
    data = Whole(np.arange(3.0), np.zeros((3, 6)), part, (part, part), "word", 45e-6).to_xarray()
    assert data["states"].dims == ("frequency_hz", "states_2")
    assert data["part_force_n_per_m"].dims == ("part_time_s",)
    assert data["parts_2_force_n_per_m"].attrs["units"] == "N m-1"
    assert (float(data["gap_m"]), data["gap_m"].attrs["units"]) == (45e-6, "m")
    assert data.attrs["label"] == "word"
    assert "part_time_s" in data.coords


@dataclasses.dataclass(frozen=True)
class Mode:
    frequency_hz: float
    name: str
    sd_s: float | None
    shape_m: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class Modes(Labelled):
    modes: tuple[Mode, ...]


def test_parts_of_single_numbers_are_a_table():
    first, second = Mode(95.0, "first", 0.5, (1.0, 2.0)), Mode(266.0, "second", None, (3.0, 4.0))
    data = Modes((first, second)).to_xarray()
    np.testing.assert_array_equal(data["modes_frequency_hz"], [95.0, 266.0])
    np.testing.assert_array_equal(data["modes_sd_s"], [0.5, np.nan])
    np.testing.assert_array_equal(data["modes_shape_m"], [[1.0, 2.0], [3.0, 4.0]])
    assert data["modes_name"].to_numpy().tolist() == ["first", "second"]
    assert data["modes_sd_s"].attrs["units"] == "s"
    uneven = Modes((first, dataclasses.replace(second, shape_m=(3.0,)))).to_xarray()
    np.testing.assert_array_equal(uneven["modes_2_shape_m"], [3.0])


@pytest.mark.parametrize("name", ["numpy.ndarray[tuple[typing.Any, ...]]", "NDArray[numpy.float64]"])
def test_arrays_are_known_by_the_names_of_old_and_new_numpy(name):
    assert holds_array(name)
    assert not holds_array(float)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("x_m_per_s", "m s-1"), ("rate_per_s", "s-1"), ("time_s", "s"), ("n_eff", ""), ("relative_i", "")],
)
def test_a_unit_is_the_longest_end_of_a_name(name, unit):
    assert unit_of(name) == unit


def results():
    """Every dataclass on a face of the analysis that has arrays."""
    for room in sorted(
        {each.name for each in pkgutil.iter_modules(analysis.__path__)} - NOT_ROOMS_OF_RESULTS
    ):
        face = importlib.import_module(f"vibench.analysis.{room}")
        for name in getattr(face, "__all__", ()):
            found = getattr(face, name)
            is_result = inspect.isclass(found) and dataclasses.is_dataclass(found) and name not in NOT_RESULTS
            if is_result and any(holds_array(each.type) for each in dataclasses.fields(found)):
                yield found


def wholes():
    """What a person is given whole, its arrays inside of its parts."""
    yield from (dynamics.BranchDiagram, dynamics.ChainAnswer, dynamics.ExponentSpectrum)
    yield from (hidden_motion.FoundSpecimen, hidden_motion.HiddenMotion, hidden_motion.TrackedMotion)
    yield from (model.AbstractOverlay, model.MeasurementPrediction, model_updating.UpdatedSpecimen)
    yield from (model_updating.SpecimenFit, recordings.AbstractAnalysis, uncertainty.Budget)
    yield from (chaos.MotionVerdict, sine.DwellMotion, frequency_response.Distortion)
    yield from (kinds.Result, results_room.ComparedRecording)


def test_every_result_with_arrays_has_the_method():
    found = {*results(), *wholes()}
    assert len(found) > 40
    assert sorted(each.__name__ for each in found if not issubclass(each, Labelled)) == []
