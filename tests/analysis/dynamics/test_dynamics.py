"""Requests for branches and exponent spectra: refusals, files, curves, recorded levels, figures."""

import json
import math
from dataclasses import fields

import h5py
import numpy as np
import pytest
from pydantic import ValidationError

from vibench.analysis import (
    CurveKind,
    CurveOrigin,
    InvalidRequest,
    NotEnoughData,
    curve_difference,
    curve_peaks,
)
from vibench.analysis.dynamics import (
    BranchDiagram,
    BranchLine,
    BranchMethod,
    BranchRequest,
    LineEvent,
    SpectrumRequest,
    diagram_of,
    exponent_spectrum,
    read_diagram,
    recorded_level,
    write_diagram,
    write_spectrum,
)
from vibench.analysis.report import branches_figure, exponent_spectrum_figure
from vibench.analysis.sine.stepped_response import TrackedResonance
from vibench.sim import Parameter, gong2025


def line(frequency_hz, size, multiplier, events=(), periods=1):
    n = len(frequency_hz)
    wide = np.outer(size, np.ones(4))
    inside = np.zeros((n, 6))
    inside[:, 0] = multiplier
    return BranchLine(
        np.asarray(frequency_hz, float), np.full(n, 5e-6), wide, 0.9 * wide, np.zeros((n, 6)), inside,
        np.zeros((n, 6)), np.ones(n, np.int64), np.full(n, 1e-8), tuple(events), periods, "mirrored",
        False, False, "searched", "an end", "an end", 0.5,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("method", "said"),
    [
        (BranchMethod.SHOOTING, "No periodic motion was found; 1.0 s."),
        (BranchMethod.BALANCE, "Harmonic balance with at most 64 harmonics found no motion"),
    ],
)
def test_the_sentence_on_an_empty_branch_diagram_names_the_method(method, said):
    """Harmonic balance may find no motion where shooting does, so the sentence names the method."""
    none = BranchDiagram(BranchRequest(start=100.0, stop=120.0, method=method, harmonics=64), (), 1.0)
    assert none.cost_sentence.startswith(said)


FOLDED = line(
    [100.0, 110.0, 120.0, 115.0, 105.0],
    [1.0, 2.0, 3.0, 2.5, 2.0],
    [0.5, 0.9, 0.99, 1.2, 1.5],
    [LineEvent("fold", 120.5, 5e-6, 2, 2.6)],
)
DIAGRAM = BranchDiagram(BranchRequest(start=100.0, stop=120.0), (FOLDED,), 1.0)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"start": 600.0, "stop": 50.0}, "does not ascend"),
        ({"method": "balance", "model": "rigid:0.8"}, "needs a finite contact force"),
        ({"recorded_level": ((100.0, 1e-6),)}, "two or more ascending"),
        ({"recorded_level": ((200.0, 1e-6), (100.0, 1e-6))}, "two or more ascending"),
        (
            {"recorded_level": ((100.0, 1e-6), (200.0, 1e-6)), "along": "amplitude"},
            "needs branches along frequency",
        ),
        ({"resonance_band_hz": (97.0, 92.0), "along": "amplitude"}, "does not ascend"),
        ({"resonance_band_hz": (92.0, 97.0)}, "is followed along amplitude"),
        ({"amplitude_m": 0.0}, "greater than 0"),
        ({"amplitude_m": math.nan}, "finite"),
    ],
)
def test_invalid_branch_requests_are_refused_with_a_readable_message(options, said):
    with pytest.raises(ValidationError, match=said):
        BranchRequest(**options)


def test_a_branch_file_round_trips_and_is_never_overwritten(tmp_path):
    path = write_diagram(DIAGRAM, tmp_path / "b.h5")
    again = read_diagram(path)
    assert again.request == DIAGRAM.request
    assert again.elapsed_s == DIAGRAM.elapsed_s
    for mine, theirs in zip(DIAGRAM.lines, again.lines, strict=True):
        for each in fields(BranchLine):
            np.testing.assert_array_equal(getattr(mine, each.name), getattr(theirs, each.name))
    with h5py.File(path) as file:
        assert file["branch_000/frequency_hz"].attrs["units"] == "Hz"
        assert json.loads(file.attrs["request"])["amplitude_m"] == 5e-6
    before = path.read_bytes()
    with pytest.raises(InvalidRequest, match="ever overwritten"):
        write_diagram(DIAGRAM, path)
    assert path.read_bytes() == before


