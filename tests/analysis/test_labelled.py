"""Results as labelled Datasets: units from names, bounds beside values, for every result class."""

import dataclasses
import importlib
import inspect
import json
import pathlib
import pkgutil
import typing

import numpy as np
import pytest

from vibench import analysis
from vibench.acquisition import open_recording
from vibench.analysis import dynamics, hidden_motion, transmissibility
from vibench.analysis.chaos.verdict import MotionVerdict
from vibench.analysis.fit.lines import FittedValue, Parameter
from vibench.analysis.fit.specimen_fit import SpecimenFit
from vibench.analysis.fit.updated_specimen import UpdatedSpecimen
from vibench.analysis.frequency_response.noise_response import Distortion
from vibench.analysis.kinds import Result
from vibench.analysis.overlay.overlay import AbstractOverlay, MeasurementPrediction
from vibench.analysis.recordings.checks import AbstractAnalysis
from vibench.analysis.results.compared_recording import ComparedRecording
from vibench.analysis.sine.dwell_analysis import DwellMotion
from vibench.analysis.tables import Tabular, holds_array, rows, unit_of
from vibench.analysis.uncertainty.budget import Budget

xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")
PUBLIC_APIS = ("", ".live", ".report", ".dynamics", ".hidden_motion")
"""Public parts of the analysis that return results; `exchange` makes files."""
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
"""Classes of intermediate values; the results contain the same information."""


@pytest.fixture(scope="module")
def response():
    base = np.random.default_rng(3).standard_normal(40 * 1024)
    return transmissibility(base, 2.0 * base, 1024.0, segment_samples=1024)


def test_a_labelled_response_has_frequencies_units_and_bounds(response):
    data = response.to_xarray()
    assert dict(data.sizes) == {"frequency_hz": response.frequency_hz.size}
    assert data["frequency_hz"].attrs["units"] == "Hz"
    assert data["sd_phase_rad"].attrs["units"] == "rad"
    np.testing.assert_array_equal(data["magnitude_upper"], response.magnitude_upper)
    assert float(data["magnitude"].sel(frequency_hz=100.0, method="nearest")) == pytest.approx(2.0)
    assert float(data["settings_sample_rate_hz"]) == 1024.0
    assert data.attrs["settings_estimator"] == response.settings.estimator.value


def test_a_dataset_round_trips_through_netcdf(response, tmp_path):
    pytest.importorskip("h5netcdf", reason="pip install vibench[exchange] brings h5netcdf")
    data = response.to_xarray().drop_vars("value")  # netCDF has no complex numbers
    data.to_netcdf(tmp_path / "response.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "response.nc", engine="h5netcdf") as kept:
        xarray.testing.assert_identical(kept.load(), data)


@dataclasses.dataclass(frozen=True, eq=False)
class Part(Tabular):
    time_s: np.ndarray
    force_n_per_m: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Whole(Tabular):
    frequency_hz: np.ndarray
    states: np.ndarray
    part: Part
    parts: tuple[Part, ...]
    label: str
    gap_m: float
    nothing: None = None


def test_nested_parts_keep_their_names_axes_and_units_in_a_dataset():
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
class Modes(Tabular):
    modes: tuple[Mode, ...]


def test_nested_results_with_scalar_values_become_columns_of_a_dataset():
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
def test_array_fields_are_recognised_by_the_type_names_of_old_and_new_numpy(name):
    assert holds_array(name)
    assert not holds_array(float)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("x_m_per_s", "m s-1"), ("rate_per_s", "s-1"), ("time_s", "s"), ("n_eff", ""), ("relative_i", "")],
)
def test_the_unit_of_a_field_is_read_from_the_longest_matching_suffix_of_its_name(name, unit):
    assert unit_of(name) == unit


def results():
    """Yield every dataclass with arrays in the public API of the analysis."""
    for api in PUBLIC_APIS:
        face = importlib.import_module(f"vibench.analysis{api}")
        for name in face.__all__:
            found = getattr(face, name)
            is_result = inspect.isclass(found) and dataclasses.is_dataclass(found) and name not in NOT_RESULTS
            if is_result and any(holds_array(each.type) for each in dataclasses.fields(found)):
                yield found


def composite_results():
    """Yield the result classes whose arrays are inside nested parts."""
    yield from (dynamics.BranchDiagram, dynamics.ChainAnswer, dynamics.ExponentSpectrum)
    yield from (hidden_motion.FoundSpecimen, hidden_motion.HiddenMotion, hidden_motion.TrackedMotion)
    yield from (AbstractOverlay, MeasurementPrediction, UpdatedSpecimen, SpecimenFit, AbstractAnalysis)
    yield from (Budget, MotionVerdict, DwellMotion, Distortion, Result, ComparedRecording)


