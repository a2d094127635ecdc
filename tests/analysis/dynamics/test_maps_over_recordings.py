"""Recordings overlaid on maps: the recorded level as a line, measured responses in the map's colours."""

import numpy as np
import pytest
from matplotlib.collections import PathCollection

from vibench.analysis import Simulation, analyse_files, recorded_response
from vibench.analysis.report import map_figure, write_report
from vibench.analysis.report._maps import draw_maps
from vibench.sim.maps import Map, Range, solve_map


@pytest.fixture(scope="module")
def small_map(stepped_file):
    """Map around the recorded level, of the linear specimen so that it needs no integration."""
    level = np.array(recorded_response(stepped_file).pairs)
    low, high = level[:, 0].min(), level[:, 0].max()
    return solve_map(
        Map(
            model="linear",
            frequency_hz=Range(start=low, stop=high, points=5),
            amplitude_m=Range(start=0.5 * level[:, 1].min(), stop=2.0 * level[:, 1].max(), points=4),
            coarse=2,
        )
    )


def test_a_map_shows_the_recorded_level_and_responses(small_map, stepped_file):
    level = recorded_response(stepped_file)
    figure = map_figure(small_map, levels=[level]).figure
    lines = [line for axes in figure.axes for line in axes.get_lines() if line.get_label() == level.name]
    assert len(lines) == 1
    assert lines[0].get_xdata().tolist() == [frequency for frequency, _ in level.pairs]
    dots = [each for axes in figure.axes for each in axes.collections if isinstance(each, PathCollection)]
    points = sum(len(each.get_offsets()) for each in dots)
    assert points == sum(len(curve.frequency_hz) for curve in level.measured) > 0


@pytest.mark.thorough
def test_a_report_overlays_recordings_only_on_frequency_amplitude_maps(small_map, stepped_file, tmp_path):
    results = analyse_files((stepped_file,), "steps", Simulation.LEFT_OUT)
    other = solve_map(Map(model="linear", damping_time_s=Range(start=1e-5, stop=2e-5, points=2)))
    on_it, beside = (each.figure for each in draw_maps(results, [small_map, other]))
    assert len([line for axes in on_it.axes for line in axes.get_lines()]) > 0
    assert beside.axes
    page = write_report(results, tmp_path / "report.html", maps=[small_map]).read_text("utf-8")
    assert "Map of motions: drive frequency" in page
