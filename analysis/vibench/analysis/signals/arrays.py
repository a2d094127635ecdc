"""Array types of results, and runs of flags."""

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Samples = NDArray[np.floating]
"""Real numbers in double or single precision."""
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]


def runs_of(flags: Flags) -> Integers:
    """Return the first index and one past the last index of each run of set flags, shape (runs, 2)."""
    changes = np.diff(flags.astype(np.int8), prepend=0, append=0)
    return np.flatnonzero(changes).reshape(-1, 2)
