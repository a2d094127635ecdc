"""Transmission and coherence agree with pyFRF, if installed, on the same samples."""

import numpy as np
import pytest
from scipy import signal

from vibench.analysis import Estimator, transmissibility

RATE = 2048
SEGMENT = 512


@pytest.fixture(scope="module")
def noisy_pair():
    """Drive and response of a resonance at 260 Hz, both with added noise."""
    rng = np.random.default_rng(31)
    omega, damping = 2 * np.pi * 260, 0.02
    section = signal.bilinear([2 * damping * omega, omega**2], [1, 2 * damping * omega, omega**2], fs=RATE)
    clean = rng.standard_normal(40_000)
    drive = clean + 0.2 * rng.standard_normal(clean.size)
    return drive, signal.lfilter(*section, clean) + 0.3 * rng.standard_normal(clean.size)


WITHOUT_MEAN = slice(1, None)
"""pyFRF takes the mean off every segment, which changes the line at 0 Hz."""


@pytest.fixture(scope="module", params=["boxcar", "hann"])
def pyfrf_estimate(noisy_pair, request):
    """Window name and pyFRF's average over half-overlapping segments, tapered by our periodic window."""
    pyfrf = pytest.importorskip("pyFRF")
    taper = signal.get_window(request.param, SEGMENT)
    drive, response = (
        np.lib.stride_tricks.sliding_window_view(each, SEGMENT)[:: SEGMENT // 2, np.newaxis] * taper
        for each in noisy_pair
    )
    found = pyfrf.FRF(RATE, exc_type="f", resp_type="d", window="none", fft_len=SEGMENT, nperseg=SEGMENT)
    found.add_data(drive, response)
    return request.param, found


@pytest.mark.parametrize(
    ("estimator", "method", "how"),
    [
        (Estimator.H1, "get_H1", {}),
        (Estimator.H2, "get_H2", {}),
        # pyFRF assumes equal noise on both channels, independent of their units.
        (Estimator.HV, "get_Hv", {"noise_ratio": 1.0}),
    ],
)
def test_h1_h2_and_hv_match_pyfrf(noisy_pair, pyfrf_estimate, estimator, method, how):
    window, theirs = pyfrf_estimate
    ours = transmissibility(
        *noisy_pair, RATE, segment_samples=SEGMENT, window=window, estimator=estimator, **how
    )
    np.testing.assert_allclose(ours.frequency_hz, theirs.get_f_axis(), rtol=1e-14)
    np.testing.assert_allclose(
        ours.value[WITHOUT_MEAN], getattr(theirs, method)()[0, 0][WITHOUT_MEAN], rtol=1e-10
    )


def test_coherence_matches_pyfrf(noisy_pair, pyfrf_estimate):
    window, theirs = pyfrf_estimate
    ours = transmissibility(*noisy_pair, RATE, segment_samples=SEGMENT, window=window)
    np.testing.assert_allclose(
        ours.coherence[WITHOUT_MEAN], theirs.get_coherence()[0][WITHOUT_MEAN], rtol=1e-10
    )
