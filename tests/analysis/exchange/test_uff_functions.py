"""Universal files of spectra: read back by pyuff, and record by record as dataset 58 is defined."""

import numpy as np
import pytest

from vibench.analysis import FrequencyResponseRequest, InvalidRequest
from vibench.analysis.exchange import (
    Format,
    FunctionAxis,
    FunctionType,
    UniversalFunction,
    excerpt,
    export_functions,
    export_samples,
    opened_source,
)
from vibench.analysis.results import spectral_functions
from vibench.analysis.spectra import spectral_density

pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
RESPONSE = FunctionAxis("m0_velocity", "m0 velocity", "velocity", "m/s")
REFERENCE = FunctionAxis("drive_voltage", "base acceleration", "acceleration", "m/s2")


def function(frequency_hz, values, kind=FunctionType.FREQUENCY_RESPONSE):
    return UniversalFunction(kind, frequency_hz, values, RESPONSE, REFERENCE, "estimator h1, 12 averages")


@pytest.mark.parametrize("lines", [2, 5, 1001])
@pytest.mark.parametrize("is_even", [True, False])
@pytest.mark.parametrize("is_complex", [True, False])
def test_pyuff_reads_every_line_and_both_axes(known, tmp_path, lines, is_even, is_complex):
    rng = np.random.default_rng(lines)
    hz = 12.5 + 0.125 * np.arange(lines) if is_even else np.cumsum(rng.uniform(0.1, 3.0, lines))
    values = rng.standard_normal(lines) * 10.0 ** rng.uniform(-9, 9, lines)
    if is_complex:
        values = values + 1j * rng.standard_normal(lines)
    path, facts = export_functions(excerpt(known), [function(hz, values)], Format.UFF, tmp_path / "a.uff")
    read = pyuff.UFF(str(path)).read_sets(1)
    assert facts.exists()
    assert (read["func_type"], read["abscissa_spacing"], read["ord_data_type"]) == (
        4,
        int(is_even),
        6 if is_complex else 4,
    )
    np.testing.assert_allclose(read["x"], hz, rtol=1e-12 if is_even else 6e-6)
    np.testing.assert_allclose(read["data"], values, rtol=1e-11)
    axes = ("abscissa", "ordinate", "orddenom")
    assert [read[f"{axis}_spec_data_type"] for axis in axes] == [18, 11, 12]
    assert [read[f"{axis}_len_unit_exp"] for axis in axes] == [0, 1, 1]
    assert [read[f"{axis}_axis_units_lab"].strip() for axis in axes] == ["Hz", "m/s", "m/s2"]
    assert (read["rsp_node"], read["ref_node"]) == (2, 1)
    assert read["id1"].strip() == "m0 velocity over base acceleration"


def test_records_are_as_wide_as_the_definition_says(known, tmp_path):
    hz = np.array([1.0, 2.5, 7.25])
    path, _ = export_functions(
        excerpt(known), [function(hz, np.array([1 + 2j, -3j, 5e-7 + 0j]))], Format.UFF, tmp_path / "a.uff"
    )
    lines = path.read_text(encoding="ascii").splitlines()
    start = lines.index("    58")
    header, numbers = lines[start + 1 : start + 12], lines[start + 12 : -1]
    assert [len(line) for line in header[:5]] == [80] * 5
    assert len(header[5]) == 5 + 10 + 5 + 10 + 2 * (1 + 10 + 10 + 4)
    assert len(header[6]) == 3 * 10 + 3 * 13
    assert {len(line) for line in header[7:]} == {10 + 3 * 5 + 2 * 21}
    assert [len(line) for line in numbers] == [13 + 2 * 20] * 3
    assert (lines[start - 1], lines[-1]) == ("    -1", "    -1")


def test_densities_are_those_of_the_chosen_channels_and_seconds(known, known_values, tmp_path):
    chosen = excerpt(known, ["m0_velocity"], 0.2, 1.3)
    functions = spectral_functions(chosen, FrequencyResponseRequest())
    path, _ = export_functions(chosen, functions, Format.UFF, tmp_path / "a.uff")
    read = pyuff.UFF(str(path)).read_sets(1)
    samples = known_values["m0_velocity"][chosen.start : chosen.stop]
    wanted = spectral_density(samples, 51_200.0, segment_samples=51_200)
    assert (read["func_type"], read["ordinate_spec_data_type"]) == (9, 11)
    assert read["ordinate_axis_units_lab"].strip() == "(m s-1)2/Hz"
    np.testing.assert_allclose(read["x"], wanted.frequency_hz)
    np.testing.assert_allclose(read["data"], wanted.density, rtol=1e-10)


def test_a_format_without_a_place_for_spectra_says_which_has_one(known, tmp_path):
    with pytest.raises(InvalidRequest, match=r"spectra were asked for as csv.*ask for uff"):
        export_functions(excerpt(known), [], Format.CSV, tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())


def test_an_import_passes_spectra_over(known, tmp_path):
    hz = np.arange(1.0, 5.0)
    path, _ = export_functions(excerpt(known), [function(hz, hz * 1j)], Format.UFF, tmp_path / "a.uff")
    mixed, _ = export_samples(excerpt(known), Format.UFF, tmp_path / "b.uff")
    mixed.write_bytes(path.read_bytes() + mixed.read_bytes())
    with opened_source(mixed) as source:
        assert [each.label for each in source.channels] == ["drive_voltage", "m0_velocity"]
