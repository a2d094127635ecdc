"""A small study with chains, two gaps, two amplitudes and impacts."""

import numpy as np
import pytest

from vibench.sim.study import Study
from vibench.sim.study._grid import SESSION, TAKEN

SHORT = {"duration_s": 0.2, "window_s": 0.1, "budget_s": 0.0}
OF_THE_OCCASION = (TAKEN, SESSION, "digest")
"""What may differ between two computations of the same study."""


@pytest.fixture
def study():
    return Study(
        frequencies_hz={"start": 200.0, "stop": 280.0, "step": 20.0},
        amplitudes_m=(1e-6, 20e-6),
        gaps_m=(30e-6, 45e-6),
        starts=("rest", "up", "down"),
        duration_s=0.5,
        window_s=0.2,
        budget_s=0.0,
    )


@pytest.fixture(scope="session")
def require_equal():
    """Return a function that requires bit-for-bit equal results, except for run information."""

    def require(one, other):
        assert one.study == other.study
        assert one.arrays.keys() == other.arrays.keys()
        for name in one.arrays.keys() - set(OF_THE_OCCASION):
            is_float = one.arrays[name].dtype.kind == "f"
            assert np.array_equal(one.arrays[name], other.arrays[name], equal_nan=is_float), name

    return require
