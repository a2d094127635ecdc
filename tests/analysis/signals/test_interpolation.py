"""Interpolation between samples of one or several channels."""

import numpy as np
import pytest

from vibench.analysis.signals import REACH, interpolate

RNG = np.random.default_rng(5)
SAMPLES = 3000


def tones(positions):
    """Return three channels of tones within the accurate band of the interpolation."""
    cycles = np.array([[0.013], [0.21], [0.39]])
    return np.cos(2 * np.pi * cycles * positions + np.array([[0.3], [1.0], [2.0]]))


def test_jointly_interpolated_channels_match_the_sampled_signals():
    positions = RNG.uniform(REACH, SAMPLES - 1 - REACH, 4000)
    found = interpolate(tones(np.arange(SAMPLES)), positions)
    assert found == pytest.approx(tones(positions), abs=2e-9)


@pytest.mark.parametrize("tiny", [0.0, 1e-18, -1e-18, 1e-12])
def test_interpolating_channels_together_or_one_by_one_gives_equal_results(tiny):
    samples = tones(np.arange(SAMPLES))
    positions = np.concatenate([np.arange(-80.0, SAMPLES + 80) + tiny, RNG.uniform(-80, SAMPLES + 80, 300)])
    together = interpolate(samples, positions)
    assert np.array_equal(together, np.stack([interpolate(each, positions) for each in samples]))
    outside = (positions < -REACH - 1) | (positions > SAMPLES + REACH)
    assert not together[:, outside].any()
    inside = slice(80, 80 + SAMPLES)
    assert together[:, inside] == pytest.approx(samples, abs=1e-10)
