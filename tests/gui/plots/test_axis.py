"""Ticks of a logarithmic axis carry 1, 2 and 5 of every decade, and never overlap."""

from math import log10

import pytest

from vibench.gui.plots import LOG_FREQUENCY, PlotAxis
from vibench.gui.plots._axis import AxisItem, logarithmic_ticks, number_text


def test_decades_are_labelled_at_one_two_and_five():
    (_, major), (_, minor) = logarithmic_ticks(log10(10), log10(2000))
    assert [round(10**value) for value in major] == [10, 20, 50, 100, 200, 500, 1000, 2000]
    assert round(10 ** minor[0]) == 30


def test_less_than_a_decade_is_labelled_at_round_numbers():
    ((_, major),) = logarithmic_ticks(log10(150), log10(350))
    assert [round(10**value) for value in major] == [150, 200, 250, 300, 350]


@pytest.mark.parametrize(
    ("value", "text"),
    [(10, "10"), (100, "100"), (1000, "1k"), (20000, "20k"), (1e-9, "10⁻⁹"), (2e-5, "2·10⁻⁵")],
)
def test_numbers_are_written_as_people_read_them(value, text):
    assert number_text(value) == text


def test_the_unit_stands_in_the_label_and_never_with_a_prefix_of_its_own(qapp):
    item = AxisItem("bottom", LOG_FREQUENCY)
    item.setRange(10, 20000)
    assert item.labelText == "Frequency (Hz)"
    assert "kHz" not in item.labelString()


def test_metres_are_shown_as_micrometres(qapp):
    item = AxisItem("left", PlotAxis("Displacement", "µm", 1e6))
    assert item.tickStrings([0, 5e-6, 1e-5], 1.0, 5e-6) == ["0", "5", "10"]
