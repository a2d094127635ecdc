"""Vertical stripes and lines are visible, even if they are thin and many."""

import pytest

from vibench.gui.plots.axis import LOG_FREQUENCY, TIME, PlotAxis
from vibench.gui.plots.line_style import Dash, LineStyle
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.theme import LIGHT

RED = LineStyle(lambda _theme: "#ff0000", fill_opacity=1.0)
LINE = LineStyle(lambda _theme: "#ff0000", Dash.SOLID)


@pytest.fixture
def plot(qapp):
    made = Plot("A plot", TIME, PlotAxis("Height", "m"), LIGHT)
    made.resize(600, 300)
    made.setXRange(0.0, 10.0, padding=0.0)
    made.show()
    yield made
    made.close()


def red_columns(plot, qapp):
    """Axis values of the columns that are red at half height."""
    qapp.processEvents()
    picture = plot.grab().toImage()
    box = plot.mapFromScene(plot.getViewBox().sceneBoundingRect()).boundingRect()
    ratio = picture.width() / plot.width()
    (low, high), _ = plot.getViewBox().viewRange()
    row = round(ratio * box.center().y())
    return [
        low + (high - low) * (column / ratio - box.left()) / box.width()
        for column in range(picture.width())
        if picture.pixelColor(column, row).red() - picture.pixelColor(column, row).green() > 100
    ]


def test_a_stripe_thinner_than_a_pixel_is_visible(plot, qapp):
    plot.stripes(RED).show_bands([(5.0, 5.0001)])
    (*_, seen) = red_columns(plot, qapp)
    assert seen == pytest.approx(5.0, abs=0.04)


def test_a_wide_stripe_covers_exactly_its_band(plot, qapp):
    plot.stripes(RED).show_bands([(2.0, 4.0), (3.0, 5.0)])
    seen = red_columns(plot, qapp)
    assert (min(seen), max(seen)) == pytest.approx((2.0, 5.0), abs=0.05)


def test_stripes_outside_the_view_are_not_drawn(plot, qapp):
    plot.stripes(RED).show_bands([(-5.0, -4.0), (12.0, 13.0)])
    assert red_columns(plot, qapp) == []


def test_separate_vertical_lines_are_all_visible_after_zooming_in(plot, qapp):
    plot.rules(LINE).show_at(0.02 * number for number in range(500))
    assert red_columns(plot, qapp) == []
    plot.setXRange(5.0, 5.1, padding=0.0)
    assert red_columns(plot, qapp)[:3] == pytest.approx([5.0, 5.02, 5.04], abs=2e-3)


def test_a_stripe_of_a_logarithmic_axis_is_at_its_frequency(qapp):
    made = Plot("A plot", LOG_FREQUENCY, PlotAxis("Height", "m"), LIGHT)
    made.resize(600, 300)
    made.setXRange(1.0, 3.0, padding=0.0)
    made.show()
    made.stripes(RED).show_bands([(100.0, 1000.0)])
    seen = red_columns(made, qapp)
    made.close()
    assert (min(seen), max(seen)) == pytest.approx((2.0, 3.0), abs=0.02)
