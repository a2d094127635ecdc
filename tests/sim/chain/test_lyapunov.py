"""Lyapunov exponents of chains match the modes and the exact tangent flow of one cell."""

import math

import numpy as np
import pytest

from tests.sim.chain.chain_matrices import chain_state_matrix
from vibench.sim import Harmonic, Outcome, gong2025, lyapunov_exponent
from vibench.sim.chain import chain_lyapunov_exponent, chain_of

pytestmark = pytest.mark.timeout(300)

CHAOTIC = Harmonic(260.0, 5e-6)


def test_the_exponent_of_a_chain_without_contact_is_the_slowest_decay():
    chain = chain_of(gong2025(contact="linear", damping_time_s=2e-4), 2)
    found = chain_lyapunov_exponent(chain, Harmonic(150.0, 1e-6), duration_s=2.0, settle_s=0.0)
    slowest = np.linalg.eigvals(chain_state_matrix(chain)[0]).real.max()
    assert found.local_exponents_per_s[-50:].mean() == pytest.approx(slowest, rel=1e-2)
    assert found.impacts == 0


@pytest.mark.thorough
@pytest.mark.parametrize("cells", [1, 2])
def test_a_slow_drive_does_not_change_the_exponent_of_a_chain(cells):
    chain = chain_of(gong2025(), cells)
    found = chain_lyapunov_exponent(chain, Harmonic(0.05, 1e-6), duration_s=6.0, settle_s=0.1)
    slowest = np.linalg.eigvals(chain_state_matrix(chain)[0]).real.max()
    assert abs(found.exponent_per_s - slowest) < 4.0 * found.standard_error_per_s
    assert found.exponent_per_s == pytest.approx(slowest, rel=0.01)


def test_the_exponent_of_one_chaotic_cell_matches_the_tangent_flow_within_the_errors():
    ours = chain_lyapunov_exponent(chain_of(gong2025(), 1), CHAOTIC, duration_s=3.0, settle_s=1.0)
    theirs = lyapunov_exponent(gong2025(), CHAOTIC, duration_s=10.0, settle_s=2.0)
    assert ours.exponent_per_s > 5.0 * ours.standard_error_per_s
    apart = abs(ours.exponent_per_s - theirs.exponent_per_s)
    assert apart < 4.0 * math.hypot(ours.standard_error_per_s, theirs.standard_error_per_s)


def test_a_chain_run_with_too_many_impacts_has_no_exponent():
    found = chain_lyapunov_exponent(
        chain_of(gong2025(), 2), Harmonic(220.0, 40e-6), duration_s=1.0, max_impact_rate_hz=1.0
    )
    assert found.outcome is Outcome.TOO_MANY_IMPACTS
    assert math.isnan(found.exponent_per_s)
    assert math.isnan(found.standard_error_per_s)