def test_a_dynamics_file_without_branches_is_refused(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["a"] = 1
    (tmp_path / "y.h5").write_text("no HDF5")
    for name in ("x.h5", "y.h5", "z.h5"):
        with pytest.raises(InvalidRequest, match="give a file that vibench branches wrote"):
            read_diagram(tmp_path / name)
    with pytest.raises(InvalidRequest, match=r"z\.h5 does not exist, or is not a file"):
        read_diagram(tmp_path / "z.h5")
    with pytest.raises(InvalidRequest, match="is a folder; give a file that vibench branches wrote"):
        read_diagram(tmp_path)


def replace_column(group, values):
    del group["response_i"]
    group["response_i"] = values


@pytest.mark.parametrize(
    "change",
    [
        lambda group: replace_column(group, group["response_i"][:-1]),
        lambda group: replace_column(group, group["response_i"][:, 0]),
        lambda group: replace_column(group, "text"),
        lambda group: replace_column(group, h5py.ExternalLink("other.h5", "x")),
        lambda group: group.attrs.__setitem__("periods", "text"),
        lambda group: group["events"].pop("index"),
        lambda group: group.file.attrs.__setitem__("format_version", 99),
    ],
)
def test_a_changed_branch_file_is_refused(tmp_path, change):
    found = BranchDiagram(BranchRequest(), (line([90.0, 91.0], [1.0, 2.0], [0.5, 0.5]),), 1.0)
    path = write_diagram(found, tmp_path / "b.h5")
    assert read_diagram(path).lines[0].points == 2
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = found.lines[0].response_i
    with h5py.File(path, "r+") as file:
        change(file["branch_000"])
    with pytest.raises(InvalidRequest, match="cannot be read as branches"):
        read_diagram(path)


def test_the_json_document_contains_every_branch_point():
    found = json.loads(json.dumps(DIAGRAM.to_dict(), allow_nan=False))
    (branch,) = found["branches"]
    assert [each["largest_multiplier"] for each in branch["points"]] == [0.5, 0.9, 0.99, 1.2, 1.5]
    assert [each["is_stable"] for each in branch["points"]] == [True] * 3 + [False] * 2
    assert [each["kind"] for each in branch["events"]] == ["fold"]


def test_a_multiplier_on_the_unit_circle_within_its_error_is_undecided():
    found = line([100.0, 101.0, 102.0, 103.0, 104.0], np.ones(5), [0.9, 1.0 - 5e-9, 1.0, 1.0 + 5e-9, 1.1])
    assert found.is_stable.tolist() == [True] + [False] * 4
    assert found.is_unstable.tolist() == [False] * 4 + [True]
    diagram = BranchDiagram(BranchRequest(start=100.0, stop=104.0), (found,), 1.0)
    frequency_hz = {each.origin: each.frequency_hz.tolist() for each in diagram.curves()}
    assert frequency_hz == {
        CurveOrigin.UNDECIDED: [100.0, 101.0, 102.0, 103.0],
        CurveOrigin.UNSTABLE: [103.0, 104.0],
    }
    branches_figure(diagram)


def test_the_stable_and_unstable_parts_of_a_branch_are_separate_curves():
    curves = {(each.origin, each.response): each for each in DIAGRAM.curves()}
    stable = curves[CurveOrigin.STABLE, CurveKind.RESPONSE_I]
    unstable = curves[CurveOrigin.UNSTABLE, CurveKind.RESPONSE_I]
    assert stable.magnitude.tolist() == [1.0, 2.0, 3.0]
    assert unstable.frequency_hz.tolist() == [120.0, 115.0, 105.0]
    assert curves[CurveOrigin.STABLE, CurveKind.RESPONSE_II].magnitude == pytest.approx([0.9, 1.8, 2.7])
    assert curve_peaks(unstable) == ()
    assert np.isnan(unstable.at(np.array([110.0])).magnitude).all()
    with pytest.raises(NotEnoughData, match="several values at one frequency"):
        curve_difference(stable, unstable)
    along = BranchRequest(along=Parameter.AMPLITUDE, start=1e-6, stop=2e-6)
    assert BranchDiagram(along, (FOLDED,), 1.0).curves() == ()


def test_a_recorded_level_is_the_median_per_bin_in_ascending_frequency():
    rng = np.random.default_rng(3)
    frequency = np.concatenate([np.linspace(50.0, 300.0, 4000), np.linspace(300.0, 50.0, 4000)])
    level = 1e-6 * (1.0 + 100.0 / frequency) * (1.0 + 0.01 * rng.standard_normal(8000))
    level[::97] = 5e-3
    pairs = np.array(recorded_level(frequency, level))
    assert len(pairs) == 100
    assert np.all(np.diff(pairs[:, 0]) > 0.0)
    assert pairs[:, 1] == pytest.approx(1e-6 * (1.0 + 100.0 / pairs[:, 0]), rel=0.03)
    few = recorded_level(np.array([100.0, 90.0, 110.0]), np.array([1e-6, 2e-6, 3e-6]))
    assert few == ((90.0, 2e-6), (100.0, 1e-6), (110.0, 3e-6))
    with pytest.raises(NotEnoughData, match="covers no range of frequencies"):
        recorded_level(np.full(5, 260.0), np.full(5, 1e-6))


@pytest.mark.parametrize("along", list(Parameter))
def test_a_figure_draws_unstable_parts_of_branches_dashed_and_marks_events(along):
    request = BranchRequest(along=along, start=1e-6 if along is Parameter.AMPLITUDE else 100.0, stop=120.0)
    drawn = branches_figure(BranchDiagram(request, (FOLDED,), 1.0))
    first, second = drawn.figure.axes
    solid, dashed = first.get_lines()
    assert solid.get_linestyle() == "-"
    assert dashed.get_linestyle() == "--"
    assert solid.get_ydata().tolist() == [1.0, 2.0, 3.0]
    (fold,) = (each for each in second.get_lines() if each.get_label() == "fold")
    scale = 1.0 if along is Parameter.FREQUENCY else 1e6
    assert fold.get_xdata()[0] == pytest.approx(120.5 if scale == 1.0 else 5.0)
    assert [each.name for each in drawn.tables] == ["branches", "branches_special_points"]


def test_motions_that_can_be_held_are_reported_in_figures_and_text_and_tables_and_json():
    growth_s = FOLDED.growth_time_s
    assert np.isinf(growth_s[:3]).all()
    assert growth_s[3:] == pytest.approx([1 / (115.0 * math.log(1.2)), 1 / (105.0 * math.log(1.5))])
    # The loop is fast enough for the slower of the two unstable motions only.
    loop_s = 0.1 * math.sqrt(growth_s[3] * growth_s[4])
    diagram = BranchDiagram(BranchRequest(start=100.0, stop=120.0, loop_time_s=loop_s), (FOLDED,), 1.0)
    assert diagram.holdable[0].tolist() == [True, True, True, True, False]
    assert "1 of 2 unstable ones; the fastest e-fold growth takes 0.023 s" in diagram.holding_sentence
    drawn = branches_figure(diagram)
    third = drawn.figure.axes[2]
    labelled = {each.get_label(): each for each in third.get_lines()}
    assert labelled["can be held"].get_xdata().tolist() == [115.0]
    assert labelled["cannot be held by this bench"].get_xdata().tolist() == [105.0]
    assert diagram.holding_sentence in drawn.caption
    assert "growth_time_s" in dict(drawn.tables[0].columns)
    document = json.loads(json.dumps(diagram.to_dict(), allow_nan=False))
    assert document["least_growth_time_s"] == pytest.approx(10.0 * loop_s)
    assert [each["growth_time_s"] is None for each in document["branches"][0]["points"]] == [True] * 3 + [
        False
    ] * 2
    assert DIAGRAM.holdable is None
    assert DIAGRAM.holding_sentence == ""
    assert len(branches_figure(DIAGRAM).figure.axes) == 2


def test_a_phase_resonance_is_drawn_with_its_tracked_points():
    request = BranchRequest(along=Parameter.AMPLITUDE, start=1e-8, stop=1e-7, resonance_band_hz=(92.0, 97.0))
    diagram = diagram_of(request)
    (found,) = diagram.lines
    assert found.frequency_hz == pytest.approx(94.602, abs=1e-3)
    base = 5e-8 * (2 * np.pi * 94.6) ** 2
    tracked = TrackedResonance(
        number=0,
        base_m_per_s2=base,
        frequency_hz=94.6,
        u_frequency_hz=0.01,
        amplitude_m=1.9e-7,
        harmonic=1,
        subharmonic=1,
        mode_hz=None,
        u_mode_hz=None,
        damping_ratio=None,
    )
    first, second = branches_figure(diagram, tracked=(tracked,)).figure.axes
    (bars,) = first.containers
    assert bars.lines[0].get_xydata().tolist() == [[pytest.approx(0.05), 94.6]]
    assert second.get_lines()[-1].get_ydata().tolist() == [pytest.approx(3.8)]
    assert first.get_lines()[0].get_ydata() == pytest.approx(found.frequency_hz)


def test_the_sum_of_an_exponent_spectrum_matches_the_damping(tmp_path):
    request = SpectrumRequest(start=255.0, stop=260.0, step=5.0, duration_s=1.5, settle_s=0.5)
    found = exponent_spectrum(request)
    assert found.largest_sum_difference < 1e-6
    specimen = gong2025()
    trace = np.trace(np.linalg.solve(specimen.mass_matrix, specimen.damping_matrix))
    assert found.points[0].dampers_per_s == pytest.approx(-trace, rel=1e-12)
    for each in found.points:
        assert np.all(np.array(each.low_per_s) < np.array(each.exponents_per_s))
        assert each.dimension_low <= each.dimension <= each.dimension_high
    path = write_spectrum(found, tmp_path / "s.h5")
    with h5py.File(path) as file:
        assert file["exponents_per_s"].shape == (2, 6)
        assert file["sum_per_s"].attrs["units"] == "1/s"
    json.dumps(found.to_dict(), allow_nan=False)
    upper, lower = exponent_spectrum_figure(found).figure.axes
    assert len(upper.containers) == 6
    assert lower.get_ylabel() == "dimension"


def test_the_damping_check_of_exponents_is_not_made_for_a_lossy_contact():
    request = SpectrumRequest(model="rigid:0.8", start=260.0, stop=260.0, duration_s=1.5, settle_s=0.5)
    found = exponent_spectrum(request)
    assert math.isnan(found.largest_sum_difference)
    assert "the contact dissipates energy" in found.cost_sentence
    json.dumps(found.to_dict(), allow_nan=False)


@pytest.mark.thorough
def test_a_harmonic_balance_reports_whether_its_harmonics_converged():
    options = {"model": "power:5", "start": 60.0, "stop": 80.0, "places": 2, "starts": 0}
    first = diagram_of(BranchRequest(method=BranchMethod.FIRST_ORDER, **options))
    many = diagram_of(BranchRequest(method=BranchMethod.BALANCE, **options))
    exact = diagram_of(BranchRequest(**options))
    ends = [each.lines[0].response_ii[-1, 3] for each in (first, many, exact)]
    errors = [each.lines[0].error_estimate[-1] for each in (first, many, exact)]
    assert abs(ends[0] / ends[2] - 1.0) < 5.0 * errors[0]
    assert abs(ends[1] / ends[2] - 1.0) < max(5.0 * errors[1], 1e-7)
    assert errors[1] <= 1e-4 < errors[0]
    assert errors[2] < 1e-6
