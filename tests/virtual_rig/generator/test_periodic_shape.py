import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.terminal_voltage import Rectangle, Sine, Table, Triangle

TOP_CODE = 16_383
TABLE = Table(np.random.default_rng(5).integers(0, TOP_CODE + 1, 37).astype(np.uint16), TOP_CODE)
SHAPES = {
    "sine": Sine(),
    "square": Rectangle(),
    "narrow pulse": Rectangle(0.07),
    "triangle": Triangle(),
    "table": TABLE,
}
STARTS = st.floats(0, 1, exclude_max=True)
SPANS = st.floats(1e-6, 40)


def mean(shape, start, span):
    return float(shape.mean(np.array([start]), np.array([span]))[0])


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@given(start=STARTS, span=SPANS)
def test_the_mean_of_a_shape_agrees_with_a_midpoint_sum(shape, start, span):
    points = 20_001
    phase = (start + span * (np.arange(points) + 0.5) / points) % 1.0
    brute = shape.mean(phase, np.zeros(points)).mean()
    # A midpoint sum misplaces each of the 37 jumps per cycle by at most half a step of height 2.
    allowed = 2 * 40 * (span + 1) / points
    assert mean(shape, start, span) == pytest.approx(brute, abs=allowed)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@given(start=STARTS, first=SPANS, second=SPANS)
def test_the_means_over_two_adjacent_parts_combine_to_the_mean_over_both(shape, start, first, second):
    middle = (start + first) % 1.0
    parts = first * mean(shape, start, first) + second * mean(shape, middle, second)
    assert (first + second) * mean(shape, start, first + second) == pytest.approx(parts, abs=1e-9)


@given(st.integers(0, 36), st.integers(1, 200))
def test_a_waveform_mean_over_whole_points_is_the_mean_of_its_codes(first, count):
    codes = TABLE.codes[np.arange(first, first + count) % 37].astype(float)
    expected = 2 * codes.mean() / TOP_CODE - 1
    assert mean(TABLE, (first + 1e-12) / 37, count / 37) == pytest.approx(expected, abs=1e-9)


def test_the_lowest_and_highest_codes_are_minus_one_and_plus_one():
    table = Table(np.array([0, TOP_CODE], dtype=np.uint16), TOP_CODE)
    values = table.mean(np.array([0.1, 0.6]), np.zeros(2))
    assert values.tolist() == [-1.0, 1.0]


def test_a_mean_over_a_tiny_part_of_a_point_equals_the_point():
    assert mean(TABLE, 0.3, 1e-15) == mean(TABLE, 0.3, 0.0)


def test_a_sine_averages_to_zero_over_a_whole_cycle():
    assert mean(Sine(), 0.3, 1.0) == pytest.approx(0, abs=1e-15)
