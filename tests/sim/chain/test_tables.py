"""The bound on the coupling between contacts of different cells, which allows separate time steps."""

import numpy as np
import pytest
from scipy.linalg import expm

from tests.sim.chain.chain_matrices import chain_impulses, chain_state_matrix
from vibench.sim import Accuracy, Harmonic, gong2025
from vibench.sim.chain import chain_of
from vibench.sim.chain._tables import CROSS_SHARE, chain_tables, cross_answers, markov_between

DRIVE = Harmonic(220.0, 40e-6)


def impulse_response(chain, later):
    """Return dp/dt of every cell after a unit impulse in every cell, by the matrix exponential."""
    system, _ = chain_state_matrix(chain)
    moved = expm(later * system) @ chain_impulses(chain)
    velocities = moved[3 * chain.size :].reshape(chain.size, 3, -1)
    return velocities[:, 1] - velocities[:, 2]


@pytest.mark.parametrize("damping_time_s", [0.0, 2e-5, 1e-4])
def test_the_response_of_a_cell_to_another_cell_within_a_window_stays_below_its_bound(damping_time_s):
    chain = chain_of(gong2025(damping_time_s=damping_time_s), 4)
    window = 40e-6
    bounds = cross_answers(markov_between(chain), window)
    for part in (0.3, 0.7, 1.0):
        answer = np.abs(impulse_response(chain, part * window))
        relative = answer / np.diagonal(impulse_response(chain, 0.0))[:, None]
        for i in range(4):
            for j in range(4):
                if i != j:
                    assert relative[i, j] <= bounds[abs(i - j)] * (1.0 + 1e-6) + 1e-15


@pytest.mark.parametrize("accuracy", list(Accuracy))
def test_the_shortest_window_keeps_simultaneous_contacts_within_tolerance(accuracy):
    chain = chain_of(gong2025(), 6)
    tables = chain_tables(chain, DRIVE, accuracy)
    allowed = CROSS_SHARE * accuracy.tolerance
    between = markov_between(chain)
    assert np.all(cross_answers(between, tables.windows[-1])[1:] <= allowed)
    for window, clash in zip(tables.windows, tables.clash, strict=True):
        assert np.all(cross_answers(between, window)[1 + int(clash) :] <= allowed)
    assert np.all(np.diff(tables.windows) < 0.0)


def test_cells_of_the_paper_are_independent_at_standard_accuracy():
    tables = chain_tables(chain_of(gong2025(), 8), DRIVE, Accuracy.STANDARD)
    assert tables.clash[0] == 0
    assert chain_tables(chain_of(gong2025(), 8), DRIVE, Accuracy.REFERENCE).clash[0] > 0
