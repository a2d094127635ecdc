"""Signals are drawn with every impact at any zoom."""

import numpy as np
import pytest

from vibench.gui.pages.test.test_page import SignalCurve
from vibench.gui.plots.axis import TIME, PlotAxis
from vibench.gui.plots.line_style import curve_style
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.theme import LIGHT

RATE_HZ = 51200.0


@pytest.fixture
def plot(closing):
    plot = closing(Plot("signal", TIME, PlotAxis("Velocity", "m/s"), LIGHT))
    plot.resize(800, 300)
    plot.show()
    return plot


def drawn_data(plot):
    (item,) = plot.getPlotItem().listDataItems()
    return item.getData()


@pytest.mark.parametrize("place", np.linspace(0.001, 1.999, 13))
def test_an_impact_of_three_samples_is_visible_in_a_plot_of_two_seconds(plot, place):
    samples = np.zeros(round(2 * RATE_HZ))
    first = round(place * RATE_HZ)
    samples[first : first + 3] = (0.5, 1.0, -0.5)
    SignalCurve(plot, curve_style(0)).set_samples(samples, RATE_HZ)
    time_s, values = drawn_data(plot)
    assert len(values) < 4000
    assert values.max() == 1.0
    assert values.min() == -0.5
    assert abs(time_s[values.argmax()] - place) < 2 / 400


def test_zooming_in_shows_individual_samples(plot):
    samples = np.sin(2 * np.pi * 100 * np.arange(round(2 * RATE_HZ)) / RATE_HZ)
    curve = SignalCurve(plot, curve_style(0))
    curve.set_samples(samples, RATE_HZ)
    plot.setXRange(1.0, 1.01, padding=0)
    time_s, values = drawn_data(plot)
    np.testing.assert_allclose(values, np.sin(2 * np.pi * 100 * time_s), atol=1e-9)
    assert time_s[0] <= 1.0
    assert time_s[-1] >= 1.01
