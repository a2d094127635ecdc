"""The Compare page overlays recordings and predictions and exports them."""

import re
import shutil

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from vibench.analysis import (
    Curve,
    CurveKind,
    CurveOrigin,
    FrequencyResponseRequest,
    Simulation,
    compare_recording,
)
from vibench.analysis.prediction.progress import SimulatedPoint, SimulationProgress
from vibench.gui.pages.compare.compare_page import ComparePage
from vibench.gui.widgets.theme import DARK


def mode(source, scale=1.0, low_hz=50.0, high_hz=600.0):
    frequency_hz = np.arange(low_hz, high_hz, 0.7)
    r = frequency_hz / 266.0
    magnitude = scale * np.abs((1 + 0.02j * r) / (1 - r**2 + 0.02j * r))
    spread = np.full(frequency_hz.shape, 0.01)
    return Curve(
        source, CurveOrigin.PREDICTED, CurveKind.RESPONSE_I, frequency_hz, magnitude, spread, "a note"
    )


@pytest.fixture
def page(context, closing):
    page = closing(ComparePage(context))
    page.resize(1300, 800)
    page.show()
    return page


@pytest.fixture(scope="module")
def working(shared_context):
    """One page with worker processes, shared by tests."""
    page = ComparePage(shared_context)
    page.resize(1300, 800)
    page.show()
    yield page
    page.close()


@pytest.fixture
def overlaid(page):
    page.add_prediction((mode("one"),))
    page.add_prediction((mode("half", 0.5, 100.0, 500.0),))
    return page


def texts(table):
    return [
        [table.item(row, c).text() for c in range(table.columnCount())] for row in range(table.rowCount())
    ]


def test_curves_are_drawn_with_unchanged_values(overlaid):
    lines = [each.getOriginalDataset() for each in overlaid.plots.magnitudes.getPlotItem().listDataItems()]
    assert any(np.array_equal(y, mode("one").magnitude) for _, y in lines)
    assert any(np.array_equal(y, mode("half", 0.5, 100.0, 500.0).magnitude) for _, y in lines)
    assert overlaid.is_done


def test_the_table_lists_peaks_with_their_damping(overlaid):
    first, second = texts(overlaid.peaks)
    assert first[0] == "one, Response I, predicted"
    assert float(first[1]) == pytest.approx(266.0, abs=0.2)
    assert float(first[2]) == pytest.approx(50.0, rel=0.01)
    assert float(first[5]) == pytest.approx(1.0, rel=0.05)
    assert float(second[2]) == pytest.approx(25.0, rel=0.01)


def test_the_second_curve_is_compared_with_the_first(overlaid):
    curve, reference = overlaid.pair_box.pair()
    assert (curve.source, reference.source) == ("half", "one")
    assert overlaid.pair_box.summary.text().startswith("Median 6 dB")
    (line,) = overlaid.plots.differences.getPlotItem().listDataItems()
    frequency_hz, decibel = line.getOriginalDataset()
    assert np.median(decibel) == pytest.approx(-6.02, abs=0.02)
    assert frequency_hz[0] >= 100.0


def test_unticked_curves_are_neither_drawn_nor_listed(overlaid):
    overlaid.curves.tick("half, Response I, predicted", Qt.CheckState.Unchecked)
    assert len(texts(overlaid.peaks)) == 1
    assert len(overlaid.curves.curves) == 2


def test_markers_read_the_value_of_every_curve(overlaid):
    overlaid._markers.setChecked(True)
    overlaid.plots.markers.move(0, 150.0)
    overlaid.plots.markers.move(1, 300.0)
    assert overlaid.plots.markers.values == (150.0, 300.0)
    first, second = texts(overlaid.readings)
    assert float(first[1]) == pytest.approx(2 * float(second[1]), rel=1e-3)
    expected = mode("one").at(np.array([150.0, 300.0])).magnitude
    assert float(first[3]) == pytest.approx(20 * np.log10(expected[1] / expected[0]), abs=0.01)


def test_curves_that_were_removed_are_no_longer_drawn_or_listed(overlaid):
    overlaid.curves.setCurrentRow(0)
    overlaid._remove()
    assert [each.source for each in overlaid.curves.curves] == ["half"]
    assert overlaid.pair_box.pair() is None


def test_invalid_options_are_refused_with_an_explanation(page):
    form = page.panel.form.form
    form.show_content({"estimator": "hv"})
    assert page.panel.form.value is None
    assert "hv was requested without a noise ratio" in page.panel.form.complaint
    assert not page.panel._again.isEnabled()
    form.show_content({"estimator": "hv", "noise_ratio": 2.0})
    assert page.panel.form.value.request.noise_ratio == 2.0


