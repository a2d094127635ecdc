"""Branches overlaid on recordings: recorded level, report figure and the option `--like`."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from vibench.analysis import (
    FrequencyResponseRequest,
    NotEnoughData,
    Simulation,
    analyse_files,
    compare_recording,
    level_of_drive,
)
from vibench.analysis.dynamics import BranchDiagram, BranchRequest, diagram_of, write_diagram
from vibench.analysis.report import write_report
from vibench.analysis.report._report import draw_branches
from vibench.cli.__main__ import app


def comparison(path):
    return compare_recording(path, FrequencyResponseRequest(), Simulation.LEFT_OUT)


@pytest.fixture(scope="module")
def level(stepped_file):
    """Recorded base amplitude [m] over frequency [Hz]."""
    return level_of_drive(comparison(stepped_file))


@pytest.fixture(scope="module")
def diagram(level):
    """Branches computed for the recorded level."""
    low, high = level[0][0], level[-1][0]
    return diagram_of(BranchRequest(recorded_level=level, start=low, stop=high, places=2, starts=0))


def test_the_recorded_level_matches_every_frequency_step(level, stepped_file):
    (result,) = analyse_files((stepped_file,), "steps", Simulation.LEFT_OUT).results
    found = result.analysis.response
    assert [each[0] for each in level] == sorted(each[0] for each in level)
    for frequency, amplitude in level:
        near = np.abs(found.frequency_hz - frequency) < 0.5
        assert found.drive_amplitude_m[near].min() <= amplitude <= found.drive_amplitude_m[near].max()


def test_a_dwell_has_no_level_over_frequency(dwell_file):
    path = dwell_file()
    with pytest.raises(
        NotEnoughData, match=rf"^{path.name} does not contain levels .* choose a stepped sine"
    ):
        level_of_drive(comparison(path))


def test_a_report_overlays_branches_and_states_level_differences(diagram, stepped_file, tmp_path):
    results = analyse_files((stepped_file,), "steps", Simulation.LEFT_OUT)
    (drawn,) = draw_branches(results, [diagram])
    measured = [each for each in drawn.figure.axes[0].get_lines() if "measured" in str(each.get_label())]
    assert sum(len(each.get_xdata()) for each in measured) == len(
        results.results[0].analysis.response.frequency_hz
    )
    assert "is 1 to 1 times the amplitude of" in drawn.caption
    half = BranchRequest(amplitude_m=1.0, start=diagram.request.start, stop=diagram.request.stop)
    (other,) = draw_branches(results, [BranchDiagram(half, diagram.lines, 1.0)])
    assert "is 1 to 1 times" not in other.caption
    page = write_report(results, tmp_path / "report.html", diagrams=[diagram]).read_text("utf-8")
    assert "Branches: hertz, recorded level, shooting" in page


@pytest.mark.thorough
def test_the_like_option_takes_frequency_range_and_level_from_a_recording(stepped_file, level, tmp_path):
    options = ("--places", "2", "--starts", "0", "--json", "--out", str(tmp_path / "like"))
    result = CliRunner().invoke(app, ["branches", "--like", str(stepped_file), *options])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    asked = found["options"]
    assert [tuple(each) for each in asked["recorded_level"]] == list(level)
    points = [point for branch in found["branches"] for point in branch["points"]]
    path = BranchRequest.model_validate(asked).path
    for point in points:
        assert point["amplitude_m"] == pytest.approx(path.drive(point["frequency_hz"])[1], rel=1e-9)
    refused = CliRunner().invoke(app, ["branches", "--like", str(stepped_file), "--amplitude", "1e-6"])
    assert "the recording defines the amplitude" in str(refused.exception)


@pytest.mark.thorough
def test_an_analysis_draws_branches_from_a_saved_file(diagram, stepped_file, tmp_path):
    kept = write_diagram(diagram, tmp_path / "b.h5")
    arguments = [
        "analyse",
        str(stepped_file),
        "--no-simulate",
        "--out",
        str(tmp_path),
        "--branches",
        str(kept),
    ]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "figures" / "branches_1.png").is_file()
