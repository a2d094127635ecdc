"""Arrays of numbers, for the checker of types."""

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Table = NDArray[np.float64]
Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
