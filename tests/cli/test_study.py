"""`vibench study` as a user runs it: a file of results, one-sentence errors, Ctrl-C and resume."""

import contextlib
import signal
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import typer

from vibench.cli.reproduce import KeptStudies
from vibench.sim.study import PointState, Study, open_study

from .conftest import ENVIRONMENT, ROOT

SMALL = """
amplitudes_m = [1e-6, 20e-6]
frequencies_hz = { start = 200, stop = 260, step = 30 }
starts = ["rest", "up"]
duration_s = 0.5
window_s = 0.2
"""
LONG = """
amplitudes_m = [20e-6]
frequencies_hz = { start = 200, stop = 205, step = 0.025 }
duration_s = 0.5
window_s = 0.2
"""
LONG_POINTS = 201
LOOK_S = 0.05
pytestmark = pytest.mark.timeout(300)  # the first test after a change of the engine compiles it


def plan(folder, text=SMALL):
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_an_estimate_counts_points_and_work_and_writes_no_file(output_of, tmp_path):
    told = {}
    for duration_s in (0.5, 5.0):
        asked = plan(tmp_path, SMALL.replace("duration_s = 0.5", f"duration_s = {duration_s}"))
        told[duration_s] = output_of("study", asked, "--out", "a.h5", "--estimate", "--json")
    assert [each["points"] for each in told.values()] == [12, 12]
    assert 3.0 < told[5.0]["work_s"] / told[0.5]["work_s"] <= 10.5
    assert "12 points, estimated work" in output_of("study", asked, "--out", "a.h5", "--estimate")
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


@pytest.mark.thorough
def test_a_study_is_predicted_into_a_file_and_a_second_run_overwrites_nothing(output_of, refusal, tmp_path):
    asked = plan(tmp_path)
    said = output_of("study", asked, "--out", "a.h5", "--json")
    assert (said["points"], said["kept"], said["failures"]) == (12, 12, [])
    results = open_study(tmp_path / "a.h5")
    assert np.all(results.state == PointState.DONE)
    assert results.values("response_i", amplitude=20e-6, frequency=230.0).shape == (1, 1, 1, 2)
    before = (tmp_path / "a.h5").read_bytes()
    assert "a.h5 exists, and nothing is ever overwritten; resume it" in refusal(
        "study", asked, "--out", "a.h5"
    )
    resumed = output_of("study", asked, "--out", "a.h5", "--resume", "--workers", "1")
    assert "12 of 12 points, 0 failed (complete)" in resumed
    assert (tmp_path / "a.h5").read_bytes() == before


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C cannot be sent to one process there")
def test_ctrl_c_keeps_the_computed_points_and_a_resume_continues(vibench, tmp_path):
    asked = plan(tmp_path, LONG)
    running = subprocess.Popen(
        [sys.executable, "-m", "vibench.cli", "study", str(asked), "--out", "a.h5"],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    try:
        while running.poll() is None and not has_results(tmp_path / "a.h5"):
            with contextlib.suppress(subprocess.TimeoutExpired):
                running.wait(timeout=LOOK_S)
        running.send_signal(signal.SIGINT)
        out, _ = running.communicate(timeout=60)
    finally:
        running.kill()
    assert running.returncode == 3
    assert b"stopped: continue with --resume" in out
    kept = open_study(tmp_path / "a.h5").done
    assert 0 < kept < LONG_POINTS
    resumed = vibench("study", asked, "--out", "a.h5", "--resume", cwd=tmp_path)
    assert resumed.returncode == 0, resumed.stderr
    results = open_study(tmp_path / "a.h5")
    assert results.is_complete
    assert np.count_nonzero(results.values("session") == 0.0) == kept


def has_results(path):
    """Return whether an unfinished file already contains a result."""
    return path.exists() and path.stat().st_size > 0 and open_study(path).done > 0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("window_s = 0.2", "windows_s = 0.2", "windows_s is not a known key"),
        ("duration_s = 0.5", 'models = ["herz"]', "models.0 = 'herz': contact 'herz' is not known"),
        ("duration_s = 0.5", "specimen.masses_kg = [1, 1, -1]", "specimen.masses_kg.2 = -1: input should"),
        ("duration_s = 0.5", "specimen.gap_m = -1", "specimen.gap_m = -1: it must be a number above 0 [m]"),
        ('starts = ["rest", "up"]', 'starts = ["left"]', "starts.0 = 'left': input should be 'rest', 'up'"),
    ],
)
def test_a_wrong_study_is_refused_with_a_readable_message(refusal, tmp_path, old, new, said):
    assert old in SMALL
    sentence = refusal("study", plan(tmp_path, SMALL.replace(old, new)), "--out", "a.h5")
    assert said in sentence
    assert "; " not in sentence, "one fault is told once"
    assert not (tmp_path / "a.h5").exists()


@pytest.mark.thorough
def test_a_study_with_a_failed_point_is_saved_and_returns_an_error(vibench_here, tmp_path):
    chatter = 'models = ["hertz", "rigid:1"]\ngaps_m = [1e-9]\nduration_s = 0.3\nwindow_s = 0.01\n'
    asked = plan(tmp_path, chatter + "amplitudes_m = [1e-3]\nfrequencies_hz = [100]\n")
    ran = vibench_here("study", asked, "--out", "a.h5", cwd=tmp_path)
    assert ran.returncode == 1
    assert "2 of 2 points, 1 failed (complete)" in ran.stdout
    assert "error: model rigid:1: more impacts than allowed" in ran.stderr
    assert np.isfinite(open_study(tmp_path / "a.h5").values("response_i", model="hertz")).all()
    # Figures and reproductions of such a study are made, and also return the error.
    studies = KeptStudies(tmp_path / "studies", 1)
    assert studies(Study.model_validate(tomllib.loads(asked.read_text(encoding="utf-8")))).is_complete
    with pytest.raises(typer.Exit) as ended:
        studies.complain()
    assert ended.value.exit_code == 1


@pytest.mark.parametrize("out", ["a.csv", "a.txt", "a.xlsx"])
def test_a_study_file_with_the_suffix_of_another_format_is_refused(refusal, tmp_path, out):
    assert "use the suffix .h5" in refusal("study", "paper", "--out", out)
    assert list(tmp_path.iterdir()) == []


def test_an_unreachable_cluster_is_reported_in_one_sentence(refusal, tmp_path):
    pytest.importorskip("distributed", reason="a cluster needs the extra 'cluster'")
    said = refusal("study", plan(tmp_path), "--out", "a.h5", "--cluster", "nonsense:what")
    assert "No Dask scheduler answers at 'nonsense:what'" in said
    assert not (tmp_path / "a.h5").exists()


@pytest.mark.parametrize("shipped", sorted((ROOT / "studies").glob("*.toml")), ids=lambda path: path.name)
def test_every_shipped_study_is_valid(shipped):
    asked = Study.model_validate(tomllib.loads(shipped.read_text(encoding="utf-8")))
    assert asked.grid.size > 0
