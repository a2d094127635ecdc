"""The anti-alias filter: pass band, alias suppression, and delay."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.virtual_rig.world.conversion import EARLIEST_STEPS, GROUP_DELAY_SAMPLES, Decimator, history_steps

RATIOS = [1.0, 2.0, 4.0, 62.0, 2.32, 7.9]


def means_of_a_sine(cycles_per_step, first, count):
    edges = 2 * np.pi * cycles_per_step * (first + np.arange(count + 1))
    return -np.diff(np.cos(edges)) / (2 * np.pi * cycles_per_step)


def decimated_sine(ratio, delay_steps, cycles_per_sample, count=300):
    cycles_per_step = cycles_per_sample / ratio
    history = history_steps(ratio, delay_steps)
    means = means_of_a_sine(cycles_per_step, -history, history + int(np.ceil(count * ratio)))
    samples = Decimator(ratio, 0, delay_steps).convert(means, -history, 0, count)
    steps = (np.arange(count) + 1 - GROUP_DELAY_SAMPLES) * ratio - delay_steps
    return samples, np.sin(2 * np.pi * cycles_per_step * steps)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("ratio", "delay_steps", "cycles_per_sample"),
    [
        (ratio, delay_steps, (0.003, 0.1, 0.3, 0.4)[(row + column) % 4])
        for row, ratio in enumerate(RATIOS)
        for column, delay_steps in enumerate((EARLIEST_STEPS, 0.0, 0.37, 5.5))
    ],
)
def test_a_sine_in_the_pass_band_keeps_its_amplitude_and_its_phase(ratio, delay_steps, cycles_per_sample):
    samples, expected = decimated_sine(ratio, delay_steps, cycles_per_sample)
    tolerance = 1e-4 if cycles_per_sample / ratio < 0.23 else 5e-2  # the droop is corrected up to here
    assert np.max(np.abs(samples - expected)) < tolerance


@pytest.mark.parametrize("ratio", [2.0, 4.0, 62.0, 2.32, 7.9])
@pytest.mark.parametrize("cycles_per_sample", [0.56, 0.6, 0.75, 0.95])
def test_aliases_are_suppressed_by_more_than_80_db_in_decimation(ratio, cycles_per_sample):
    samples, _ = decimated_sine(ratio, 0.0, cycles_per_sample)
    assert 20 * np.log10(np.max(np.abs(samples))) < -80


@pytest.mark.parametrize("ratio", RATIOS)
def test_decimation_keeps_a_constant_unchanged(ratio):
    history = history_steps(ratio, 0.0)
    samples = Decimator(ratio, 0, 0.3).convert(np.full(history + 1000, 2.5), -history, 0, int(1000 / ratio))
    assert samples == pytest.approx(2.5, rel=1e-13)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("delay_steps", [EARLIEST_STEPS, 0.0, 300.0])
def test_decimated_samples_use_all_past_input_and_no_future_input(ratio, delay_steps):
    filtered = Decimator(ratio, 1000, delay_steps)
    assert filtered.first_step(0) >= 1000 - history_steps(ratio, delay_steps)
    for sample in range(50):
        last_step_known = 1000 + int(np.ceil((sample + 1) * ratio)) - 1
        assert filtered.first_step(sample) + filtered.reach - 1 <= last_step_known


@settings(deadline=None, max_examples=25)
@given(st.sampled_from(RATIOS), st.lists(st.integers(1, 40), min_size=1, max_size=6))
def test_decimated_samples_do_not_depend_on_the_block_size(ratio, sizes):
    history, count = history_steps(ratio, 0.2), sum(sizes)
    means = np.random.default_rng(1).standard_normal(history + int(np.ceil(count * ratio)) + 1)
    filtered = Decimator(ratio, 0, 0.2)
    whole = filtered.convert(means, -history, 0, count)
    position, parts = 0, []
    for size in sizes:
        skipped = max(filtered.first_step(position) - 1 + history, 0)
        parts.append(filtered.convert(means[skipped:].copy(), skipped - history, position, size))
        position += size
    assert np.array_equal(np.concatenate(parts), whole)