@pytest.mark.thorough
def test_recordings_are_analysed_in_another_process_and_overlaid_and_exported(
    working, record_noise, tmp_path, wait_for
):
    """The whole use of the page: two recordings, curves, a picture with a known point, a report."""
    paths = (record_noise(tmp_path, "twice", 2.0), record_noise(tmp_path, "thrice", 3.0))
    notices = []
    working.context.noticed.connect(notices.append)
    working.context.comparison_requested.emit(paths)
    assert working.is_busy
    wait_for(lambda: not working.is_busy, 90.0)
    assert notices == []
    by_name = {each.name: each for each in working.curves.curves}
    for name, factor in (("twice", 2.0), ("thrice", 3.0)):
        curve = by_name[f"{name}, transmission, measured"]
        assert np.median(curve.magnitude) == pytest.approx(factor, rel=0.01)
    assert working.pair_box.summary.text().startswith("Median 3.5 dB")
    working.add_prediction((mode("model"),))
    for ending in ("svg", "csv", "html"):
        working.export_to(tmp_path / f"out.{ending}")
    wait_for(lambda: len(notices) == 3, 60.0)
    assert {each.what for each in notices} == {
        f"Written: {tmp_path / f'out.{e}'}" for e in ("svg", "csv", "html")
    }
    svg = (tmp_path / "out.svg").read_text()
    assert re.search(r'id="model, Response I, predicted"', svg)
    assert "twice, transmission, measured" in (tmp_path / "out.csv").read_text().splitlines()[0]


@pytest.mark.thorough
def test_a_copy_under_another_name_is_shown_once(page, record_noise, tmp_path):
    notices = []
    page.context.noticed.connect(notices.append)
    path = record_noise(tmp_path, "noise", 2.0)
    copy = shutil.copy(path, tmp_path / "copy.h5")
    page._recordings = {path: None, copy: None}
    for each in (path, copy, copy):
        page._add_recording(compare_recording(each, FrequencyResponseRequest(), Simulation.LEFT_OUT))
    assert [each.what for each in notices] == 2 * [f"{copy} has the same samples as {path}."]
    assert {each.source for each in page.curves.curves} == {"noise"}
    assert set(page._recordings) == {path}


@pytest.mark.thorough
def test_failed_analyses_and_exports_are_reported_and_the_other_curves_are_kept(working, tmp_path, wait_for):
    notices = []
    working.context.noticed.connect(notices.append)
    working.add_prediction((mode("model"),))
    known = len(working.curves.curves)
    working.add_recordings((tmp_path / "missing.h5",))
    working.export_to(tmp_path / "out.docx")
    wait_for(lambda: len(notices) == 2, 60.0)
    said = " ".join(each.what for each in notices)
    assert "missing.h5 does not exist" in said
    assert ".png, .svg" in said
    assert len(working.curves.curves) == known


def test_colour_shows_the_recording_and_line_style_shows_the_kind_of_curve(page):
    frequency_hz = np.arange(100.0, 300.0)
    ones, none = np.ones_like(frequency_hz), np.full_like(frequency_hz, np.nan)
    curves = {
        (source, origin, kind): Curve(source, origin, kind, frequency_hz, ones, none)
        for source in ("sweep", "other")
        for origin in (CurveOrigin.MEASURED, CurveOrigin.SIMULATED, CurveOrigin.PREDICTED)
        for kind in (CurveKind.RESPONSE_I, CurveKind.RESPONSE_II)
    }
    page.add_prediction(tuple(curves.values()))
    progress = SimulationProgress(5e-6, 2, "a scene")
    progress.add((SimulatedPoint("hertz", 150.0, 2.0, 1.0, 0, None),))
    progress.add((SimulatedPoint("hertz", 250.0, 2.0, 1.0, 0, None),))
    page.add_prediction(progress.curves())
    styles = {key: page.curves.line_style(curve) for key, curve in curves.items()}
    for source in ("sweep", "other"):
        assert len({style.colour(DARK) for key, style in styles.items() if key[0] == source}) == 1
        assert len({style.dash for key, style in styles.items() if key[0] == source}) == 6
    assert len({style.colour(DARK) for style in styles.values()}) == 2
    assert any("5 µm" in each.name for each in page.curves.curves)
    page.pair_box._curve.setCurrentText(progress.curves()[0].name)
    measured = curves["sweep", CurveOrigin.MEASURED, CurveKind.RESPONSE_I]
    page.pair_box._reference.setCurrentText(measured.name)
    assert "5 µm and as driven" in page.pair_box.summary.text()


def test_progress_does_not_move_the_controls_on_the_left(page, qapp):
    def places():
        qapp.processEvents()
        return [each.geometry().getRect() for each in page.panel.findChildren(QWidget) if each.isVisible()]

    before = places()
    page.panel.show_progress(0, 5)
    assert places()[: len(before)][0] == before[0]
    height = page.panel.sizeHint().height()
    page.panel.show_progress(5, 5)
    assert page.panel.sizeHint().height() == height
