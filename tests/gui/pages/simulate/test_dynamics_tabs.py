"""The tabs Branches, Exponents and Chain of the Simulate page compute, draw and overlay."""

import re

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect

from vibench.analysis import CurveOrigin
from vibench.analysis.dynamics import (
    BranchLine,
    BranchRequest,
    ChainRequest,
    LineEvent,
    SpectrumPoint,
    SpectrumRequest,
)
from vibench.gui.pages.simulate.simulate_page import SimulatePage
from vibench.gui.plots.line_style import Dash
from vibench.gui.widgets.notice import COMPARE
from vibench.sim import Parameter


@pytest.fixture(scope="module")
def page(shared_context):
    """One page with worker processes, shared by all tests."""
    page = SimulatePage(shared_context)
    page.resize(1300, 800)
    page.show()
    yield page
    for view in (page, page.branches, page.spectrum, page.chain):
        view.simulator.background.close()
    page.close()


def lines(plot):
    return [item for item in plot.getPlotItem().listDataItems() if item.xData is not None]


def line(multipliers=(0.5, 0.9, 1.5, 2.0)):
    n = len(multipliers)
    size, inside = np.outer(np.linspace(1.0, 2.0, n), np.ones(4)), np.zeros((n, 6))
    inside[:, 0] = multipliers
    return BranchLine(
        np.linspace(100.0, 110.0, n), np.linspace(1e-6, 2e-6, n), size, size, np.zeros((n, 6)), inside,
        np.zeros((n, 6)), np.ones(n, np.int64), np.full(n, 1e-8), (LineEvent("fold", 105.0, 1.5e-6, 1, 1.5),),
        1, "mirrored", False, False, "searched", "an end", "an end", 0.5,
    )  # fmt: skip


def start_request(view, request):
    view.form.show_value(request)
    view.begin()


@pytest.mark.thorough
def test_branches_are_drawn_with_their_error_and_their_cost(page, wait_for):
    view = page.branches
    start_request(view, BranchRequest(start=60.0, stop=62.0, places=2, starts=0))
    assert view.simulator.is_busy
    wait_for(lambda: not view.simulator.is_busy, 100.0)
    page.refresh()
    assert view.summary.text().startswith("Complete. 1 branch ")
    assert "relative to the fundamental of p" in view.summary.text()
    first, _ = view.picture.plots(Parameter.FREQUENCY)
    (drawn,) = lines(first)
    assert drawn.getOriginalDataset()[0][0] == pytest.approx(60.0)


@pytest.mark.parametrize("along", list(Parameter))
def test_stable_branches_are_solid_and_unstable_branches_are_dashed(page, along):
    view = page.branches
    start = 1e-6 if along is Parameter.AMPLITUDE else 100.0
    start_request(view, BranchRequest(along=along, start=start, stop=110.0, places=2, starts=0))
    view.simulator.cancel()
    view._grow((line(),))
    page.refresh()
    solid, dashed = lines(view.picture.plots(along)[0])
    assert solid.opts["pen"].style() == Dash.SOLID.value
    assert dashed.opts["pen"].style() == Dash.DASHED.value
    assert len(lines(view.picture.plots(along)[1])) == 3
    assert view._compare.isEnabled() is (along is Parameter.FREQUENCY)


def test_branches_can_be_overlaid_on_recordings(page):
    view = page.branches
    view.form.show_value(BranchRequest(start=100.0, stop=110.0))
    start_request(view, BranchRequest(start=100.0, stop=110.0, places=2, starts=0))
    view.simulator.cancel()
    view._grow((line(),))
    predictions, wanted = [], []
    page.context.prediction_made.connect(predictions.append)
    page.context.page_requested.connect(wanted.append)
    view._hand_to_compare()
    assert {each.origin for each in predictions[0]} == {CurveOrigin.STABLE, CurveOrigin.UNSTABLE}
    assert wanted == [COMPARE]


