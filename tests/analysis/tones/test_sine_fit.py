"""The fit of a steady sine is exact without noise and has correct uncertainties with noise."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.analysis.errors import UnusableData
from vibench.analysis.tones import fit_sine

RATE = 4096.0


@settings(deadline=None)
@given(frequency_hz=st.floats(100, 400), phase=st.floats(-3, 3), count=st.integers(2000, 6000))
def test_a_noise_free_sine_is_fitted_exactly(frequency_hz, phase, count):
    x = 0.3 + 0.02 * np.cos(2 * np.pi * frequency_hz * np.arange(count) / RATE + phase)
    fit = fit_sine(x, RATE, near_hz=frequency_hz * 1.05)
    assert fit.frequency_hz == pytest.approx(frequency_hz, rel=1e-10)
    assert fit.amplitude == pytest.approx(0.02, rel=1e-9)
    assert np.angle(np.exp(1j * (fit.phase_rad - phase))) == pytest.approx(0, abs=1e-8)


def test_the_stated_uncertainty_of_a_fitted_frequency_matches_the_scatter():
    rng = np.random.default_rng(1)
    clean = np.cos(2 * np.pi * 260.3 * np.arange(4096) / RATE + 0.5)
    fits = [fit_sine(clean + 0.3 * rng.standard_normal(4096), RATE, near_hz=260) for _ in range(200)]
    scatter = np.std([fit.frequency_hz for fit in fits])
    assert np.mean([fit.sd_frequency_hz for fit in fits]) == pytest.approx(scatter, rel=0.2)


def test_noise_alone_gives_no_sine():
    with pytest.raises(UnusableData, match="near 260 Hz"):
        fit_sine(np.random.default_rng(2).standard_normal(4096), RATE, near_hz=260)
