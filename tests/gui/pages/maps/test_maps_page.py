"""The Maps page: a growing map, refinement of a part, and the motion at a point."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from tests.gui.geometry import wrongly_enabled
from vibench.analysis.dynamics import MOTION_CLASSES, RecordedLevel
from vibench.analysis.prediction.progress import MapRequest
from vibench.gui.pages.maps import MapsPage
from vibench.gui.widgets.notice import SIMULATE
from vibench.sim import gong2025

SMALL = {
    "start_hz": 100.0,
    "stop_hz": 140.0,
    "lowest_m": 5e-6,
    "highest_m": 2e-5,
    "columns": 7,
    "rows": 5,
    "periods": 400,
}


@pytest.fixture(scope="module")
def page(shared_context):
    """One page with its worker process, shared by all tests."""
    page = MapsPage(shared_context)
    page.resize(1300, 900)
    page.show()
    yield page
    page.simulator.background.close()
    page.close()


def compute_map(page, wait_for, **changes):
    page.form.show_value(MapRequest(**{**SMALL, **changes}))
    page.begin()
    wait_for(lambda: not page.simulator.is_busy, 100.0)
    page.refresh()


@pytest.mark.thorough
def test_a_map_is_drawn_and_every_point_has_a_kind(page, wait_for):
    compute_map(page, wait_for)
    assert page.is_done
    assert page.picture.classes.shape == (5, 7)
    assert 0 <= page.picture.classes.min() <= page.picture.classes.max() < len(MOTION_CLASSES)
    assert page.map.image.image.shape == (5, 7, 4)
    assert "points computed" in page.summary.text()
    page.quantity.setCurrentText("Response I")
    before = page.map.image.image.copy()
    page.refresh()
    assert not np.array_equal(page.map.image.image, before)


@pytest.mark.thorough
def test_the_visible_part_of_a_map_can_be_refined(page, wait_for):
    compute_map(page, wait_for)
    page.map.plot.setXRange(110.0, 120.0, padding=0.0)
    page.map.plot.setYRange(-5.2, -5.0, padding=0.0)
    page.begin_in_sight()
    wait_for(lambda: not page.simulator.is_busy, 100.0)
    asked = page.form.value
    assert (asked.start_hz, asked.stop_hz) == pytest.approx((110.0, 120.0), rel=1e-3)
    assert (asked.lowest_m, asked.highest_m) == pytest.approx((10**-5.2, 1e-5), rel=1e-3)
    assert (asked.columns, asked.rows) == (7, 5)
    assert page.picture.frequency_hz[0] == pytest.approx(110.0, abs=1.0)


@pytest.mark.thorough
def test_clicking_a_point_of_a_map_shows_the_motion_and_opens_the_point_on_the_simulate_page(page, wait_for):
    compute_map(page, wait_for)
    wanted, pages = [], []
    page.context.scene_requested.connect(lambda *point: wanted.append(point))
    page.context.page_requested.connect(pages.append)
    box = page.map.plot.getViewBox()
    place = page.map.plot.mapFromScene(box.mapViewToScene(box.viewRect().center()))
    QTest.mouseClick(
        page.map.plot.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(round(place.x()), round(place.y()))
    )
    assert page.motion.caption.text() == "Following the motion…"
    wait_for(lambda: "from rest" in page.motion.caption.text(), 100.0)
    assert page.motion.caption.text().startswith("120")
    assert all(len(curve.getOriginalDataset()[0]) > 10 for curve in page.motion.curves)
    page._open.click()
    assert wanted[0] == pytest.approx((120.0, 1e-5), rel=0.05)
    assert pages == [SIMULATE]


def test_a_recorded_level_is_drawn_on_the_map_as_a_line(page):
    page.map.show_level(RecordedLevel("steps", ((100.0, 6e-6), (140.0, 7e-6)), (), None))
    across, up = page.map.levels[0].getOriginalDataset()
    assert across.tolist() == [100.0, 140.0]
    assert up.tolist() == [6e-6, 7e-6]


def test_a_recording_of_another_specimen_than_the_map_gives_a_warning(page):
    said = []
    page.context.noticed.connect(said.append)
    page.form.show_value(MapRequest(**SMALL))
    page._show_level(RecordedLevel("same", ((100.0, 6e-6), (140.0, 7e-6)), (), gong2025()))
    assert said == []
    page._show_level(RecordedLevel("narrow", ((100.0, 6e-6), (140.0, 7e-6)), (), gong2025(gap_m=3e-5)))
    assert "not the one described in narrow: gaps [4.5e-05, 4.5e-05] m" in said[0].what


def test_a_map_that_is_too_large_is_refused_with_an_explanation(page):
    page.form.form.show_content({**SMALL, "columns": 900, "rows": 900})
    assert not page._begin.isEnabled()
    assert "810000 points are too many for the window" in page.form.complaint


@pytest.mark.thorough
def test_the_map_and_the_motion_of_another_specimen_are_greyed_out(page, wait_for):
    compute_map(page, wait_for)
    page.pick(120.0, 1e-5)
    wait_for(lambda: page.displayed_results[1].inputs is not None and page.motion.isEnabled(), 100.0)
    assert page.map.isEnabled()
    before = page.form.form.content()
    page.form.form.show_content({**before, "gap_m": 60e-6})
    assert [page.map.isEnabled(), page.motion.isEnabled()] == [False, False]
    page.form.form.show_content(before)
    assert [page.map.isEnabled(), page.motion.isEnabled()] == [True, True]
    page.pick(130.0, 1e-5)
    assert not page.motion.isEnabled()
    assert not any(map(wrongly_enabled, page.displayed_results))
    page.begin()
    assert page.map.image.image is None
    page.simulator.cancel()


def test_empty_axes_show_the_ranges_entered_in_the_form(context, qtbot, closing):
    """With a recorded level the axis ran from 10 to 10^6 um."""
    page = closing(MapsPage(context))
    page.resize(900, 700)
    page.show()
    page.map.show_level(RecordedLevel("night", ((90.0, 4e-6), (300.0, 2e-5)), (), None))
    page.form.show_value(MapRequest(**SMALL))
    qtbot.wait(50)
    (left, right), (low, high) = page.map.in_sight
    assert (left, right) == pytest.approx((100.0, 140.0))
    assert (low, high) == pytest.approx((5e-6, 2e-5))
