"""A scan of the virtual rig: mode shapes by sdypy-EMA, one figure over all points, invalid folders."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from typer.testing import CliRunner

from vibench.acquisition import load_campaign, open_bench, run_campaign, shipped
from vibench.analysis import (
    FrequencyResponseRequest,
    NotEnoughData,
    Simulation,
    analyse_files,
    recordings_in,
    update_model,
)
from vibench.analysis.errors import UnusableData
from vibench.analysis.frequency_response.noise_response import NoiseAnalysis
from vibench.analysis.report import write_report
from vibench.analysis.results.compared_recording import compare_recording
from vibench.analysis.results.spectral_functions import scans_of
from vibench.cli.__main__ import app
from vibench.sim import gong2025

pyuff = pytest.importorskip("pyuff", reason="pip install vibench[test] brings pyuff")
ema = pytest.importorskip("sdypy.EMA", reason="pip install vibench[test] brings sdypy-EMA")
pytestmark = [pytest.mark.thorough, pytest.mark.timeout(300)]  # a scan takes seconds or longer
BODIES = (0, 0, 1, 2)
"""Mass of each point of the shipped scan, by node."""
PLACES = ([-0.02, 0.02, 0.0, 0.0], [0.0] * 4, [0.0, 0.0, 0.02, 0.04])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings of the shipped scan on the shipped virtual rig."""
    found = tmp_path_factory.mktemp("scan")
    with open_bench(shipped("hardware_configs/virtual_rig.toml")) as bench:
        run_campaign(bench, load_campaign("scan"), found)
    return found


@pytest.fixture(scope="module")
def results(folder):
    return analyse_files(recordings_in(folder), "scan", Simulation.LEFT_OUT)


def mode_shapes():
    """Natural frequencies [Hz] and mode shapes, shape (masses, modes), of the model without contact."""
    specimen = gong2025(contact="linear")
    _, shapes = eigh(np.asarray(specimen.stiffness_matrix), np.asarray(specimen.mass_matrix))
    return specimen.natural_frequencies_hz, shapes


def mac(one, other):
    """Modal assurance criterion of two shapes: 1 if they are equal up to a factor."""
    return abs(np.vdot(one, other)) ** 2 / (np.vdot(one, one) * np.vdot(other, other)).real


@pytest.mark.parametrize("quantity", ["displacement", "displacement/acceleration"])
def test_sdypy_reads_mode_shapes_that_agree_with_the_model(folder, tmp_path, quantity):
    path = tmp_path / "shapes.uff"
    order = ["export", str(folder), "--to", "uff", "--spectra", "--quantity", quantity, "--out", str(path)]
    run = CliRunner().invoke(app, order)
    assert run.exit_code == 0, run.output
    wanted_hz, shapes = mode_shapes()
    model = ema.Model(lower=30, upper=650, pol_order_high=40)
    model.read_uff(str(path))
    model.get_poles(show_progress=False)
    model.select_closest_poles(list(wanted_hz))
    _, constants = model.get_constants(f_upper=600)
    np.testing.assert_allclose(model.nat_freq, wanted_hz, rtol=1e-3)
    for found, wanted in zip(constants.T, shapes[BODIES, :].T, strict=True):
        assert mac(found, wanted) > 0.99
    _, nodes, *functions = pyuff.UFF(str(path)).read_sets()
    assert (nodes["type"], nodes["node_nums"]) == (15, [1, 2, 3, 4])
    assert (nodes["x"], nodes["y"], nodes["z"]) == PLACES
    assert [(each["rsp_node"], each["rsp_dir"]) for each in functions] == [(1, 3), (2, 3), (3, 3), (4, 3)]
    assert [each["id1"].split()[0] for each in functions] == ["m0", "m0", "m1", "m2"]


def test_a_scan_report_has_one_figure_over_all_points(results, tmp_path):
    report = write_report(results, tmp_path / "report.html", tmp_path / "figures")
    text = report.read_text(encoding="utf-8")
    assert text.count("Scan noise: shapes at the resonances") >= 1
    assert "transmission_levels" not in text
    (columns,) = (tmp_path / "figures").glob("scan_*.csv")
    read = np.genfromtxt(columns, delimiter=",", names=True)
    assert list(read["node"]) == [1, 2, 3, 4]
    assert list(read["x_m"]) == PLACES[0]
    _, shapes = mode_shapes()
    for at, shape in zip(("946hz", "2662hz", "4996hz"), shapes.T, strict=True):
        seen = read[f"magnitude_{at}"] * np.exp(1j * np.deg2rad(read[f"phase_deg_{at}"]))
        assert mac(seen, shape[list(BODIES)]) > 0.98  # one line with parts of other modes
        assert np.all(read[f"relative_half_width_{at}"] < 0.2)


def test_only_the_latest_attempt_is_used_and_each_repetition_forms_a_scan(results):
    analyses = [each.analysis for each in results.noise]
    assert all(isinstance(each, NoiseAnalysis) for each in analyses)

    def named(analysis, name):
        return replace(analysis, facts=replace(analysis.facts, name=name))

    again = named(analyses[2], f"{analyses[2].facts.name}.2")
    (scan,) = scans_of([*analyses, again])
    assert [each.name for each in scan.points] == ["m0-left", "m0-right", "m1", "m2"]
    assert scan.analyses[2] is again
    second = [named(each, f"second-{each.facts.name}") for each in reversed(analyses)]
    assert [each.nodes for each in scans_of([*analyses, *second])] == [(1, 2, 3, 4)] * 2


def test_a_folder_without_a_scan_is_refused(folder, tmp_path):
    run = CliRunner().invoke(app, ["export", str(folder), "--to", "csv"])
    assert "The folder of a scan is exported by --to uff --spectra" in str(run.exception)
    run = CliRunner().invoke(app, ["export", str(tmp_path), "--to", "uff", "--spectra"])
    assert "contains no recording" in str(run.exception)


def test_a_single_scan_point_is_exported_with_its_node(folder, tmp_path):
    path = tmp_path / "one.uff"
    order = ["export", str(folder / "noise-m2.h5"), "--to", "uff", "--spectra", "--out", str(path)]
    run = CliRunner().invoke(app, order)
    assert run.exit_code == 0, run.output
    first = pyuff.UFF(str(path)).read_sets(1)
    assert (first["rsp_node"], first["rsp_dir"]) == (4, 3)
    assert first["id1"].strip() == "m2 displacement over base displacement"


def test_comparisons_and_fits_use_only_scan_points_on_m0(folder, results):
    with pytest.raises(
        UnusableData, match=r"noise-m2.h5 is a point of a scan on m2, but comparisons show m0"
    ):
        compare_recording(folder / "noise-m2.h5", FrequencyResponseRequest(), Simulation.LEFT_OUT)
    others = replace(
        results, results=tuple(each for each in results.results if each.analysis.facts.mass != "m0")
    )
    assert len(others.results) == 2
    with pytest.raises(NotEnoughData, match="has no result for m0, so no specimen can be fitted"):
        update_model(others)
