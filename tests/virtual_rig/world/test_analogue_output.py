"""An analogue output plays queued samples once, without a gap, and with the exact mean."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.world.time_grid import USUAL_GRID
from vibench.virtual_rig.world.world import AnalogueOutput

GRID_RATE_HZ = USUAL_GRID.rate_hz


@given(
    st.floats(1000.0, 96e3),
    st.lists(st.floats(-3.5, 3.5), min_size=1, max_size=50),
    st.lists(st.integers(1, 200), min_size=1, max_size=5),
)
def test_the_integral_of_the_played_signal_matches_the_queued_signal(rate_hz, volts, blocks):
    output, step = AnalogueOutput(), 0
    output.queue(np.array(volts), rate_hz, 0)
    played = []
    while output.queued_samples(step) or not played:
        block = blocks[len(played) % len(blocks)]
        played.append(output.render(step, block))
        step += block
    expected = sum(volts) / rate_hz
    assert np.sum(np.concatenate(played)) / GRID_RATE_HZ == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert np.all(output.render(step, 10) == 0)


def test_every_output_sample_is_held_for_one_sample_period():
    output = AnalogueOutput()
    output.queue(np.array([1.0, -2.0, 3.0]), GRID_RATE_HZ / 2, 100)
    assert output.render(100, 8) == pytest.approx([1, 1, -2, -2, 3, 3, 0, 0])


def test_a_signal_queued_in_parts_plays_without_a_gap():
    output = AnalogueOutput()
    output.queue(np.array([1.0, 2.0]), GRID_RATE_HZ / 2, 0)
    first = output.render(0, 3)
    output.queue(np.array([3.0, 4.0]), GRID_RATE_HZ / 2, 3)
    assert np.concatenate([first, output.render(3, 6)]) == pytest.approx([1, 1, 2, 2, 3, 3, 4, 4, 0])


def test_an_analogue_output_counts_the_samples_not_yet_played():
    output = AnalogueOutput()
    output.queue(np.ones(4), GRID_RATE_HZ / 2, 0)
    assert [output.queued_samples(step) for step in (0, 1, 2, 7, 8, 9)] == [4, 4, 3, 1, 0, 0]
    output.drop()
    assert output.queued_samples(2) == 0
    assert np.all(output.render(2, 4) == 0)


def test_an_output_signal_after_a_pause_begins_at_once():
    output = AnalogueOutput()
    output.queue(np.ones(1), GRID_RATE_HZ, 0)
    output.render(0, 50)
    output.queue(np.array([5.0]), GRID_RATE_HZ, 50)
    assert output.render(50, 2) == pytest.approx([5, 0])
