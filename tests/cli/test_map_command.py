"""`vibench map` as a user runs it: a folder with a file and a picture, and one-sentence errors."""

import json

import numpy as np
import pytest

from vibench.cli.map_motions import FILE
from vibench.sim.maps import open_map

xarray = pytest.importorskip("xarray", reason="pip install vibench[exchange] brings xarray")
pytest.importorskip("h5netcdf", reason="pip install vibench[exchange] brings h5netcdf")
MAP = """
frequency_hz = { start = 80, stop = 140, points = 9 }
amplitude_m = { start = 2e-6, stop = 2e-5, points = 7, spacing = "logarithmic" }
periods = 500
coarse = 4
"""
DIAGRAM = """
frequency_hz = { start = 120, stop = 130, points = 3 }
amplitude_m = 2e-5
chain = ["up", "down"]
periods = 500
"""
BASIN = """
frequency_hz = 160
amplitude_m = 4e-6
y_m = { start = -4e-5, stop = 4e-5, points = 5 }
vx_m_per_s = { start = -0.5, stop = 0.5, points = 5 }
periods = 800
coarse = 2
"""
LINE = BASIN.replace("{ start = -4e-5, stop = 4e-5, points = 5 }", "0")


def plan(folder, text):
    path = folder / "map.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_an_estimate_writes_no_file(output_of, tmp_path):
    told = output_of("map", plan(tmp_path, MAP), "--out", "a", "--estimate", "--json")
    assert (told["points"], told["coarse_points"]) == (63, 9)
    assert told["most_s"] >= told["first_s"] > 0.0
    assert [path.name for path in tmp_path.iterdir()] == ["map.toml"]


@pytest.mark.thorough
@pytest.mark.parametrize("text", [MAP, DIAGRAM], ids=["map", "diagram"])
def test_a_map_is_saved_as_a_file_and_a_picture_and_can_be_resumed(output_of, refusal, tmp_path, text):
    asked = plan(tmp_path, text)
    told = output_of("map", asked, "--out", "a", "--json")
    assert told["is_complete"]
    assert told["computed"] == open_map(tmp_path / "a" / FILE).points
    with xarray.open_dataset(tmp_path / "a" / FILE, engine="h5netcdf") as labelled:
        np.testing.assert_array_equal(
            labelled["response_i"], open_map(tmp_path / "a" / FILE).values("response_i")
        )
        assert labelled["frequency"].attrs["units"] == "Hz"
        assert labelled["response_i"].dims[-2:] == ("start", "frequency")
    assert {"map.h5", "map.png", "map.svg"} <= {path.name for path in (tmp_path / "a").iterdir()}
    assert "nothing is ever overwritten" in refusal("map", asked, "--out", "a")
    assert output_of("map", asked, "--out", "a", "--resume", "--json")["motions"] == told["motions"]


@pytest.mark.parametrize("more", ["", 'model = "rigid:0.8"\n'])
def test_a_basin_map_reports_shares_and_kicks(output_of, tmp_path, more):
    told = output_of("map", plan(tmp_path, BASIN + more), "--out", "a", "--kicks", "4", "--json")
    assert sum(each["share"] for each in told["motions"]) == pytest.approx(1.0)
    assert len(told["kicks"]) == 3 * len(told["motions"])


@pytest.mark.thorough
@pytest.mark.parametrize(("highest", "kinds"), [("6e-5", ["periodic"]), ("-4.6e-5", [])])
def test_map_points_next_to_failed_points_have_no_motion(vibench_here, tmp_path, highest, kinds):
    # Starts with p beyond the rigid stops, at 45 um, are refused.
    starts = f"y_m = {{ start = -6e-5, stop = {highest}, points = 33 }}"
    text = BASIN.replace("y_m = { start = -4e-5, stop = 4e-5, points = 5 }", starts) + 'model = "rigid:0"\n'
    ran = vibench_here("map", plan(tmp_path, text), "--out", "a", "--json", cwd=tmp_path)
    assert ran.returncode == 1
    assert "Traceback" not in ran.stderr
    told = json.loads(ran.stdout)
    assert [each["motion"] for each in told["motions"]] == kinds
    assert all(abs(each["y"]) > 45e-6 for each in told["failures"])


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (BASIN, "too few or too many initial states are near a boundary."),
        (LINE, "ranges for two coordinates of the initial state are needed"),
    ],
)
def test_a_basin_map_explains_a_missing_boundary_exponent(output_of, tmp_path, text, why):
    printed = output_of("map", plan(tmp_path, text), "--out", "a")
    assert f"The uncertainty exponent is not determined: {why}" in printed


@pytest.mark.parametrize(
    ("text", "more", "said"),
    [
        (MAP, ("--show", "beauty"), "'beauty'; give one of response_i"),
        (MAP, ("--kicks", "5"), "only the initial state varies"),
        (BASIN + "damping_time_s = 0\n", ("--kicks", "5"), "without damping, no motion returns"),
        (MAP, ("--show", "lyapunov"), "this map has observe = response; give observe = ["),
        (DIAGRAM.replace("120", "200"), (), "frequency_hz: a"),
        (DIAGRAM.replace("3 }", "1 }"), (), "map.toml: frequency_hz.points = 1: input should be greater"),
        (DIAGRAM.replace("2e-5", "-2e-5"), (), "map.toml: amplitude_m = -2e-05: input should be greater"),
        (DIAGRAM.replace('"down"', '"left"'), (), "chain.1 = 'left': input should be 'up' or 'down'"),
        ("frequency_hz = 100", (), "map.toml: a map needs one or two ranges"),
        (MAP + "gap = 3\n", (), "gap"),
    ],
)
def test_an_invalid_map_causes_a_readable_message_but_no_folder(refusal, tmp_path, text, more, said):
    sentence = refusal("map", plan(tmp_path, text), "--out", "a", *more)
    assert said in sentence
    assert "valid number" not in sentence
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--branches", "none.h5"), "none.h5"),
        (("--kicks", "5"), "kicks need a map in which only the initial state varies"),
        (("--show", "lyapunov"), "--show lyapunov needs a map with exponents"),
    ],
)
def test_an_estimate_refuses_the_same_requests_as_the_map(refusal, tmp_path, options, told):
    assert told in refusal("map", plan(tmp_path, MAP), "--estimate", "--out", "a", *options)
