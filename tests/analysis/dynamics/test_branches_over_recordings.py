"""Branches overlaid on recordings: recorded level, report figure and the option `--like`."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition.plan import SteppedSine
from vibench.analysis import (
    FrequencyResponseRequest,
    Simulation,
    analyse_files,
    compare_recording,
    level_of_drive,
)
from vibench.analysis.dynamics import BranchDiagram, BranchRequest, diagram_of, write_diagram
from vibench.analysis.report import write_report
from vibench.analysis.report._drawings import limits
from vibench.analysis.report._maps import draw_branches, draw_maps
from vibench.cli.__main__ import app
from vibench.sim import gong2025
from vibench.sim.maps import open_map


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


def test_the_recorded_level_matches_the_base_amplitude_at_every_frequency_step(level, stepped_file):
    (result,) = analyse_files((stepped_file,), "steps", Simulation.LEFT_OUT).results
    found = result.analysis.response
    assert [each[0] for each in level] == sorted(each[0] for each in level)
    for frequency, amplitude in level:
        near = np.abs(found.frequency_hz - frequency) < 0.5
        assert found.drive_amplitude_m[near].min() <= amplitude <= found.drive_amplitude_m[near].max()


@pytest.mark.thorough
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
def test_the_like_option_takes_the_frequency_range_and_level_from_a_recording(stepped_file, level, tmp_path):
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


@pytest.fixture
def narrow_file(monkeypatch, tmp_path):
    """Stepped sine whose bench describes a gap of 30 um instead of 45 um."""
    monkeypatch.setitem(synthetic.BENCH, "specimen", {**synthetic.BENCH["specimen"], "gap_m": 3e-5})
    motions = [synthetic.sine(2.0, each, 1e-6) for each in (150.0, 180.0)]
    parts = [
        synthetic.Part("step", 2.5 * n + 1.0, 2.5 * n + 1.5, {"frequency_hz": each, "direction": "up"})
        for n, each in enumerate((150.0, 180.0))
    ]
    plan = SteppedSine(amplitude_vpp=0.05, frequencies_hz=(150.0, 180.0), settle_s=1.0, record_s=0.5)
    velocity = np.concatenate([synthetic.response_of(each)[0] for each in motions])
    return synthetic.write_recording(
        tmp_path, plan, synthetic.joined(motions), velocity, parts, name="narrow"
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    "command", [("branches", "--like"), ("chain", "--cells", "1", "--duration", "0.1", "--recording")]
)
def test_a_recording_also_defines_the_specimen(command, narrow_file):
    command = (*command, str(narrow_file), "--json")
    options = ("--method", "balance", "--places", "2") if command[0] == "branches" else ()
    alike = CliRunner().invoke(app, [*command, *options])
    assert alike.exit_code == 0, alike.output
    assert json.loads(alike.stdout)["options"]["described"]["gap_m"] == 3e-5
    assert "specimen" not in alike.stderr
    named = CliRunner().invoke(app, [*command, *options, "--specimen", "gong2025"])
    assert json.loads(named.stdout)["options"]["described"]["gap_m"] == 45e-6
    warning = " ".join(named.stderr.split())
    assert "The simulated specimen is not the one described in narrow.h5: gaps" in warning
    assert "[4.5e-05, 4.5e-05] m instead of gaps [3e-05, 3e-05] m." in warning


@pytest.mark.thorough
def test_a_map_and_a_report_state_that_the_recordings_have_another_specimen(narrow_file, diagram, tmp_path):
    plan = tmp_path / "map.toml"
    level = "{ start = 1e-7, stop = 1e-5, points = 2 }"
    plan.write_text(
        f"frequency_hz = {{ start = 140, stop = 190, points = 2 }}\namplitude_m = {level}\n", "utf-8"
    )
    mapped = ["map", str(plan), "--out", str(tmp_path / "map"), "--like", str(narrow_file)]
    result = CliRunner().invoke(app, mapped)
    assert "not the one described in narrow: gaps [4.5e-05" in " ".join(result.stderr.split())
    results = analyse_files((narrow_file,), "steps", Simulation.LEFT_OUT)
    (branches,) = draw_branches(results, [diagram])
    (motions,) = draw_maps(results, [open_map(tmp_path / "map" / "map.h5")])
    for drawn in (branches, motions):
        assert "not the one described in narrow: gaps [4.5e-05" in drawn.caption


def test_a_report_states_that_another_specimen_was_simulated(narrow_file):
    asked = ((narrow_file,), "steps", Simulation.UNDER_BASE)
    (sentence,) = (
        each for each in limits(analyse_files(*asked, specimen=gong2025())) if "not the one" in each
    )
    assert sentence.startswith("The simulated specimen is not the one described in narrow: gaps [4.5e-05, ")
    assert not any("not the one" in each for each in limits(analyse_files(*asked)))
    uneven = replace(gong2025(), dampings=(0.4, 0.1, 0.2))
    found = limits(analyse_files(*asked, specimen=uneven))
    assert any("assumes damping of c0, c1, c2 = 0.4, 0.1, 0.2 N s/m and a gap" in each for each in found)


def test_branches_of_another_parameter_are_not_drawn_into_a_map(diagram, tmp_path):
    kept = write_diagram(diagram, tmp_path / "b.h5")
    plan = tmp_path / "map.toml"
    plan.write_text("frequency_hz = 160\namplitude_m = { start = 1e-7, stop = 1e-5, points = 2 }\n", "utf-8")
    refused = CliRunner().invoke(
        app, ["map", str(plan), "--out", str(tmp_path / "m"), "--branches", str(kept)]
    )
    assert "contains branches over frequency; give a map with a range of frequency only" in str(
        refused.exception
    )
    plan.write_text("frequency_hz = { start = 150, stop = 180, points = 2 }\ngap_m = 3e-5\n", "utf-8")
    drawn = CliRunner().invoke(app, ["map", str(plan), "--out", str(tmp_path / "m"), "--branches", str(kept)])
    warnings = " ".join(drawn.stderr.split())
    assert "the drive of the map differs from the drive of the branches (hertz, recorded" in warnings
    assert (
        "not the one described in b.h5: gaps [3e-05, 3e-05] m instead of gaps [4.5e-05, 4.5e-05] m"
        in warnings
    )


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
