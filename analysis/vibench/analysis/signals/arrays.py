"""Array types of results."""

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Samples = NDArray[np.floating]
"""Real numbers in double or single precision."""
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
