"""Noise is determined by its position, for any block size."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.world.sensors import PAGE, NoiseStream


@given(st.lists(st.integers(1, 3000), min_size=1, max_size=12), st.integers(0, 3 * PAGE))
def test_noise_does_not_depend_on_the_block_size(sizes, first):
    whole = NoiseStream(1, "here").draw(first, sum(sizes))
    stream, position, parts = NoiseStream(1, "here"), first, []
    for size in sizes:
        parts.append(stream.draw(position, size))
        position += size
    assert np.array_equal(np.concatenate(parts), whole)


def test_a_noise_stream_can_return_zero_samples():
    assert NoiseStream(1, "here").draw(17, 0).shape == (0,)


def test_noise_is_white_and_gaussian_with_unit_variance():
    count = 400_000
    noise = NoiseStream(3, "here").draw(0, count)
    spread = 5 / np.sqrt(count)
    assert abs(noise.mean()) < spread
    assert abs(noise.std() - 1) < spread
    assert abs(np.mean(noise**4) - 3) < 20 * spread
    assert abs(np.mean(noise[1:] * noise[:-1])) < spread
    assert abs(np.mean(noise[PAGE:] * noise[:-PAGE])) < spread


@pytest.mark.parametrize(("seed", "place"), [(1, "there"), (2, "here")])
def test_noise_at_other_positions_or_with_another_seed_is_independent(seed, place):
    one, other = NoiseStream(1, "here").draw(0, 100_000), NoiseStream(seed, place).draw(0, 100_000)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.02
