"""Labels of an axis do not overlap; labels of a logarithmic axis are at 1, 2 and 5 of every decade."""

from itertools import pairwise
from math import log10

import numpy as np
import pytest
from PySide6.QtGui import QFontMetricsF

from vibench.gui.plots.axis import (
    FREQUENCY,
    LOG_FREQUENCY,
    TIME,
    AxisItem,
    PlotAxis,
    Scale,
    logarithmic_ticks,
    number_text,
)


def test_each_decade_of_an_axis_has_labels_at_one_two_and_five():
    (_, major), (_, minor) = logarithmic_ticks(log10(10), log10(2000))
    assert [round(10**value) for value in major] == [10, 20, 50, 100, 200, 500, 1000, 2000]
    assert round(10 ** minor[0]) == 30


def test_an_axis_of_less_than_a_decade_is_labelled_at_round_numbers():
    ((_, major),) = logarithmic_ticks(log10(150), log10(350))
    assert [round(10**value) for value in major] == [150, 200, 250, 300, 350]


@pytest.mark.parametrize(
    ("value", "text"),
    [(10, "10"), (100, "100"), (1000, "1k"), (20000, "20k"), (1e-9, "10⁻⁹"), (2e-5, "2·10⁻⁵")],
)
def test_the_numbers_at_ticks_have_common_formats(value, text):
    assert number_text(value) == text


def test_frequency_labels_use_hertz_without_prefix(qapp):
    item = AxisItem("bottom", LOG_FREQUENCY)
    item.setRange(10, 20000)
    assert item.labelText == "Frequency (Hz)"
    assert "kHz" not in item.labelString()


def test_metres_are_shown_as_micrometres(qapp):
    item = AxisItem("left", PlotAxis("Displacement", "µm", 1e6))
    assert item.tickStrings([0, 5e-6, 1e-5], 1.0, 5e-6) == ["0", "5", "10"]


@pytest.mark.parametrize("scale", list(Scale))
@pytest.mark.parametrize("side", ["bottom", "left"])
def test_every_axis_has_at_least_two_numbers(qapp, scale, side):
    rng = np.random.default_rng(4)
    is_logarithmic = scale is Scale.LOGARITHMIC
    item = AxisItem(side, PlotAxis("Length", "m", scale=scale))
    item.setLogMode(x=is_logarithmic, y=is_logarithmic)
    for _ in range(400):
        span = 10.0 ** rng.uniform(-2, 1) if is_logarithmic else 10.0 ** rng.uniform(-9, 5)
        low = rng.uniform(-8, 3) if is_logarithmic else span * rng.uniform(-5, 5)
        size = rng.uniform(60, 1500)
        (_, values), *_ = item.tickValues(low, low + span, size)
        inside = [each for each in values if low <= each <= low + span]
        assert len(inside) >= 2, (low, span, size)


def test_minor_ticks_have_no_numbers(qapp):
    item = AxisItem("bottom", LOG_FREQUENCY)
    item.setLogMode(x=True, y=False)
    written = [item.tickStrings(values, 1.0, step) for step, values in item.tickValues(1.7, 2.9, 400.0)]
    assert set(written[0]) == {"100", "200", "500"}
    assert set(written[1]) == {""}


@pytest.mark.parametrize("width", [40, 60, 90, 140])
@pytest.mark.parametrize(
    ("quantity", "low", "high"),
    [(PlotAxis("Displacement", "m"), -30e-6, 30e-6), (FREQUENCY, 0.0, 1600.0), (TIME, 0.0, 0.03)],
)
def test_numbers_of_a_narrow_axis_do_not_touch(qapp, width, quantity, low, high):
    axis = AxisItem("bottom", quantity)
    values = [(step, places) for step, places in axis.tickValues(low, high, width) if places]
    labels = [text for step, places in values for text in axis.tickStrings(places, 1.0, step)]
    metrics = QFontMetricsF(axis.font())
    pixels = [(place - low) / (high - low) * width for _, places in values for place in places]
    half = [metrics.horizontalAdvance(text) / 2 for text in labels]
    ends = sorted((at - each, at + each) for at, each in zip(pixels, half, strict=True))
    assert all(right < left for (_, right), (left, _) in pairwise(ends)), labels
