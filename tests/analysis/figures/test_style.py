"""Tick labels on the axes of figures are sufficient to read values and do not overlap."""

from itertools import pairwise

import numpy as np
import pytest

from vibench.analysis.report._style import figure_style, magnitude_axis, new_figure


def _numbers(low, high):
    """Return each tick label of a magnitude axis with its lower and upper end [pixels]."""
    with figure_style():
        figure = new_figure(3.0)
        axes = figure.subplots()
        axes.plot([0, 1], [low, high])
        magnitude_axis(axes)
        axes.set_ylim(low, high)
        figure.canvas.draw()
        shown = [each for each in axes.get_yticklabels(which="both") if each.get_text()]
        boxes = [each.get_window_extent() for each in shown]
        inside = axes.get_window_extent()
        return [
            (each.get_text(), box.y0, box.y1)
            for each, box in zip(shown, boxes, strict=True)
            if inside.y0 <= (box.y0 + box.y1) / 2 <= inside.y1
        ]


@pytest.mark.parametrize(("low", "high"), [(1.5, 3.5), (1.7, 23), (0.4, 15), (0.02, 30), (1e-6, 10)])
def test_the_numbers_of_magnitude_axes_do_not_overlap(low, high):
    numbers = sorted(_numbers(low, high), key=lambda each: each[1])
    assert len(numbers) >= 2
    assert all(below[2] < above[1] for below, above in pairwise(numbers)), numbers


def test_axes_that_span_less_than_a_decade_show_intermediate_numbers():
    assert [text for text, *_ in _numbers(1.5, 3.5)] == ["2", "3"]
    assert {"0.4", "0.6", "1", "2"} <= {text for text, *_ in _numbers(0.3, 3.5)}
    assert {"$4\\cdot10^{-5}$", "$6\\cdot10^{-5}$"} <= {text for text, *_ in _numbers(3e-5, 7e-5)}


def test_axes_that_span_many_decades_show_only_powers_of_ten():
    assert all(np.log10(float(text)) % 1 == 0 for text, *_ in _numbers(0.005, 50))