_PURE = """
averages block_points blocks cells chi_square_limit coherence coherence_significance collides confidence
covariance
damping_ratio damping_ratios differs dimension dimension_high dimension_low distortion distortion_share
down draws dropouts edge_samples ends error_estimate events exponent first first_sample half_width holdable
impact_cell impacts index innovation_level is_colliding is_unexplained is_significant is_similar is_stable
is_unstable largest_multiplier left_out left_over level limit linear lines lines_used logarithm lost_samples
multiplier multiplier_imaginary multiplier_real multiplier_u n_eff neighbour_correlation noise_bias_i
noise_error_i noise_share order orders overflows overlap overloaded_samples pairs period period_samples
periods planned_stretches realisations reduced_chi_square reference_coherence relative relative_i relative_sd
relative_sd_magnitude residue residue_acceleration response_i response_ii rest_bias_i rest_error_i restarts
restitution runs
sd_damping_ratio sd_exponent sd_response_ii sd_samples segment_samples segments_excluded segments_used
share_at_full_scale share_told sides spectrum_error standard_errors statistic steady_relative_sd stop
is_clear slow_change strobe_sample surrogates transmission
transmission_error turns_per_period up whole_stretches
"""
PURE = set(_PURE.split())
"""Counts, shares, ratios, flags and numbers of samples: names that mean the same in every result."""
_OF_A_SWEEP = ("linear_ii", "linear_impacts", "linear_residual", "steady_over_swept")
PURE_HERE = {
    *(f"ZeroOne.{name}" for name in ("k", "spread")),
    *(f"Evidence.{name}" for name in ("spread", "noise")),
    *(f"Points.{name}" for name in ("value", "noise")),
    *(f"Similarity.{name}" for name in ("difference", "threshold", "rate", "low", "high")),
    *(f"Curve.{name}" for name in ("magnitude", "lower", "upper")),
    *(f"Resonance.{name}" for name in ("peak_magnitude", "sd_peak_magnitude")),
    *(f"Jump.{name}" for name in ("before", "after")),
    *(f"MassCheck.{name}" for name in ("expected", "scale", "unexplained")),
    "ChainRun.transmission_change",
    "DwellResponse.is_clear",
    "DwellResponse.slow_change",
    "SteppedResponse.slow_change",
    "SurrogateTest.least_margin",
    *(f"TargetReport.{name}" for name in ("error", "wanted_error", "unseen_share", "starts", "windows")),
    *(f"{kind}.{name}" for kind in ("SweptMotion", "SweepResponse") for name in _OF_A_SWEEP),
    "Divergence.size",
    "Divergence.last",
    "Collisions.samples",
    "FreeImpacts.samples",
    "AmplitudeSpectrum.samples",
    "EnsembleCurve.measured",
    "CollisionNumbers.misfit",
    "Suspect.behind",
}
"""The same for names that mean something else in other results."""
UNIT_NOT_KNOWN = {
    "LiveSpectrum.amplitude_density": "of channels that are not in it",
    "FrequencyResponseSettings.noise_ratio": "of the two channels that somebody chose",
    "PowerLaw.terms": "pairs of exponent and force, which become no variable",
    "RecordingFacts.confirmations": "words and numbers of the user, which become no variable",
}


def parts_of(annotation):
    """Yield the dataclasses in a type annotation, also inside tuples and unions."""
    for each in typing.get_args(annotation):
        yield from parts_of(each)
    if inspect.isclass(annotation) and dataclasses.is_dataclass(annotation):
        yield annotation


def is_number(annotation):
    inner = typing.get_args(annotation)
    return holds_array(annotation) or annotation in {int, float, complex} or any(map(is_number, inner))


def kinds_below(kind):
    yield kind
    for each in kind.__subclasses__():
        yield from kinds_below(each)


def reachable_kinds():
    """Return every result class and nested part class, with the annotations of its fields."""
    for each in pkgutil.walk_packages(analysis.__path__, "vibench.analysis."):
        importlib.import_module(each.name)
    found, waiting = {}, [each for each in kinds_below(Tabular) if each.__module__.startswith("vibench.")]
    while waiting:
        kind = waiting.pop()
        if kind in found or not dataclasses.is_dataclass(kind):
            continue
        hints = typing.get_type_hints(kind)
        found[kind] = {each.name: hints[each.name] for each in dataclasses.fields(kind)}
        named = [part for each in found[kind].values() for part in parts_of(each)]
        waiting += [each for part in named for each in kinds_below(part)]
    return found


def test_every_number_in_a_result_either_states_a_unit_or_is_dimensionless():
    lacking = set()
    for kind, hints in reachable_kinds().items():
        numbers = {name for name, each in hints.items() if is_number(each) and not list(parts_of(each))}
        properties = inspect.getmembers(kind, lambda member: isinstance(member, property))
        numbers |= {
            name
            for name, each in properties
            if not name.startswith("_") and holds_array(each.fget.__annotations__.get("return", ""))
        }
        told = {*getattr(kind, "OWN_UNITS", ()), *PURE, *filter(unit_of, numbers)}
        lacking |= {f"{kind.__name__}.{name}" for name in numbers - told}
    assert sorted(lacking - PURE_HERE - set(UNIT_NOT_KNOWN)) == []


