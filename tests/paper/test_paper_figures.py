"""The paper's figures from short studies show the computed data and the effects in the paper."""

from dataclasses import replace

import numpy as np
import pytest

from vibench.analysis import InvalidRequest, LogarithmOf
from vibench.analysis.report import ImageKind
from vibench.cli.paper.drawing import shade
from vibench.cli.paper.figures import FIGURES
from vibench.cli.paper.options import AMPLITUDES_M, Case
from vibench.cli.paper.responses import responses
from vibench.sim import Accuracy
from vibench.sim.study import solve_study

SHORT = Case(accuracy=Accuracy.QUICK, duration_s=0.6, window_s=0.25)
"""Long enough for the paper's peaks, far too short for its chaos."""


@pytest.fixture(scope="module")
def solver():
    """Return a function that solves each study once."""
    found = {}

    def solve(study):
        key = study.model_dump_json()
        if key not in found:
            found[key] = solve_study(study)
        return found[key]

    return solve


def draw(solver, number, options=SHORT):
    figure = FIGURES[number]
    return figure.draw(options, *(solver(each) for each in figure.studies(options)))


def numbers(table, heading):
    return np.array([float(cell) for cell in table.column(heading)])


@pytest.mark.thorough
@pytest.mark.parametrize(
    "number", [1, 2, 3, 5, 7, *(pytest.param(n, marks=pytest.mark.slow) for n in (6, 8, 9, 11))]
)
def test_a_paper_figure_is_saved_in_every_format_with_its_table(solver, number, tmp_path):
    found = draw(solver, number)
    paths = found.save(tmp_path, list(ImageKind))
    heads = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    for path in paths:
        if path.suffix in heads:
            assert path.read_bytes().startswith(heads[path.suffix])
    assert any(path.suffix == ".csv" for path in paths)
    assert str(number) in found.title


@pytest.mark.thorough
def test_figure_3_has_three_resonances_at_the_weak_level_and_two_other_resonances_at_the_strong_level(solver):
    weak, *_, strong = draw(solver, 3).tables
    f = numbers(weak, "frequency_hz")

    def peaks(table):
        size = numbers(table, "response_ii")
        inner = (size[1:-1] > size[:-2]) & (size[1:-1] > size[2:]) & (size[1:-1] > 1.5)
        return f[1:-1][inner]

    assert peaks(weak) == pytest.approx([95, 265, 500], abs=5)
    assert peaks(strong) == pytest.approx([200, 435], abs=5)


@pytest.mark.thorough
def test_figure_3_shades_only_the_frequencies_with_collisions(solver):
    results = solver(FIGURES[3].studies(SHORT)[0])
    for amplitude_m, table in zip(AMPLITUDES_M, draw(solver, 3).tables, strict=True):
        curve = responses(results, amplitude=amplitude_m)
        assert np.array_equal(numbers(table, "collides") > 0, curve.collides)
    shares = [responses(results, amplitude=each).collides.mean() for each in AMPLITUDES_M]
    assert sorted(shares) == shares
    assert shares[-1] > 0.5


def test_collision_shading_extends_halfway_to_neighbouring_points():
    class Recorder:
        def __init__(self):
            self.spans = []

        def axvspan(self, low, high, **_):
            self.spans.append((low, high))

    axes = Recorder()
    shade(axes, np.array([1.0, 2.0, 4.0, 5.0]), np.array([False, True, False, True]), "collide")
    assert axes.spans == [(1.5, 3.0), (4.5, 5.0)]


@pytest.mark.thorough
def test_figure_5_shows_more_collisions_without_damping_and_at_a_larger_amplitude(solver):
    (table,) = draw(solver, 5).tables
    share = {name: numbers(table, f"collides_{name}").mean() for name in ("damped", "undamped", "damped_7um")}
    assert share["damped"] < share["undamped"]
    assert share["damped"] < share["damped_7um"]


@pytest.mark.thorough
def test_figure_7_has_the_rates_of_the_paper_at_the_weakest_level(solver):
    caption = draw(solver, 7).caption
    assert "log10 of the response [mm]" in caption
    titles = [axes.get_title() for axes in draw(solver, 7).figure.axes]
    assert "Response I: R = 8" in titles[0]


@pytest.mark.thorough
def test_the_argument_of_the_logarithm_is_an_option_of_figure_7(solver):
    other = replace(SHORT, logarithm_of=LogarithmOf.NORMALISED)
    assert draw(solver, 7, other).caption != draw(solver, 7).caption
    assert draw(solver, 7, other).figure.axes[0].get_title() != draw(solver, 7).figure.axes[0].get_title()


@pytest.mark.parametrize(("name", "value"), [("gap_m", 0.0), ("damping_time_s", -1.0), ("gap_m", np.nan)])
def test_impossible_options_of_a_paper_figure_are_refused(name, value):
    with pytest.raises(InvalidRequest, match="not allowed"):
        Case(**{name: value})
