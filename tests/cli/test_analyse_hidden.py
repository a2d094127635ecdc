"""`vibench analyse --hidden`: hidden motion in numbers, figures and report, or the reason for its absence."""

import csv
import json

import numpy as np
import pytest
from scipy.io import loadmat

from tests.analysis.hidden_motion import shaken_world as world
from vibench.sim import gong2025

GAP_M = 45e-6


@pytest.fixture(scope="module")
def shaken(tmp_path_factory):
    """Return a recording of a dwell with impacts in the simulated world."""
    return world.shake(tmp_path_factory.mktemp("shaken"), 260.0, 1.5, seed=51)


@pytest.mark.thorough
def test_the_hidden_motion_is_reported_in_numbers_and_figures_and_in_a_report(vibench_here, shaken, tmp_path):
    done = vibench_here("analyse", shaken.path, "--hidden", "--no-simulate", "--out", "told", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "shaken: p was tracked in" in done.stdout
    assert "Upper gap: (45.0" in done.stdout
    page = (tmp_path / "told" / "report.html").read_text()
    assert "Hidden motion of shaken" in page
    assert "Collisions of shaken" in page
    with (tmp_path / "told" / "figures" / "hidden_impacts_shaken.csv").open() as file:
        rows = list(csv.DictReader(file))
    true = [each for each in shaken.touches if each > 0.1 * 51_200]
    assert len(rows) == pytest.approx(len(true), rel=0.01)


@pytest.mark.thorough
def test_the_json_output_contains_bounds_and_undetermined_values(vibench_here, shaken, tmp_path):
    done = vibench_here("analyse", shaken.path, "--hidden", "--no-simulate", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)["hidden_motion"]["shaken"]
    gap = told["parameters"]["upper_gap_m"]
    assert gap["low"] < GAP_M < gap["high"]
    assert gap["not_determined"] is None
    assert told["share_followed"] > 0.95
    assert told["without_contact_model"]["gaps_m"] == pytest.approx([GAP_M, GAP_M], abs=0.5e-6)


@pytest.mark.thorough
def test_a_report_is_written_even_if_the_stops_cannot_be_tracked(vibench_here, tmp_path, monkeypatch):
    rigid = world.RIG.specimen.model_copy(update={"contact": "rigid:0.8"})
    monkeypatch.setattr(world, "RIG", world.RIG.model_copy(update={"specimen": rigid}))
    recorded = world.shake(tmp_path, 260.0, 1.5, seed=51, specimen=gong2025())
    done = vibench_here("analyse", recorded.path, "--hidden", "--no-simulate", "--out", "told", cwd=tmp_path)
    assert "shaken: no hidden motion: stops of the kind 'rigid' cannot be tracked" in done.stderr
    assert (tmp_path / "told" / "report.html").exists()


def test_a_specimen_with_rigid_stops_is_refused_before_computation(vibench_here, shaken, tmp_path):
    options = ("--hidden", "--specimen", "rigid_stops", "--out", "told")
    done = vibench_here("analyse", shaken.path, *options, cwd=tmp_path)
    assert done.returncode == 1
    assert "stops of the kind 'rigid' cannot be tracked" in done.stderr
    assert not (tmp_path / "told").exists()


@pytest.mark.thorough
def test_a_stored_hidden_motion_is_exported_with_the_recording(vibench_here, shaken, tmp_path):
    path = tmp_path / "shaken.h5"
    path.write_bytes(shaken.path.read_bytes())
    done = vibench_here("analyse", path, "--hidden", "--keep", "--no-simulate", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    sent = vibench_here("export", path, "--to", "mat", "--results", cwd=tmp_path)
    assert sent.returncode == 0, sent.stderr
    kept = loadmat(tmp_path / "shaken.mat", simplify_cells=True)["results"]["hidden_motion"]
    p, time_s = kept["p"]["values"], kept["time"]["values"]
    true = shaken.p[round(time_s[0] * 51_200) :][: p.size]
    followed = ~np.isnan(p) & (time_s > 0.4)
    assert np.sqrt(np.mean((p - true)[followed] ** 2)) < 0.1e-6
    assert kept["impact_impulse"]["values"].size == kept["impact_time"]["values"].size


def test_the_option_keep_is_refused_without_the_option_hidden(vibench_here, shaken, tmp_path):
    done = vibench_here("analyse", shaken.path, "--keep", cwd=tmp_path)
    assert done.returncode != 0
    assert "--keep was given without --hidden" in done.stderr
