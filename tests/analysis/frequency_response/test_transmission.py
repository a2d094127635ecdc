"""Transmission from noise agrees with scipy and closed forms, and its bounds have their coverage."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import signal

from vibench.analysis import InvalidRequest, NotEnoughData, transmissibility
from vibench.analysis.errors import UnusableData
from vibench.analysis.frequency_response.transmissibility import FrequencyResponseSums

RATE = 1024.0


def noise(seed, *shape):
    return np.random.default_rng(seed).standard_normal(shape)


@pytest.mark.parametrize(("window", "overlap"), [("hann", 0.5), ("boxcar", 0.0), ("blackmanharris", 0.75)])
def test_h1_h2_and_coherence_agree_with_scipy_given_the_same_windows(window, overlap):
    x = noise(1, 20_000)
    y = signal.lfilter([0.3, -0.2, 0.1], [1, -0.5], x) + 0.1 * noise(2, 20_000)
    how = {"fs": RATE, "nperseg": 300, "noverlap": int(overlap * 300), "window": window, "detrend": False}
    _, s_xx = signal.welch(x, **how)
    _, s_yy = signal.welch(y, **how)
    frequency, s_xy = signal.csd(x, y, **how)
    ours = {
        name: transmissibility(
            x, y, RATE, segment_samples=300, window=window, overlap=overlap, estimator=name
        )
        for name in ("h1", "h2")
    }
    np.testing.assert_allclose(ours["h1"].frequency_hz, frequency, rtol=1e-14)
    np.testing.assert_allclose(ours["h1"].value, s_xy / s_xx, rtol=1e-10)
    np.testing.assert_allclose(ours["h2"].value, s_yy / np.conj(s_xy), rtol=1e-10)
    np.testing.assert_allclose(ours["h1"].coherence, np.abs(s_xy) ** 2 / (s_xx * s_yy), rtol=1e-10)


@settings(max_examples=25, deadline=None)
@given(cuts=st.lists(st.integers(1, 4999), max_size=6), overlap=st.sampled_from([0.0, 0.3, 0.5, 0.75]))
def test_the_block_size_does_not_change_the_transmission(cuts, overlap):
    rows = noise(3, 2, 5000)
    whole = transmissibility(rows[0], rows[1], RATE, segment_samples=128, overlap=overlap)
    sums = FrequencyResponseSums(whole.settings)
    edges = [0, *sorted(cuts), 5000]
    for start, stop in pairwise(edges):
        sums.add(rows[:, start:stop])
    np.testing.assert_allclose(sums.frequency_response().value, whole.value, rtol=1e-10, atol=1e-14)
    assert sums.frequency_response().n_eff == whole.n_eff


@pytest.mark.parametrize(
    ("overlap", "n_eff", "spread"), [(0.0, 64, 0.0884), (0.5, 120.4, 0.0645), (0.75, 131.7, 0.0616)]
)
def test_the_stated_uncertainty_is_the_scatter_of_repeated_estimates(overlap, n_eff, spread):
    """For H = 1 and a signal-to-noise ratio of 1: coherence 1/2, relative spread 1/sqrt(2 n_eff)."""
    segment, repeats = 64, 600
    rng = np.random.default_rng(4)
    values, coherences = [], []
    for _ in range(repeats):
        x = rng.standard_normal(64 * segment)
        result = transmissibility(
            x, x + rng.standard_normal(x.size), RATE, segment_samples=segment, overlap=overlap
        )
        values.append(result.value[2:-2])
        coherences.append(result.coherence[2:-2])
    assert result.n_eff == pytest.approx(n_eff, rel=0.005)
    scatter = np.std(np.abs(values), axis=0).mean()
    assert scatter == pytest.approx(spread, rel=0.03)
    assert np.std(np.angle(values), axis=0).mean() == pytest.approx(spread, rel=0.03)
    expected = 0.5 + 0.25 / n_eff
    assert np.mean(coherences) == pytest.approx(expected, abs=0.003)
    assert np.std(coherences, axis=0).mean() == pytest.approx(np.sqrt(1 / n_eff) * 0.5, rel=0.06)


def test_independent_noise_exceeds_the_coherence_limit_at_5_percent_of_lines():
    x, y = noise(5, 2, 32 * 20_002)
    segment = 64
    passed, lines, mean = 0, 0, 0.0
    for block in range(312):
        part = slice(block * 32 * segment, (block + 1) * 32 * segment)
        result = transmissibility(
            x[part], y[part], RATE, segment_samples=segment, window="boxcar", overlap=0.0
        )
        inner = slice(1, -1)
        passed += int(np.count_nonzero(result.coherence[inner] > result.coherence_significance))
        assert not np.any(result.is_significant[inner] & (result.coherence[inner] < 0.1))
        mean += float(np.sum(result.coherence[inner]))
        lines += result.value[inner].size
    assert result.coherence_significance == pytest.approx(1 - 0.05 ** (1 / 31), rel=1e-12)
    assert passed / lines == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / lines))
    assert mean / lines == pytest.approx(1 / 32, rel=0.03)


def test_noise_on_the_drive_biases_h1_and_noise_on_the_response_biases_h2_by_the_known_factor():
    clean = noise(6, 400_000)
    x, y = clean + 0.3 * noise(7, 400_000), clean + 0.31 * noise(8, 400_000)
    how = {"segment_samples": 256}

    def level(**choice):
        return float(np.abs(transmissibility(x, y, RATE, **how, **choice).value[2:-2]).mean())

    assert level(estimator="h1") == pytest.approx(1 / 1.09, abs=0.003)
    assert level(estimator="h2") == pytest.approx(1 + 0.31**2, abs=0.003)
    assert level(estimator="hv", noise_ratio=(0.31 / 0.3) ** 2) == pytest.approx(1, abs=0.003)
    assert level(estimator="drive", reference=clean) == pytest.approx(1, abs=0.003)


@settings(max_examples=20, deadline=None)
@given(power=st.floats(-6, 6))
def test_the_estimator_hv_does_not_depend_on_the_unit_of_the_response(power):
    scale = 10**power
    x, extra = noise(9, 2, 4000)
    y = 0.4 * x + 0.3 * extra
    base = transmissibility(x, y, RATE, segment_samples=100, estimator="hv", noise_ratio=2.0)
    scaled = transmissibility(
        x, scale * y, RATE, segment_samples=100, estimator="hv", noise_ratio=2.0 * scale**2
    )
    np.testing.assert_allclose(scaled.value / scale, base.value, rtol=1e-9)


def test_a_known_delay_is_removed_from_the_phase_of_a_transmission():
    x = noise(11, 60_003)
    result = transmissibility(x[3:], x[:-3], RATE, segment_samples=1024)
    line = 40
    frequency = result.frequency_hz[line]
    assert result.phase_rad[line] == pytest.approx(-2 * np.pi * frequency * 3 / RATE, abs=0.01)
    straight = result.without_delay(3 / RATE)
    assert abs(straight.phase_rad[line]) < 0.01
    assert straight.settings.delay_s == 3 / RATE


def test_gaps_in_the_samples_reduce_the_number_of_segments_but_not_the_coherence():
    x = noise(14, 200_000)
    y = 2 * x
    valid = np.ones(x.size, dtype=bool)
    for start in np.linspace(1000, 190_000, 60).astype(int):
        valid[start : start + 100] = False
    holes = np.where(valid, y, np.nan)
    result = transmissibility(x, holes, RATE, segment_samples=1000, valid=valid)
    assert np.all(result.coherence > 1 - 1e-12)
    np.testing.assert_allclose(result.value, 2, rtol=1e-12)
    touched = sum(not valid[start : start + 1000].all() for start in range(0, 199_001, 500))
    assert result.segments_excluded == touched
    assert result.segments_used + touched == 399


def test_gaps_in_the_samples_reduce_the_effective_number_of_averages():
    """Without every second segment, the half-overlapped segments are independent."""
    x = noise(15, 10_000)
    valid = np.ones(x.size, dtype=bool)
    valid[1500::1000] = True
    whole = transmissibility(x, x, RATE, segment_samples=1000, valid=valid)
    lone = transmissibility(x, x, RATE, segment_samples=1000, overlap=0.0)
    assert lone.n_eff == 10
    assert 10 < whole.n_eff < 19
    assert whole.segments_used == 19


@pytest.mark.parametrize(
    ("choice", "says"),
    [
        ({"estimator": "hv"}, "noise ratio"),
        ({"estimator": "h3"}, "h1, h2, hv, drive"),
        ({"estimator": "drive"}, "reference"),
        ({"noise_ratio": 1.0}, "only hv"),
        ({"estimator": "hv", "noise_ratio": -1.0}, "zero or more"),
        ({"window": "triangle"}, "hann"),
        ({"overlap": 1.0}, "below 1"),
        ({"confidence": 95.0}, "between 0 and 1"),
    ],
)
def test_an_invalid_transmission_request_names_the_allowed_values(choice, says):
    with pytest.raises(InvalidRequest, match=says):
        transmissibility(noise(16, 1000), noise(17, 1000), RATE, segment_samples=100, **choice)


def test_a_single_segment_is_not_enough_for_a_coherence():
    with pytest.raises(NotEnoughData, match="at least 2"):
        transmissibility(noise(18, 150), noise(19, 150), RATE, segment_samples=100, overlap=0.0)
    with pytest.raises(NotEnoughData, match="no whole valid segment"):
        transmissibility(noise(18, 50), noise(19, 50), RATE, segment_samples=100)


def test_a_non_finite_sample_is_refused_unless_marked_as_invalid():
    y = noise(20, 1000)
    y[500] = np.nan
    with pytest.raises(UnusableData, match="mark"):
        transmissibility(noise(21, 1000), y, RATE, segment_samples=100)


def test_channels_of_different_length_are_refused():
    with pytest.raises(InvalidRequest, match="equally long"):
        transmissibility(noise(22, 1000), noise(23, 999), RATE, segment_samples=100)


def test_a_spectral_line_without_drive_signal_has_no_transmission_and_is_not_significant():
    time = np.arange(4000) / RATE
    x = np.sin(2 * np.pi * 128 * time)
    result = transmissibility(np.zeros_like(x), x, RATE, segment_samples=1000)
    assert np.all(np.isnan(result.value))
    assert not result.is_significant.any()
