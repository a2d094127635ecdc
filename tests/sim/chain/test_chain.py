"""Matrices of a chain, and refused chains."""

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from vibench.sim import gong2025
from vibench.sim.chain import Chain, chain_of


def test_a_chain_that_moves_as_a_whole_stretches_only_the_spring_to_the_base():
    specimen = gong2025()
    together = chain_of(specimen, 5).stiffness_matrix @ np.ones(15)
    assert together[0] == pytest.approx(specimen.stiffnesses[0])
    np.testing.assert_allclose(together[1:], 0.0, atol=1e-9)


def test_a_coupling_spring_acts_on_m0_of_its_cell_and_of_the_previous_cell():
    specimen = gong2025()
    stiffness = chain_of(specimen, 3).stiffness_matrix
    assert stiffness[3, 0] == stiffness[6, 3] == -specimen.stiffnesses[0]
    assert stiffness[6, 0] == 0.0
    np.testing.assert_array_equal(stiffness, stiffness.T)


def test_a_chain_round_trips_through_serialisation():
    adapter = TypeAdapter(Chain)
    chain = Chain((gong2025(), gong2025(contact="power:5", gap_m=30e-6)))
    assert adapter.validate_json(adapter.dump_json(chain)) == chain
    with pytest.raises(ValidationError):
        adapter.validate_python({"cells": (), "links": 3})


@pytest.mark.parametrize("cells", [0, -1, 10**6])
def test_an_impossible_number_of_cells_is_refused_with_a_readable_message(cells):
    with pytest.raises(ValueError, match=rf"^A chain of {cells} cells is not allowed: give 1 to \d+\.$"):
        chain_of(gong2025(), cells)
