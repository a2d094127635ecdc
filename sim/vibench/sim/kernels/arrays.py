"""What a kernel is handed, for the checker of types: arrays of numbers."""

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Table = NDArray[np.float64]
Complex = NDArray[np.complex128]
Counts = NDArray[np.int64]
Floats = NDArray[np.float64]
