"""Chains without contact match closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from vibench.sim import gong2025
from vibench.sim.chain import (
    band_gaps,
    bloch_factor,
    chain_of,
    chain_transmissibility,
)


@given(frequency=st.floats(5.0, 1500.0), cells=st.integers(1, 40), damping=st.floats(1e-6, 1e-4))
@settings(max_examples=40, deadline=None)
def test_the_response_of_a_finite_chain_is_the_sum_of_two_bloch_waves(frequency, cells, damping):
    """The free end reflects waves: x_n = U cos((N - n + 1/2) mu) / cos((N + 1/2) mu), q = exp(i mu)."""
    specimen = gong2025(damping_time_s=damping)
    ours = chain_transmissibility(chain_of(specimen, cells), [frequency])[0, :, 0]
    q, n = bloch_factor(chain_of(specimen, 1), [frequency])[0], np.arange(1, cells + 1)
    theirs = q**n * (1.0 + q ** (2 * (cells - n) + 1)) / (1.0 + q ** (2 * cells + 1))
    np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-300)


def test_in_a_band_gap_the_motion_of_a_long_chain_decays_per_cell_like_a_bloch_wave():
    specimen = gong2025(damping_time_s=0.0)
    for gap in band_gaps(chain_of(specimen, 1)):
        for part in (0.2, 0.5, 0.8):
            upper = min(gap.upper_hz, 1.5 * gap.lower_hz)
            frequency = gap.lower_hz + part * (upper - gap.lower_hz)
            x = np.abs(chain_transmissibility(chain_of(specimen, 40), [frequency])[0, :, 0])
            decay = abs(bloch_factor(chain_of(specimen, 1), [frequency])[0])
            assert decay < 1.0 - 1e-3
            np.testing.assert_allclose(x[1:20] / x[:19], decay, rtol=max(1e-8, 2.0 * decay**41))


def test_zero_and_negative_frequencies_are_refused():
    with pytest.raises(ValueError, match=r"^Frequencies must be"):
        chain_transmissibility(chain_of(gong2025(), 2), [-1.0])
    with pytest.raises(ValueError, match=r"^Frequencies must be"):
        bloch_factor(chain_of(gong2025(), 1), [0.0])
