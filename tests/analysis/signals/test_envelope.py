"""The envelope contains the signal and touches it in every interval."""

import numpy as np
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from vibench.analysis.signals import envelope


@given(
    samples=arrays(np.float64, st.integers(1, 300), elements=st.floats(-1e3, 1e3)),
    bins=st.integers(1, 50),
)
def test_every_sample_of_a_signal_is_within_its_envelope(samples, bins):
    found = envelope(samples, 10.0, bins=bins)
    length = -(-samples.size // bins)
    places = np.arange(samples.size) // length
    assert found.lower.size <= bins
    assert np.all(found.lower[places] <= samples)
    assert np.all(samples <= found.upper[places])
    assert np.all(np.isin(found.lower, samples))
    assert np.all(np.isin(found.upper, samples))
    assert np.all((found.time_s > 0) & (found.time_s <= samples.size / 10.0))
