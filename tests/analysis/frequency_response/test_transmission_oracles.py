"""The estimator Hv agrees with pyFRF, if installed, on the same samples; H1 and H2 agree with scipy."""

import numpy as np
import pytest
from scipy import signal

from vibench.analysis import Estimator, transmissibility

RATE = 2048
SEGMENT = 512
WITHOUT_MEAN = slice(1, None)
"""pyFRF takes the mean off every segment, which changes the line at 0 Hz."""


def test_hv_matches_pyfrf():
    """The drive and the response of a resonance at 260 Hz both contain added noise."""
    pyfrf = pytest.importorskip("pyFRF")
    rng = np.random.default_rng(31)
    omega, damping = 2 * np.pi * 260, 0.02
    section = signal.bilinear([2 * damping * omega, omega**2], [1, 2 * damping * omega, omega**2], fs=RATE)
    clean = rng.standard_normal(40_000)
    drive = clean + 0.2 * rng.standard_normal(clean.size)
    response = signal.lfilter(*section, clean) + 0.3 * rng.standard_normal(clean.size)
    theirs = pyfrf.FRF(RATE, exc_type="f", resp_type="d", window="none", fft_len=SEGMENT, nperseg=SEGMENT)
    # Half-overlapping segments with our periodic window.
    taper = signal.get_window("hann", SEGMENT)
    windows = (np.lib.stride_tricks.sliding_window_view(each, SEGMENT) for each in (drive, response))
    theirs.add_data(*(each[:: SEGMENT // 2, np.newaxis] * taper for each in windows))
    # pyFRF assumes equal noise on both channels, independent of their units.
    ours = transmissibility(
        drive, response, RATE, segment_samples=SEGMENT, estimator=Estimator.HV, noise_ratio=1.0
    )
    np.testing.assert_allclose(ours.frequency_hz, theirs.get_f_axis(), rtol=1e-14)
    np.testing.assert_allclose(ours.value[WITHOUT_MEAN], theirs.get_Hv()[0, 0][WITHOUT_MEAN], rtol=1e-10)