def test_exponents_are_drawn_with_their_intervals(page):
    view = page.spectrum
    start_request(view, SpectrumRequest(start=250.0, stop=260.0, step=10.0))
    view.simulator.cancel()
    six = (100.0, 40.0, 0.0, -80.0, -130.0, -190.0)
    low, high = tuple(x - 5.0 for x in six), tuple(x + 5.0 for x in six)
    for place in (250.0, 260.0):
        view._grow(
            (
                SpectrumPoint(
                    place, 5e-6, six, low, high, -260.0, -260.0, 4.4, 4.3, 4.5, "chaotic", 4.0, "", "",
                    40, 300.0, "", 1.0,
                ),
            )
        )  # fmt: skip
    page.refresh()
    upper, lower = view.picture.plots(Parameter.FREQUENCY)
    assert len(lines(upper)) == 12  # six exponents, each with the band of its interval
    assert lines(lower)[-1].getOriginalDataset()[1].tolist() == [4.4, 4.4]
    assert "2 chaotic while observed; sums of exponents differ from the damping rate" in view.summary.text()
    assert not view._compare.isEnabled()


@pytest.mark.thorough
@pytest.mark.timeout(300)
def test_a_chain_is_simulated_and_drawn_over_frequency_and_cells_and_time(page, wait_for):
    view = page.chain
    start_request(view, ChainRequest(lengths=(3,), amplitude_m=30e-6, duration_s=0.2, settle_s=0.1))
    wait_for(lambda: not view.simulator.is_busy, 280.0)
    page.refresh()
    assert view.summary.text().startswith("Complete. Band gaps of the infinite chain: 96.07 to 110.4 Hz")
    assert "1 run in" in view.summary.text()
    (run,) = view.answer.runs
    across, motion, energies = view.picture.plots
    assert len(lines(across)) == 9  # three cells: without contact, driven, and a dot at the frequency
    traces = [item.getOriginalDataset()[1] for item in lines(motion)[:3]]
    for place, trace in enumerate(traces, start=1):
        np.testing.assert_allclose(np.round(trace), place)
    assert lines(energies)[0].getOriginalDataset()[0].tolist() == [1.0, 2.0, 3.0]
    ((_, _, said),) = energies._legend_entries
    assert said == f"3 cells at 220 Hz, {run.impacts.sum() / run.observed_s:.4g} impacts per second in total"
    assert not view._compare.isEnabled()


@pytest.mark.thorough
def test_chain_waves_need_no_simulation_and_missing_recordings_are_reported(page, wait_for, tmp_path):
    view = page.chain
    start_request(view, ChainRequest(lengths=(2, 5), drive="none"))
    wait_for(lambda: not view.simulator.is_busy, 100.0)
    page.refresh()
    assert len(lines(view.picture.across)) == 2
    assert not lines(view.picture.motion)
    said = []
    page.context.noticed.connect(said.append)
    start_request(view, ChainRequest(drive="recorded", recording=str(tmp_path / "nowhere.h5")))
    wait_for(lambda: not view.simulator.is_busy, 100.0)
    assert "nowhere.h5" in said[-1].what
    assert view.simulator.background.workers[0].process.is_alive()


def test_the_find_button_is_disabled_while_inputs_are_invalid(page):
    view = page.branches
    view.form.form.show_content({"method": "first-order"})
    assert not view._begin.isEnabled()
    assert "one harmonic cannot describe hertz" in view.form.complaint
    view.form.form.show_content({})
    assert view._begin.isEnabled()


@pytest.mark.parametrize("name", ["branches", "spectrum", "chain"])
def test_a_running_search_is_shown_as_running_without_a_result(page, name):
    """Branches showed "no periodic motion was found; 0.0 s" during the search."""
    view = getattr(page, name)
    view.begin()
    assert view.summary.text().strip().startswith("Computing")
    assert not re.search(r"[Nn]o |0\.0 s|not found", view.summary.text())
    view.simulator.cancel()


@pytest.mark.parametrize("place", range(4))
def test_start_buttons_are_visible_at_every_window_size(page, qapp, place):
    """At 1280 x 800 Simulate was hidden and Find was half hidden on the Chain tab."""
    for width, height in ((1040, 560), (1100, 640), (1300, 800)):
        page.resize(width, height)
        page.tabs.setCurrentIndex(place)
        qapp.processEvents()
        button = (page, *page._views)[place]._begin
        corner = button.mapTo(page, QPoint(0, 0))
        assert page.rect().contains(QRect(corner, button.size()))
    page.tabs.setCurrentIndex(0)
