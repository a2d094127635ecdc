"""An empty plot shows a hint; the legend is above the axes."""

import sys

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QColor, QGuiApplication
from PySide6.QtWidgets import QLabel

from vibench.gui.plots.axis import LOG_FREQUENCY, TIME, PlotAxis, Scale, thin_ticks
from vibench.gui.plots.line_style import LIMIT, LineStyle, curve_style
from vibench.gui.plots.plot import Plot
from vibench.gui.plots.plot_actions import numbers_of, write_plot
from vibench.gui.widgets.theme import LIGHT
from vibench.gui.widgets.units import UNITS


@pytest.fixture
def plot(qapp, closing):
    made = closing(Plot("a plot", TIME, PlotAxis("Velocity of the mass", "mm/s", 1e3, short="v"), LIGHT))
    made.resize(400, 300)
    return made


def dark_pixels(plot):
    """Count dark (text) pixels in the middle of the empty plot."""
    picture = plot.grab().toImage()
    middle = range(picture.height() * 2 // 5, picture.height() * 3 // 5)
    return sum(
        picture.pixelColor(x, y).lightness() < 140
        for y in middle
        for x in range(picture.width() // 4, picture.width() * 3 // 4)
    )


def test_an_empty_plot_shows_its_hint_until_a_curve_has_points(plot, qapp):
    plot.with_hint("What was measured appears here")
    curve = plot.curve(curve_style(0))
    plot.show()
    qapp.processEvents()
    assert dark_pixels(plot) > 50
    assert plot.up.tickStrings([0.0, 1.0], 1.0, 1.0) == ["", ""]
    curve.setData([0.0, 1.0], [0.0, 0.001])
    plot.setYRange(-0.01, 0.001)
    qapp.processEvents()
    assert dark_pixels(plot) == 0
    assert plot.up.tickStrings([0.0, 0.001], 1.0, 0.001) == ["0", "1"]
    curve.clear()
    qapp.processEvents()
    assert dark_pixels(plot) > 50


def test_the_legend_wraps_above_the_axes(plot, qapp):
    plot.with_legend()
    for number in range(4):
        plot.curve(curve_style(number), f"a curve with a long name, number {number}")
    plot.resize(900, 300)
    plot.show()
    qapp.processEvents()

    def legend_and_axes():
        legend = plot.findChild(type(plot._legend))
        top = plot.mapFromScene(plot.getViewBox().sceneBoundingRect()).boundingRect().top()
        return legend.geometry().bottom(), top

    bottom, top = legend_and_axes()
    assert bottom <= top
    plot.resize(300, 300)
    qapp.processEvents()
    lower, lower_top = legend_and_axes()
    assert bottom < lower <= lower_top


def test_a_label_is_shortened_when_there_is_little_space(plot, qapp):
    plot.show()
    qapp.processEvents()
    assert plot.up.labelText == "Velocity of the mass (mm/s)"
    plot.resize(400, 150)
    qapp.processEvents()
    assert plot.up.labelText == "v (mm/s)"


@pytest.mark.parametrize("most", [2, 3, 5])
def test_ticks_are_thinned_to_round_steps(most):
    step, values = thin_ticks(0.1, [0.1 * n for n in range(11)], most)
    assert len(values) <= most
    assert all(abs(value / step - round(value / step)) < 1e-6 for value in values)


@pytest.mark.parametrize("reach", [12.0, 17.0, 19.0, 26.0, 44.0])
def test_a_short_axis_has_at_least_two_numbers(reach):
    places = [5.0 * n for n in range(-8, 9) if abs(5.0 * n) <= reach]
    step, values = thin_ticks(5.0, places, 2)
    assert len(values) == 2
    assert all(abs(value / step - round(value / step)) < 1e-6 for value in values)


def test_a_change_of_units_ignores_closed_plots(qtbot):
    closed = Plot("a plot", TIME, PlotAxis("x", "m"), LIGHT).with_legend()
    closed.curve(curve_style(0), "5 µm").setData([0.0, 1.0], [0.0, 1.0])
    closed.close()
    with qtbot.captureExceptions() as raised:
        UNITS.choose({"m": "mm"})
        UNITS.choose({})
    assert raised == []


def test_an_axis_without_a_quantity_has_no_label(plot, qapp):
    bare = Plot("bare", LOG_FREQUENCY, PlotAxis("x"), LIGHT)
    bare.across.show_nothing()
    bare.resize(600, 200)
    bare.show()
    qapp.processEvents()
    assert not bare.across.label.isVisible()
    bare.close()


def test_the_grid_matches_the_ticks_when_it_is_first_drawn(plot, qapp):
    for top in (1.0, 7.0):
        plot.setXRange(0.0, top, padding=0)
        plot.setYRange(0.0, top, padding=0)
        picture = plot.grab().toImage()
        box = plot.mapFromScene(plot.getViewBox().sceneBoundingRect()).boundingRect()
        row = box.top() + 20
        ground = max(
            (picture.pixelColor(x, row) for x in range(box.left(), box.right())), key=QColor.lightness
        )
        seen = [x for x in range(box.left() + 2, box.right() - 2) if picture.pixelColor(x, row) != ground]
        ticks = plot.across.levels[0][1:-1]
        assert len(ticks) >= 2
        for tick in ticks:
            place = box.left() + box.width() * tick / top
            assert min(abs(place - x) for x in seen) < 3


def test_axis_ranges_follow_curves_and_ignore_error_bands(plot, qapp):
    curve, band = plot.curve(curve_style(0)), plot.band(curve_style(0))
    curve.setData([0.0, 1.0, 2.0], [0.8, 1.0, 0.9])
    band.set_data([0.0, 1.0, 2.0], [1e-15, 0.9, 1e-15], [1e10, 1.1, 1e10])
    plot.show()
    qapp.processEvents()
    low, high = plot.getViewBox().viewRange()[1]
    assert 0.5 < low < high < 1.5


def test_the_cursor_shows_values_and_their_differences_from_a_mark(plot, qapp, qtbot):
    plot.curve(curve_style(0), "mass").setData([0.0, 1.0, 2.0], [0.0, 0.004, 0.002])
    plot.show()
    qapp.processEvents()
    box = plot.getViewBox()
    at = plot.mapFromScene(box.mapViewToScene(QPointF(1.02, 0.001)))
    qtbot.mouseMove(plot.viewport(), at)
    qapp.processEvents()
    assert "mass: 4 mm/s" in plot.reading.text
    plot.activateWindow()
    plot.setFocus()
    qtbot.waitUntil(plot.hasFocus)
    qtbot.keyClick(plot, Qt.Key.Key_D)
    plot.reading.show_at(QPointF(1.52, 0.003))
    assert "Δ 0.5" in plot.reading.text
    assert "2.00" in plot.reading.text.partition("Δ")[2]
    plot.leaveEvent(QEvent(QEvent.Type.Leave))
    assert plot.reading.text == ""


def read_at_one(plot):
    plot.show()
    plot.reading.show_at(QPointF(1.0, 0.0))
    return plot.reading.text


def test_cursor_readings_follow_the_current_curve(plot):
    """The reading stayed when the curve was replaced or removed."""
    curve = plot.curve(curve_style(0), "mass")
    curve.setData([0.0, 1.0], [0.0, 0.004])
    assert "mass: 4 mm/s" in read_at_one(plot)
    curve.setData([0.0, 1.0], [0.0, 0.007])
    assert "mass: 7 mm/s" in plot.reading.text
    plot.wipe()
    assert plot.reading.text == ""
    assert [
        each.text() for each in plot.findChildren(QLabel) if each.isVisible() and "mm/s" in each.text()
    ] == []
    plot.curve(curve_style(0), "other").setData([0.0, 1.0], [0.0, 0.001])
    assert "other: 1 mm/s" in read_at_one(plot)


def test_cursor_readings_and_copies_use_the_current_axis_unit(plot):
    """A plot reused for another channel kept the unit of the first channel."""
    plot.curve(curve_style(0), "base").setData([0.0, 1.0], [0.0, 2.0])
    plot.up.show_unit(PlotAxis("Acceleration", "m/s²"))
    assert "base: 2 m/s²" in read_at_one(plot)
    assert numbers_of(plot, ",").splitlines()[::2] == ["Curve,Time (s),Acceleration (m/s²)", "base,1,2"]


def test_a_mark_keeps_its_values_when_the_axis_becomes_logarithmic(plot):
    plot.curve(curve_style(0), "mass").setData([0.0, 1.0], [0.001, 0.1])
    plot.show()
    plot.reading.show_at(QPointF(0.5, 0.01))
    plot.reading.mark_or_unmark()
    plot.turn_scale()
    assert plot.reading.text == ""
    plot.reading.show_at(QPointF(0.5, -1.0))
    assert "+20.00 dB" in plot.reading.text
    assert sorted(line.value() for line in plot.reading._lines[2:]) == [-2.0, 0.5]
    plot.turn_scale()
    plot.reading.show_at(QPointF(0.5, -0.01))
    plot.reading.mark_or_unmark()
    plot.turn_scale()
    plot.reading.show_at(QPointF(0.5, -1.0))
    assert "Δ" in plot.reading.text
    assert "dB" not in plot.reading.text


def test_pictures_and_numbers_are_copied_and_saved_without_overwriting(plot, qapp, tmp_path):
    plot.curve(curve_style(0), "mass").setData([0.0, 1.0], [0.5, 0.25])
    plot.show()
    offered = {action.text(): action.trigger for action in plot.actions()}
    offered["Copy the numbers"]()
    assert QGuiApplication.clipboard().text().splitlines() == [
        "Curve\tTime (s)\tVelocity of the mass (mm/s)",
        "mass\t0\t500",
        "mass\t1\t250",
    ]
    offered["Copy the picture"]()
    assert QGuiApplication.clipboard().image().width() == plot.width()
    for ending in ("csv", "svg", "png"):
        write_plot(plot, tmp_path / f"a.{ending}")
        assert (tmp_path / f"a.{ending}").stat().st_size > 40
        with pytest.raises(FileExistsError):
            write_plot(plot, tmp_path / f"a.{ending}")
    with pytest.raises(OSError, match="must end in"):
        write_plot(plot, tmp_path / "a.nothing")


@pytest.mark.skipif(sys.platform == "win32", reason="limits on file size exist on POSIX only")
@pytest.mark.parametrize("ending", ["csv", "svg", "png"])
def test_a_failure_to_save_a_plot_leaves_no_file(plot, tmp_path, ending):
    plot.curve(curve_style(0), "mass").setData([0.0, 1.0], [0.5, 0.25])
    plot.show()
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
    try:
        with pytest.raises(OSError, match="large"):
            write_plot(plot, tmp_path / f"a.{ending}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [*tmp_path.iterdir()] == []


def test_outdated_results_are_greyed_out(plot, qapp):
    plot.curve(curve_style(0)).setData([0.0, 1.0], [0.0, 0.001])
    plot.show()
    qapp.processEvents()
    before = dark_pixels(plot)
    plot.setEnabled(False)
    qapp.processEvents()
    assert dark_pixels(plot) > before + 20


def test_outdated_images_are_greyed_out(plot, qapp):
    plot.addItem(pg.ImageItem(np.full((4, 4, 4), 255, dtype=np.uint8)))
    plot.show()
    qapp.processEvents()
    assert dark_pixels(plot) == 0
    plot.setEnabled(False)
    qapp.processEvents()
    assert dark_pixels(plot) > 20


def test_a_level_line_keeps_its_value_when_the_axis_becomes_logarithmic(plot):
    zero, high = plot.level(LIMIT, 0.0), plot.level(LIMIT, 100.0)
    plot.turn_scale()
    assert (zero.isVisible(), high.value()) == (False, 2.0)
    below = plot.level(LIMIT, -1.0)
    plot.turn_scale()
    assert (zero.value(), high.value(), below.value()) == (0.0, 100.0, -1.0)
    assert zero.isVisible()
    assert below.isVisible()
    plot.wipe()
    plot.turn_scale()
    assert plot.level(LIMIT, 10.0).value() == 1.0


def test_the_axis_below_an_image_keeps_its_scale(plot):
    plot.addItem(pg.ImageItem(np.ones((4, 4))))
    {action.text(): action.trigger for action in plot.actions()}["Linear or logarithmic"]()
    assert plot.scales[1] is Scale.LINEAR


def test_cursor_readings_include_the_bounds_of_the_curve(plot):
    plot.curve(curve_style(0), "mass").setData([0.0, 1.0, 2.0], [0.001, 0.004, 0.001])
    shade = LineStyle(lambda theme: theme.traces[0])
    plot.band(shade, "mass").set_data([0.0, 1.0, 2.0], [0.0, 0.003, 0.0], [0.002, 0.006, 0.002])
    plot.band(shade, "another").set_data([1.0], [0.5], [0.6])
    assert "mass: 4 mm/s   bounds 3 mm/s to 6 mm/s" in read_at_one(plot)
