"""Chains without contact match closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.sim.chain.chain_matrices import chain_modal_form, chain_state_matrix
from vibench.sim import base_transmissibility, gong2025
from vibench.sim.chain import (
    Chain,
    band_gaps,
    bloch_factor,
    chain_of,
    chain_transmissibility,
)

OVERDAMPED = gong2025(damping_time_s=1e-2)
UNEVEN = replace(gong2025(), dampings=(0.5, 0.0, 0.9))
"""Specimen whose dampings are not proportional to its springs."""


@pytest.mark.parametrize(
    "chain",
    [
        chain_of(gong2025(), 4),
        chain_of(gong2025(damping_time_s=0.0), 3),
        chain_of(OVERDAMPED, 2),
        Chain((gong2025(), UNEVEN, gong2025())),
        chain_of(UNEVEN, 3),
    ],
)
def test_the_modes_of_a_chain_rebuild_its_state_matrix(chain):
    modes, (system, _) = chain_modal_form(chain), chain_state_matrix(chain)
    one = (modes.shapes.T @ modes.rows).real
    again = (modes.shapes.T @ (modes.rates[:, None] * modes.rows)).real
    np.testing.assert_allclose(one, np.eye(len(system)), atol=2e-11)
    scale = np.sqrt(np.outer(np.abs(system).max(axis=1), np.abs(system).max(axis=0)))
    assert np.max(np.abs(again - system) / scale) < 1e-10


def test_modes_of_equal_frequency_form_a_complete_set():
    apart = replace(gong2025(), stiffnesses=(1e-9, *gong2025().stiffnesses[1:]), dampings=(0.0, 0.0, 0.0))
    chain = chain_of(apart, 6)
    modes = chain_modal_form(chain)
    np.testing.assert_allclose((modes.shapes.T @ modes.rows).real, np.eye(36), atol=1e-9)


def test_critical_damping_is_refused_with_a_readable_message():
    specimen = gong2025(damping_time_s=0.0)
    omega = 2.0 * np.pi * chain_of(specimen, 2).natural_frequencies_hz[0]
    with pytest.raises(ValueError, match=r"^Two modes .* change a damping by 0\.1 per cent\.$"):
        chain_modal_form(chain_of(gong2025(damping_time_s=2.0 / omega), 2))


def test_one_cell_has_the_transmissibility_of_the_specimen():
    frequencies = np.linspace(0.0, 700.0, 50)
    ours = chain_transmissibility(chain_of(gong2025(), 1), frequencies)
    np.testing.assert_allclose(
        ours[:, 0], base_transmissibility(gong2025(), frequencies), rtol=1e-13, atol=1e-14
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


def test_a_long_chain_in_a_band_gap_decays_per_cell_like_a_bloch_wave():
    specimen = gong2025(damping_time_s=0.0)
    for gap in band_gaps(chain_of(specimen, 1)):
        for part in (0.2, 0.5, 0.8):
            upper = min(gap.upper_hz, 1.5 * gap.lower_hz)
            frequency = gap.lower_hz + part * (upper - gap.lower_hz)
            x = np.abs(chain_transmissibility(chain_of(specimen, 40), [frequency])[0, :, 0])
            decay = abs(bloch_factor(chain_of(specimen, 1), [frequency])[0])
            assert decay < 1.0 - 1e-3
            np.testing.assert_allclose(x[1:20] / x[:19], decay, rtol=max(1e-8, 2.0 * decay**41))


def test_a_long_chain_has_no_natural_frequency_within_a_gap():
    specimen = gong2025(damping_time_s=0.0)
    natural = chain_of(specimen, 30).natural_frequencies_hz
    gaps = band_gaps(chain_of(specimen, 1))
    assert len(gaps) == 3
    for gap in gaps:
        inside = (natural > gap.lower_hz * (1 + 1e-9)) & (natural < gap.upper_hz * (1 - 1e-9))
        assert not np.any(inside)


def test_zero_and_negative_frequencies_are_refused():
    with pytest.raises(ValueError, match=r"^Frequencies must be"):
        chain_transmissibility(chain_of(gong2025(), 2), [-1.0])
    with pytest.raises(ValueError, match=r"^Frequencies must be"):
        bloch_factor(chain_of(gong2025(), 1), [0.0])
