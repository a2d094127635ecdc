"""The outline of a steady sine has straight edges; waves that are wide enough to see are not smoothed."""

import numpy as np
import pytest

from vibench.analysis.live import envelope, outline

RATE_HZ, COLUMNS = 51_200.0, 1000


def sine(frequency_hz, span_s, noise=0.0):
    time_s = np.arange(round(span_s * RATE_HZ)) / RATE_HZ
    wobble = noise * np.random.default_rng(1).standard_normal(time_s.size)
    return (0.3 + np.sin(2 * np.pi * frequency_hz * time_s) + wobble).astype(np.float32)


@pytest.mark.parametrize("frequency_hz", [95.0, 130.0, 260.0, 331.0, 470.0, 700.0, 2000.0])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_outline_of_a_steady_sine_has_straight_edges(frequency_hz, noise):
    low, high = outline(sine(frequency_hz, 2.0, noise), COLUMNS)
    room = 0.03 + 5 * noise
    assert high[4:-4] == pytest.approx(1.3, abs=room)
    assert low[4:-4] == pytest.approx(-0.7, abs=room)


def test_the_outline_of_slow_waves_is_not_smoothed():
    wave = sine(260.0, 0.2)
    for drawn, plain in zip(outline(wave, COLUMNS), envelope(wave, COLUMNS), strict=True):
        assert np.array_equal(drawn, plain)


def test_the_outline_of_noise_is_not_smoothed():
    noise = np.random.default_rng(2).standard_normal(102_400).astype(np.float32)
    assert np.array_equal(outline(noise, COLUMNS)[1], envelope(noise, COLUMNS)[1])


def test_an_impact_of_three_samples_is_in_the_outline():
    wave = sine(260.0, 2.0)
    wave[51_200:51_203] = 5.0
    _, high = outline(wave, COLUMNS)
    struck = np.flatnonzero(high > 4.9)
    assert 1 <= struck.size <= 4
    assert abs(struck.mean() - 500) <= 3


def test_the_outline_of_each_channel_uses_the_period_of_that_channel():
    both = np.stack((sine(260.0, 2.0), sine(20.0, 2.0)))
    low, high = outline(both, COLUMNS)
    assert np.array_equal(high[1], envelope(both[1], COLUMNS)[1])
    assert high[0, 4:-4].min() > 1.2
    assert low.shape == high.shape == (2, COLUMNS)


def test_lost_samples_stay_empty_and_silence_stays_zero_in_an_outline():
    lost = np.full(102_400, np.nan, dtype=np.float32)
    silent = np.zeros(102_400, dtype=np.float32)
    assert np.isnan(outline(lost, COLUMNS)[0]).all()
    assert (outline(silent, COLUMNS)[1] == 0).all()
    half = sine(260.0, 2.0)
    half[:51_200] = np.nan
    low, high = outline(half, COLUMNS)
    assert np.isnan(low[:490]).all()
    assert high[510:-4] == pytest.approx(1.3, abs=0.03)


@pytest.mark.parametrize(("start_hz", "stop_hz", "span_s"), [(150, 350, 8.2), (20, 600, 8.2), (350, 60, 4.0)])
@pytest.mark.parametrize("columns", [500, 1000, 1800, 1960])
def test_the_outline_of_a_steady_sweep_has_edges_without_notches(start_hz, stop_hz, span_s, columns):
    """With the period of the sweep's middle, the edges once fell to half at its slow end."""
    time_s = np.arange(round(span_s * RATE_HZ)) / RATE_HZ
    hz = start_hz + (stop_hz - start_hz) * time_s / span_s
    phase = 2 * np.pi * (start_hz * time_s + 0.5 * (stop_hz - start_hz) * time_s**2 / span_s)
    low, high = outline(np.cos(phase).astype(np.float32), columns)
    plain = envelope(np.cos(phase).astype(np.float32), columns)
    column_hz = hz[(np.arange(columns) + 0.5).astype(int) * time_s.size // columns]
    hidden = column_hz * span_s / columns > 1 / 5.0
    assert high[hidden].min() > 0.97
    assert low[hidden].max() < -0.97
    assert (low <= plain[0]).all()
    assert (high >= plain[1]).all()