def test_every_stored_quantity_names_its_unit():
    """Fields typed by a type variable, as `response` of an analysis, must state their units."""
    found = reachable_kinds()
    silent = [
        f"{kind.__name__}.{name}"
        for kind, hints in found.items()
        for name, each in hints.items()
        for part in parts_of(each)
        if any("{unit}" in unit for unit in getattr(part, "OWN_UNITS", {}).values())
        and name not in getattr(kind, "OWN_UNITS", {})
    ]
    assert silent == []


def test_units_are_stated_only_for_fields_that_exist():
    wrong = [
        f"{kind.__name__}.{name}"
        for kind, hints in reachable_kinds().items()
        for name in getattr(kind, "OWN_UNITS", {})
        if name not in hints and not isinstance(getattr(kind, name, None), property)
    ]
    assert wrong == []


@pytest.mark.parametrize(
    ("kind", "units"),
    [
        (
            "dwell",
            {
                "response_order_displacement": "m",
                "response_noise_density": "m s-1 Hz-0.5",
                "response_displacement_samples": "m",
                "response_displacement_settled": "m",
                "response_spectrum_amplitude": "m",
                "response_spectrum_value": "m",
                "displacement_lower": "m",
            },
        ),
        (
            "noise",
            {
                "response_base_level_rms_acceleration": "m s-2",
                "response_frequency_response_magnitude": "1",
                "response_periodic_frequency_response_magnitude": "s",
                "response_periodic_noise_variance": "(s)2",
                "response_periodic_detection_noise_amplitude": "m s-1",
            },
        ),
        (
            "sweep",
            {
                "response_velocity_amplitude": "m s-1",
                "response_harmonics_sd": "m",
                "spectrogram_density": "(m s-1)2 Hz-1",
                "collisions_threshold": "m s-1",
            },
        ),
        ("stepped", {"response_drive_amplitude_m": "m"}),
    ],
)
def test_reported_values_of_a_recording_have_units(request, kind, units):
    made = request.getfixturevalue(f"{kind}_file")
    with open_recording(made() if callable(made) else made) as recording:
        data = analysis.analyse(recording).to_xarray()
        channels = recording.channels
    for number, channel in enumerate(channels, 1):
        of = f"facts_channels_{number}_"
        for each in ("rms", "peak", "full_scale", "envelope_lower", "envelope_upper"):
            units = {**units, of + each: channel.unit}
        units[f"{of}header_physical_per_volt"] = f"{channel.unit} V-1"
    assert {name: data[name].attrs.get("units") for name in units} == units
    assert "" not in [each.attrs.get("units") for each in data.variables.values()]


def test_a_table_whose_rows_have_different_units_gets_a_column_of_units():
    f0 = FittedValue(Parameter.F0, 95.0, 94.0, 96.0, 0.5, 95.5)
    m0 = dataclasses.replace(f0, parameter=Parameter.M0)

    @dataclasses.dataclass(frozen=True)
    class Fitted(Tabular):
        values: tuple[FittedValue, ...]

    mixed, alike = Fitted((f0, m0)).to_xarray(), Fitted((f0, f0)).to_xarray()
    assert mixed["values_value_units"].to_numpy().tolist() == ["Hz", "kg"]
    assert "units" not in mixed["values_value"].attrs
    assert alike["values_value"].attrs["units"] == "Hz"
    assert Budget("level", 1.0, "µm", ()).to_xarray()["value"].attrs["units"] == "µm"


def test_every_result_with_arrays_can_be_converted_to_a_dataset():
    found = {*results(), *composite_results()}
    assert len(found) > 25
    assert sorted(each.__name__ for each in found if not issubclass(each, Tabular)) == []


@dataclasses.dataclass(frozen=True, eq=False)
class Measured(Tabular):
    DOCUMENT: typing.ClassVar = "*part lowest_hz=frequency_hz.0 missing_m=absent.size_m folder"

    part: "Spread"
    frequency_hz: np.ndarray
    absent: Part | None
    folder: pathlib.Path


@dataclasses.dataclass(frozen=True)
class Spread:
    mean_m: np.float64
    sd_m: float


def result(mean_m=2.0):
    return Measured(Spread(np.float64(mean_m), np.nan), np.array([95.0, 266.0]), None, pathlib.Path("here"))


def test_a_json_document_has_all_fields_in_order_and_null_for_unknown_values():
    document = result().to_dict()
    assert list(document) == ["mean_m", "sd_m", "lowest_hz", "missing_m", "folder"]
    assert json.dumps(document, allow_nan=False) == (
        '{"mean_m": 2.0, "sd_m": null, "lowest_hz": 95.0, "missing_m": null, "folder": "here"}'
    )


def test_table_rows_of_several_results_are_concatenated():
    found = rows([result(), result(3.0)], "frequency_hz mean_m=part.mean_m size_m=absent.size_m")
    np.testing.assert_array_equal(found["frequency_hz"], [95.0, 266.0, 95.0, 266.0])
    np.testing.assert_array_equal(found["mean_m"], [2.0, 3.0])
    np.testing.assert_array_equal(found["size_m"], [np.nan, np.nan])
    assert rows([], "frequency_hz")["frequency_hz"].size == 0
