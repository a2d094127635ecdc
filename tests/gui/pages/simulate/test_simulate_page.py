"""The Simulate page computes in another process, draws results as they arrive, and stops at once."""

from dataclasses import replace

import numpy as np
import pytest

from tests.gui.geometry import wrongly_enabled
from vibench.analysis.prediction.progress import (
    MEASURED,
    SimulatedPoint,
    SimulatedSignal,
    SimulationRequest,
    Trouble,
)
from vibench.gui.pages.simulate.simulate_page import SimulatePage
from vibench.sim import Accuracy, Ensemble, FoundMotion, MotionKind, Share, StartMemory

LINEAR = {"model": "linear", "compared_with": "", "signal_hz": None, "start_hz": 50.0, "step_hz": 10.0}


@pytest.fixture(scope="module")
def page(shared_context):
    """One page with its worker process, shared by all tests."""
    page = SimulatePage(shared_context)
    page.resize(1300, 800)
    page.show()
    yield page
    page.simulator.background.close()
    page.close()


def simulate(page, **changes):
    page.form.show_value(SimulationRequest(**{**LINEAR, **changes}))
    page.begin()


def lines(plot):
    return [item.getOriginalDataset() for item in plot.getPlotItem().listDataItems()]


def point(model, frequency_hz, response=2.0, impacts=0, exponent=None):
    return SimulatedPoint(model, frequency_hz, response, response / 2, impacts, exponent)


@pytest.mark.thorough
def test_a_simulation_completes_and_is_drawn(page, wait_for):
    simulate(page)
    assert page.simulator.is_busy
    wait_for(lambda: not page.simulator.is_busy, 60.0)
    for _ in page.plots.plots:
        page.refresh()
    assert page.progress.done == page.progress.requested == 56
    assert page._state.text() == "Complete."
    assert page._bar.value() == 56
    first, _second = lines(page.plots.responses)
    assert np.array_equal(first[0], np.arange(50.0, 601.0, 10.0))
    assert first[1][0] == pytest.approx(1.05, abs=0.03)
    assert page.is_done


def test_cancelling_a_simulation_is_immediate_and_keeps_partial_results(page, wait_for):
    simulate(page, step_hz=0.05)
    wait_for(lambda: page.progress.done > 0, 60.0)
    page.simulator.cancel()
    assert not page.simulator.is_busy
    found = page.progress.done
    assert 0 < found < page.progress.requested
    assert page._state.text().startswith("Cancelled")
    simulate(page, step_hz=100.0)
    wait_for(lambda: not page.simulator.is_busy, 60.0)
    assert page.progress.done == page.progress.requested == 6


@pytest.mark.thorough
def test_a_dead_process_is_reported_and_replaced(page, wait_for):
    said = []
    page.context.noticed.connect(said.append)
    simulate(page, step_hz=0.05)
    wait_for(lambda: page.progress.done > 0, 60.0)
    page.simulator.background.workers[0].process.kill()
    wait_for(lambda: bool(said), 30.0)
    assert "has ended" in said[0].what
    assert not page.simulator.is_busy
    simulate(page, step_hz=100.0)
    wait_for(lambda: not page.simulator.is_busy, 60.0)
    assert page.progress.done == 6


def test_invalid_inputs_cannot_be_simulated(page):
    page.form.form.show_content({"window_s": 50.0})
    assert not page._begin.isEnabled()
    assert "Window 50.0 s is not allowed" in page.form.complaint
    page.form.form.show_content({})
    assert page._begin.isEnabled()


def test_the_cost_and_the_error_are_shown_beside_the_accuracy(page):
    page.form.show_value(SimulationRequest(accuracy="quick"))
    quick = page._cost.text()
    page.form.show_value(SimulationRequest(accuracy="reference"))
    strict = page._cost.text()
    for accuracy, text in ((Accuracy.QUICK, quick), (Accuracy.REFERENCE, strict)):
        assert f"{MEASURED[accuracy].chaos:.0f} s of chaos" in text
        assert f"{MEASURED[accuracy].state_error:.0e}" in text
    assert quick != strict


def test_exponents_and_similarity_and_impacts_and_motion_are_drawn_while_they_are_computed(page):
    simulate(page, step_hz=100.0)
    page.simulator.cancel()
    page._grow(
        (point("a", 100.0, exponent=-3.0), point("a", 200.0, 4.0, 7, 90.0), point("b", 100.0, exponent=-3.5))
    )
    for _ in page.plots.plots:
        page.refresh()
    assert len(lines(page.plots.exponents)) == 2
    assert len(lines(page.plots.likeness)) == 1
    time_s = np.linspace(1.0, 1.05, 200)
    page._grow((SimulatedSignal("a", 260.0, time_s, 1e-6 * np.sin(time_s), 1e-5 * time_s, (45e-6, 45e-6)),))
    for _ in page.plots.plots:
        page.refresh()
    (x_s, x), _ = lines(page.plots.motion)
    assert x_s[0] == 0.0
    assert np.array_equal(x, 1e-6 * np.sin(time_s))


def test_coexisting_motions_are_shown_as_dots_and_table_rows_with_shares(page):
    simulate(page, step_hz=100.0)
    page.simulator.cancel()
    motions = tuple(
        FoundMotion(kind, period, response, response, 1.0, 1.0, 1e-6, starts, Share(starts / 16, low, high))
        for kind, period, response, starts, low, high in (
            (MotionKind.PERIODIC, 1, 0.886, 12, 0.51, 0.90),
            (MotionKind.PERIODIC, 2, 2.15, 4, 0.10, 0.49),
        )
    )
    ensemble = Ensemble(16, motions, 0, 0.19, None, 0.4, 90.0)
    lottery = replace(point("a", 562.8, 0.886), memory=StartMemory.LOST, ensemble=ensemble)
    page._grow((point("a", 500.0), lottery))
    page._end()
    for _ in page.plots.plots:
        page.refresh()
    assert "At 1 point the motion depends sensitively on the start." in page._state.text()
    dots = lines(page.plots.responses)[0]
    assert (list(dots[0]), list(dots[1])) == ([562.8], [2.15])
    assert page.motions.isVisible()
    words = [[page.motions.item(row, column).text() for column in range(7)] for row in range(2)]
    assert words[1] == ["a", "562.8", "2.15", "2.15", "1e-06", "25 % (10 to 49 %)", "periodic, period 2"]
    page._grow((point("a", 562.8),))
    for _ in page.plots.plots:
        page.refresh()
    assert not page.motions.isVisible()


def test_failed_points_are_reported_at_the_end_of_a_simulation(page):
    said = []
    page.context.noticed.connect(said.append)
    page._grow((Trouble("a at 300 Hz: a contact made no progress"),))
    page._end()
    assert "no progress" in said[-1].what


def test_simulated_curves_can_be_sent_to_the_compare_page(page, qtbot):
    page._grow((point("a", 100.0), point("a", 200.0)))
    with qtbot.waitSignal(page.context.prediction_made) as made:
        page._compare.click()
    assert {each.name for each in made.args[0]} >= {"model a, 5 µm, Response I, predicted"}


def test_the_plots_of_a_simulation_show_units(page):
    assert all(plot.accessibleName() for plot in page.plots.plots)
    assert "1/s" in page.plots.exponents.up.labelText
    assert "µm" in page.plots.motion.up.labelText


def test_an_empty_signal_field_means_no_signal(page):
    page.form.form.show_content({})
    editor = page.form.form.editors["signal_hz"]
    assert page.form.value.signal_hz == 260.0
    editor.show_content(None)
    page.form.form.changed.emit()
    assert page.form.value.signal_hz is None


def test_curves_that_differ_from_the_form_are_greyed_out(page):
    page.displayed_results[0].inputs = SimulationRequest(**LINEAR)
    page.form.show_value(SimulationRequest(**LINEAR))
    assert page.plots.isEnabled()
    page.form.show_value(SimulationRequest(**{**LINEAR, "amplitude_m": 9e-6}))
    assert not page.plots.isEnabled()
    assert not any(map(wrongly_enabled, page.displayed_results))
    page.leave()
    again = SimulatePage(page.context)
    assert again.form.value.amplitude_m == 9e-6
    again.form.form.show_content({"model": "continuous n=5"})
    assert "continuous n=5" in again._cost.text()
    assert "hertz" in [again.form.form.editors["model"].widget.itemText(row) for row in range(9)]
    again.simulator.background.close()
    again.deleteLater()
